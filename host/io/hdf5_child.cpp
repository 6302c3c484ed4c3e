#include "hdf5_child.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forked_call.hpp"
#include "hdf5_contents.hpp"
#include "hdf5_handle.hpp"

namespace palpate {

namespace {

constexpr const char* damaged = "cannot be read: the file is damaged; copy or record it again";

// What attributes and datasets do alike.
struct Access {
  hid_t (*type)(hid_t);
  hid_t (*space)(hid_t);
  herr_t (*read)(hid_t id, hid_t memory_type, void* values);
};

constexpr Access attribute_access{H5Aget_type, H5Aget_space, H5Aread};
constexpr Access dataset_access{
    H5Dget_type, H5Dget_space, [](hid_t id, hid_t memory_type, void* values) {
      return H5Dread(id, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
    }};

void read_strings(hid_t id, const Access& access, hid_t type, hid_t space, std::size_t count,
                  Hdf5Value& value) {
  if (H5Tis_variable_str(type) > 0) {
    std::vector<char*> texts(count, nullptr);
    if (access.read(id, type, texts.data()) < 0) {
      value.problem = damaged;
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
  if (access.read(id, type, texts.data()) < 0) {
    value.problem = damaged;
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

// Bytes of the values as stored; more than can be said is the largest number.
std::uint64_t stored_bytes(const std::vector<std::uint64_t>& shape, std::size_t width) {
  std::uint64_t bytes = width;
  for (const std::uint64_t extent : shape) {
    if (__builtin_mul_overflow(bytes, extent, &bytes)) {
      return UINT64_MAX;
    }
  }
  return bytes;
}

Hdf5Value read_value(hid_t id, const Access& access, std::uint64_t largest_bytes) {
  Hdf5Value value;
  const Hdf5Handle type(access.type(id), H5Tclose);
  const Hdf5Handle space(access.space(id), H5Sclose);
  const int rank = space.valid() ? H5Sget_simple_extent_ndims(space.get()) : -1;
  const std::size_t width = type.valid() ? H5Tget_size(type.get()) : 0;
  if (rank < 0 || width == 0) {
    value.problem = damaged;
    return value;
  }
  std::vector<hsize_t> extents(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space.get(), extents.data(), nullptr);
  value.shape.assign(extents.begin(), extents.end());
  if (H5Sget_simple_extent_type(space.get()) == H5S_NULL) {
    value.shape = {0};  // h5py's Empty, its form of an empty fixed-length string
  }
  const H5T_class_t kind = H5Tget_class(type.get());
  if (kind != H5T_STRING && kind != H5T_INTEGER && kind != H5T_FLOAT && kind != H5T_ENUM) {
    value.problem = "has a type that Palpate does not read; store numbers or strings";
    return value;
  }
  const std::uint64_t bytes = stored_bytes(value.shape, width);
  if (bytes > largest_bytes) {
    value.problem = fmt::format(
        "has the shape {}, more than is stored of it: it is damaged or was never written; copy or "
        "record it again",
        value.shape);
    return value;
  }
  const std::size_t count = bytes / width;
  if (count == 0) {
    return value;
  }
  if (kind == H5T_STRING) {
    read_strings(id, access, type.get(), space.get(), count, value);
    return value;
  }
  value.numbers.resize(count);
  if (access.read(id, H5T_NATIVE_DOUBLE, value.numbers.data()) < 0) {
    value.problem = damaged;
  }
  return value;
}

// Bound of a dataset's size, from what is stored of it. A damaged shape would otherwise have
// terabytes allocated before the first read fails.
std::uint64_t largest_dataset(hid_t dataset, std::uint64_t file_bytes) {
  const std::uint64_t stored = std::min<std::uint64_t>(H5Dget_storage_size(dataset), file_bytes);
  const Hdf5Handle creation(H5Dget_create_plist(dataset), H5Pclose);
  return creation.valid() && H5Pget_layout(creation.get()) == H5D_CHUNKED &&
                 H5Pget_nfilters(creation.get()) > 0
             ? stored * largest_compression
             : stored;
}

class Sender {
 public:
  explicit Sender(int descriptor) : descriptor_(descriptor) {}

  void send(Hdf5Record kind) { forked_write(descriptor_, &kind, sizeof kind); }

  void send(Hdf5Record kind, const std::string& name, const Hdf5Value& value) {
    send(kind);
    send_list(name);
    send_list(value.problem);
    send_list(value.shape);
    send_list(value.numbers);
    send_size(value.strings.size());
    for (const std::string& text : value.strings) {
      send_list(text);
    }
  }

 private:
  void send_size(std::uint64_t size) { forked_write(descriptor_, &size, sizeof size); }

  template <class List>
  void send_list(const List& list) {
    send_size(list.size());
    forked_write(descriptor_, list.data(), list.size() * sizeof(typename List::value_type));
  }

  int descriptor_;
};

Hdf5Value problem(std::string text) {
  Hdf5Value value;
  value.problem = std::move(text);
  return value;
}

// HDF5's own account of the last failure, where it began.
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
  return damaged;
}

}  // namespace

void send_hdf5_values(int descriptor, const std::filesystem::path& path, std::uint64_t file_bytes,
                      const std::vector<std::string>& attributes,
                      const std::vector<std::string>& datasets) {
  Sender sender(descriptor);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);  // a file's filters must not load code
  if (H5Fis_hdf5(path.c_str()) <= 0) {
    sender.send(Hdf5Record::refused, "",
                problem("is not an HDF5 file; give a file that Palpate or h5py wrote"));
    sender.send(Hdf5Record::end);
    return;
  }
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(access.get(), true, true);  // some network file systems have no locks
  Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  if (!file.valid()) {
    const std::string reason = innermost_reason();
    // A stream that is being recorded, or whose recorder was killed.
    file = {H5Fopen(path.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.get()), H5Fclose};
    if (!file.valid()) {
      sender.send(Hdf5Record::refused, "", problem(open_problem(reason)));
      sender.send(Hdf5Record::end);
      return;
    }
    sender.send(Hdf5Record::unclosed, "", {});
  }
  for (const std::string& name : attributes) {
    if (const htri_t there = H5Aexists(file.get(), name.c_str()); there != 0) {
      const Hdf5Handle attribute(H5Aopen(file.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
      sender.send(Hdf5Record::attribute, name,
                  attribute.valid() ? read_value(attribute.get(), attribute_access, file_bytes)
                                    : problem(damaged));
    }
  }
  for (const std::string& name : datasets) {
    if (const htri_t there = H5Lexists(file.get(), name.c_str(), H5P_DEFAULT); there != 0) {
      const Hdf5Handle dataset(H5Dopen2(file.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
      // A file that is being written grows.
      file_bytes = std::max<std::uint64_t>(file_bytes, std::filesystem::file_size(path));
      sender.send(Hdf5Record::dataset, name,
                  dataset.valid() ? read_value(dataset.get(), dataset_access,
                                               largest_dataset(dataset.get(), file_bytes))
                                  : problem(damaged));
    }
  }
  sender.send(Hdf5Record::end);
}

}  // namespace palpate
