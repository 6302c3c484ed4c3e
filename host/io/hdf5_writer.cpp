#include "io/hdf5_writer.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <unistd.h>

#include "io/atomic_file.hpp"
#include "model/descriptor.hpp"
#include "palpate/error.hpp"

namespace palpate {

static_assert(sizeof(Pose) == 3 * sizeof(double) && sizeof(glm::dvec2) == 2 * sizeof(double));

namespace {

// Callbacks by which HDF5 leaves a file's memory to its writer.

herr_t take(void* memory, H5FD_file_image_op_t, void* bytes) {
  static_cast<Hdf5Bytes*>(bytes)->reset(static_cast<char*>(memory));
  return 0;
}

void* share(void* bytes) { return bytes; }

herr_t keep(void*) { return 0; }

// Makes a file that lives in memory; closing it leaves its bytes to `bytes`.
Hdf5Handle file_in_memory(Hdf5Bytes& bytes, Hdf5Writer::Layout layout, std::size_t expected) {
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  constexpr std::size_t growth = 1 << 20;
  H5FD_file_image_callbacks_t callbacks{nullptr, nullptr, nullptr, take, share, keep, &bytes};
  H5Pset_fapl_core(access.get(), std::max(growth, expected), false);
  H5Pset_file_image_callbacks(access.get(), &callbacks);
  if (layout == Hdf5Writer::Layout::appendable) {
    set_appendable(access.get());
  }
  // HDF5 uses the name only for its list of open files.
  return {H5Fcreate("palpate", H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), H5Fclose};
}

Hdf5Handle text_type() {
  Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), H5T_VARIABLE);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  return type;
}

Hdf5Handle scalar() { return {H5Screate(H5S_SCALAR), H5Sclose}; }

Hdf5Handle extents(const Hdf5Writer::Shape& shape) {
  const std::vector<hsize_t> sizes(shape.begin(), shape.end());
  return {H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr), H5Sclose};
}

// Chunks of whole rows, about 64 KiB: every flush of a growing dataset writes one again.
std::vector<hsize_t> growing_chunk(const Hdf5Writer::Shape& shape, std::size_t value_bytes) {
  constexpr std::size_t bytes = 1 << 16;
  std::vector<hsize_t> chunk(shape.begin(), shape.end());
  std::size_t row_bytes = value_bytes;
  for (std::size_t axis = 1; axis < shape.size(); ++axis) {
    row_bytes *= shape[axis];
  }
  chunk[0] = std::max<std::size_t>(1, bytes / row_bytes);
  return chunk;
}

// Chunks of whole inner dimensions, up to 1 MiB of doubles, the size of HDF5's chunk cache.
std::vector<hsize_t> chunk_of(const Hdf5Writer::Shape& shape) {
  std::size_t room = (1 << 20) / sizeof(double);
  std::vector<hsize_t> chunk(shape.size());
  for (std::size_t axis = shape.size(); axis-- > 0;) {
    chunk[axis] = std::clamp<std::size_t>(room, 1, shape[axis]);
    room /= chunk[axis];
  }
  return chunk;
}

}  // namespace

void set_appendable(hid_t access) {
  H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
  // Metadata starts on pages: a process can be killed between two pages of one write, and a
  // checksum would not survive half of its metadata.
  constexpr hsize_t page = 4096;
  H5Pset_alignment(access, 1, page);
}

Hdf5Writer::Hdf5Writer(std::filesystem::path path, Layout layout, std::size_t expected_bytes)
    : path_(std::move(path)), file_(file_in_memory(bytes_, layout, expected_bytes)) {
  require(file_.valid(), "the file");
}

void Hdf5Writer::attribute(const char* name, std::string_view text) {
  const std::string terminated(text);
  const char* pointer = terminated.c_str();
  add_attribute(name, text_type().get(), scalar().get(), &pointer);
}

void Hdf5Writer::attribute(const char* name, std::span<const std::string> texts) {
  std::vector<const char*> pointers;
  for (const std::string& text : texts) {
    pointers.push_back(text.c_str());
  }
  add_attribute(name, text_type().get(), extents({texts.size()}).get(), pointers.data());
}

void Hdf5Writer::attribute(const char* name, double number) {
  add_attribute(name, H5T_NATIVE_DOUBLE, scalar().get(), &number);
}

void Hdf5Writer::attribute(const char* name, int number) {
  add_attribute(name, H5T_NATIVE_INT, scalar().get(), &number);
}

void Hdf5Writer::attribute(const char* name, const std::vector<double>& numbers) {
  add_attribute(name, H5T_NATIVE_DOUBLE, extents({numbers.size()}).get(), numbers.data());
}

