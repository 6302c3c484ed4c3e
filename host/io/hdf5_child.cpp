#include "hdf5_child.hpp"

#include <algorithm>

#include "forked_child.hpp"
#include "hdf5_contents.hpp"
#include "hdf5_handle.hpp"
#include "hdf5_rows.hpp"

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

class Sender {
 public:
  explicit Sender(int socket) : socket_(socket) {}

  void send(Hdf5Record kind) { forked_write(socket_, &kind, sizeof kind); }

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

  void refuse(std::string problem) {
    Hdf5Value value;
    value.problem = std::move(problem);
    send(Hdf5Record::refused, "", value);
    send(Hdf5Record::end);
  }

 private:
  void send_size(std::uint64_t size) { forked_write(socket_, &size, sizeof size); }

  template <class List>
  void send_list(const List& list) {
    send_size(list.size());
    forked_write(socket_, list.data(), list.size() * sizeof(typename List::value_type));
  }

  int socket_;
};

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

void serve_hdf5(int socket, const std::filesystem::path& path, std::uint64_t file_bytes,
                const std::vector<std::string>& attributes,
                const std::vector<std::string>& datasets) {
  Sender sender(socket);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);          // a file's filters must not load code
  H5Lunregister(H5L_TYPE_EXTERNAL);  // nor its links open other files, which may be FIFOs
  if (H5Fis_hdf5(path.c_str()) <= 0) {
    sender.refuse("is not an HDF5 file; give a file that Palpate or h5py wrote");
    return;
  }
  std::string reason;
  const Hdf5Handle file = open_file(path, reason);
  if (!file.valid()) {
    sender.refuse(open_problem(reason));
    return;
  }
  for (const std::string& name : attributes) {
    if (const htri_t there = H5Aexists(file.get(), name.c_str()); there != 0) {
      const Hdf5Handle attribute(H5Aopen(file.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
      sender.send(Hdf5Record::attribute, name, read_attribute(attribute.get(), file_bytes));
    }
  }
  std::map<std::uint64_t, Hdf5Rows> opened;
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    const std::string& name = datasets[i];
    if (const htri_t there = H5Lexists(file.get(), name.c_str(), H5P_DEFAULT); there != 0) {
      // A file that is being recorded grows.
      file_bytes = std::max<std::uint64_t>(file_bytes, std::filesystem::file_size(path));
      const Hdf5Rows& rows = opened.try_emplace(i, file.get(), name, file_bytes).first->second;
      Hdf5Value value;
      value.problem = rows.problem();
      value.shape = rows.shape();
      sender.send(Hdf5Record::dataset, name, value);
    }
  }
  sender.send(Hdf5Record::end);
  for (;;) {
    Hdf5Request request{};
    forked_read(socket, &request, sizeof request);  // ends the child after the last request
    opened.at(request.dataset).send(socket, request.first, request.count);
  }
}

}  // namespace palpate
