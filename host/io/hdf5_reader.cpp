#include "io/hdf5_reader.hpp"

#include <algorithm>

#include "io/hdf5_handle.hpp"

namespace palpate {

namespace {

void read_strings(hid_t attribute, hid_t type, hid_t space, std::size_t count, Hdf5Value& value) {
  if (H5Tis_variable_str(type) > 0) {
    std::vector<char*> texts(count, nullptr);
    if (H5Aread(attribute, type, texts.data()) < 0) {
      value.problem = hdf5_damaged;
      return;
    }
    for (const char* text : texts) {
      value.strings.emplace_back(text == nullptr ? "" : text);
    }
    H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data());
    return;
  }
  const std::size_t width = H5Tget_size(type);
  std::string texts(count * width, '\0');
  if (H5Aread(attribute, type, texts.data()) < 0) {
    value.problem = hdf5_damaged;
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::string text = texts.substr(i * width, width);
    text.resize(std::min(text.find('\0'), text.size()));
    if (H5Tget_strpad(type) == H5T_STR_SPACEPAD) {
      text.resize(text.find_last_not_of(' ') + 1);
    }
    value.strings.push_back(std::move(text));
  }
}

Hdf5Value read_attribute(hid_t attribute, std::uint64_t file_bytes) {
  Hdf5Value value;
  const Hdf5Handle type(attribute >= 0 ? H5Aget_type(attribute) : -1, H5Tclose);
  const Hdf5Handle space(attribute >= 0 ? H5Aget_space(attribute) : -1, H5Sclose);
  const std::size_t width = type.valid() ? H5Tget_size(type.get()) : 0;
  if (!hdf5_shape(space.get(), value.shape) || width == 0) {
    value.problem = hdf5_damaged;
    return value;
  }
  const H5T_class_t kind = H5Tget_class(type.get());
  if (kind != H5T_STRING && kind != H5T_INTEGER && kind != H5T_FLOAT && kind != H5T_ENUM) {
    value.problem = "has a type that Palpate does not read; store numbers or strings";
    return value;
  }
  const std::uint64_t bytes = hdf5_stored_bytes(value.shape, width);
  if (bytes > file_bytes) {
    value.problem = hdf5_damaged;
    return value;
  }
  const std::size_t count = bytes / width;
  if (count == 0) {
    return value;
  }
  if (kind == H5T_STRING) {
    read_strings(attribute, type.get(), space.get(), count, value);
    return value;
  }
  value.numbers.resize(count);
  if (H5Aread(attribute, H5T_NATIVE_DOUBLE, value.numbers.data()) < 0) {
    value.problem = hdf5_damaged;
  }
  return value;
}

// Returns HDF5's innermost account of the last failure.
std::string innermost_reason() {
  std::string reason;
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned index, const H5E_error2_t* error, void* text) -> herr_t {
        if (index == 0 && error->desc != nullptr) {
          *static_cast<std::string*>(text) = error->desc;
        }
        return 0;
      },
      &reason);
  return reason;
}

std::string open_problem(const std::string& reason) {
  if (reason.find("truncated") != std::string::npos) {
    return "is truncated; copy or record it again";
  }
  if (reason.find("lock file") != std::string::npos) {
    return "is being written by another program; wait until it is done";
  }
  return hdf5_damaged;
}

// Opens the file; invalid, with HDF5's account in `reason`, where that fails.
Hdf5Handle open_file(const std::filesystem::path& path, std::string& reason) {
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(access.get(), true, true);  // some network file systems have no locks
  Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  if (!file.valid()) {
    reason = innermost_reason();
    // SWMR opens a stream that is being recorded, or whose recorder was killed.
    file = {H5Fopen(path.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.get()), H5Fclose};
  }
  return file;
}

}  // namespace

Hdf5Reader::Hdf5Reader(const std::filesystem::path& path, std::uint64_t file_bytes,
                       const std::vector<std::string>& attributes,
                       const std::vector<std::string>& datasets, const Hdf5Confinement& confinement)
    : file_(H5I_INVALID_HID, H5Fclose) {
  if (H5Fis_hdf5(path.c_str()) <= 0) {
    problem_ = "is not an HDF5 file; give a file that Palpate or h5py wrote";
    return;
  }
  std::string reason;
  file_ = open_file(path, reason);
  if (!file_.valid()) {
    problem_ = open_problem(reason);
    return;
  }
  for (const std::string& name : attributes) {
    if (const htri_t there = H5Aexists(file_.get(), name.c_str()); there != 0) {
      const Hdf5Handle attribute(H5Aopen(file_.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
      attributes_[name] = read_attribute(attribute.get(), file_bytes);
    }
  }
  for (const std::string& name : datasets) {
    if (const htri_t there = H5Lexists(file_.get(), name.c_str(), H5P_DEFAULT); there != 0) {
      // A file that is being recorded grows.
      file_bytes = std::max<std::uint64_t>(file_bytes, std::filesystem::file_size(path));
      const Hdf5Rows& rows =
          rows_.try_emplace(name, file_.get(), name, file_bytes, confinement).first->second;
      Hdf5Value& value = datasets_[name];
      value.problem = rows.problem();
      value.shape = rows.shape();
    }
  }
}

bool Hdf5Reader::read(const std::string& dataset, std::uint64_t rows, const Hdf5Rows::Take& take) {
  return rows_.at(dataset).read(rows, take);
}

}  // namespace palpate