void Hdf5Writer::dataset(const char* name, const Shape& shape,
                         const std::function<std::vector<double>(std::size_t)>& part,
                         Storage storage) {
  const Hdf5Handle dataset = create_dataset(name, shape, H5T_NATIVE_DOUBLE, storage);
  std::vector<hsize_t> first(shape.size(), 0);
  std::vector<hsize_t> extent(shape.begin(), shape.end());
  const Hdf5Handle space = extents(shape);
  const std::size_t step =
      std::accumulate(shape.begin() + 1, shape.end(), std::size_t{1}, std::multiplies());
  for (; first[0] < shape[0]; first[0] += extent[0]) {
    const std::vector<double> values = part(first[0]);
    extent[0] = values.size() / step;
    const Hdf5Handle memory(
        H5Screate_simple(static_cast<int>(extent.size()), extent.data(), nullptr), H5Sclose);
    require(extent[0] > 0 &&
                H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, first.data(), nullptr,
                                    extent.data(), nullptr) >= 0 &&
                H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT,
                         values.data()) >= 0,
            name);
  }
}

void Hdf5Writer::save(const std::function<void(const std::filesystem::path&)>& finished) {
  AtomicFile target(path_);
  require(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0, "the file");
  const ssize_t size = H5Fget_file_image(file_.get(), nullptr, 0);
  file_ = Hdf5Handle(H5I_INVALID_HID, H5Fclose);
  require(size > 0 && bytes_ != nullptr, "the file");
  target.write({bytes_.get(), static_cast<std::size_t>(size)});
  if (finished) {
    finished(target.path());
  }
  target.commit();
}

void Hdf5Writer::add_attribute(const char* name, hid_t type, hid_t space, const void* values) {
  const Hdf5Handle attribute(H5Acreate2(file_.get(), name, type, space, H5P_DEFAULT, H5P_DEFAULT),
                             H5Aclose);
  require(attribute.valid() && H5Awrite(attribute.get(), type, values) >= 0, name);
}

void Hdf5Writer::add_dataset(const char* name, const Shape& shape, hid_t type, const void* values,
                             Storage storage) {
  const Hdf5Handle dataset = create_dataset(name, shape, type, storage);
  require(H5Dwrite(dataset.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0, name);
}

Hdf5Handle Hdf5Writer::create_dataset(const char* name, const Shape& shape, hid_t type,
                                      Storage storage) {
  const Hdf5Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  type = storage == Storage::narrow ? H5T_NATIVE_FLOAT : type;
  bool ready = H5Pset_obj_track_times(creation.get(), false) >= 0;
  if (storage == Storage::compressed) {
    const std::vector<hsize_t> chunk = chunk_of(shape);
    constexpr unsigned level = 4;  // zlib's higher levels cost time and gain little on doubles
    ready = ready &&
            H5Pset_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data()) >= 0 &&
            H5Pset_shuffle(creation.get()) >= 0 && H5Pset_deflate(creation.get(), level) >= 0;
  }
  Hdf5Handle space = extents(shape);
  if (storage == Storage::growing) {
    const std::vector<hsize_t> chunk = growing_chunk(shape, H5Tget_size(type));
    std::vector<hsize_t> sizes(shape.begin(), shape.end());
    std::vector<hsize_t> max_sizes = sizes;
    max_sizes[0] = H5S_UNLIMITED;
    // NaN fills what a killed writer did not write.
    constexpr double unwritten = std::numeric_limits<double>::quiet_NaN();
    ready = ready &&
            H5Sset_extent_simple(space.get(), static_cast<int>(sizes.size()), sizes.data(),
                                 max_sizes.data()) >= 0 &&
            H5Pset_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data()) >= 0 &&
            (H5Tget_class(type) != H5T_FLOAT ||
             H5Pset_fill_value(creation.get(), H5T_NATIVE_DOUBLE, &unwritten) >= 0);
  }
  Hdf5Handle dataset(
      H5Dcreate2(file_.get(), name, type, space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT),
      H5Dclose);
  require(ready && dataset.valid(), name);
  return dataset;
}

void Hdf5Writer::require(bool done, std::string_view what) const {
  if (!done) {
    throw Error(Fault::system, fmt::format("{}: HDF5 cannot write {}; free memory and try again",
                                           path_.string(), what));
  }
}

std::string hdf5_failure() {
  const std::string key = "error message = '";
  for (const std::string& said : hdf5_errors()) {
    if (const std::size_t at = said.find(key); at != std::string::npos) {
      const std::string rest = said.substr(at + key.size());
      return rest.substr(0, rest.find('\''));
    }
  }
  return "HDF5 failed";
}

void give_up_hdf5_file(hid_t file) {
  void* descriptor = nullptr;
  if (H5Fget_vfd_handle(file, H5P_DEFAULT, &descriptor) < 0) {
    return;
  }
  // The file's remaining writes go to /dev/null.
  if (const Descriptor nowhere("/dev/null", O_RDWR); nowhere.valid()) {
    ::dup3(nowhere.get(), *static_cast<int*>(descriptor), O_CLOEXEC);
  }
}

}  // namespace palpate
