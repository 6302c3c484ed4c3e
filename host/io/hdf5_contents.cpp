#include "io/hdf5_contents.hpp"

#include <algorithm>
#include <numeric>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/recording_state.hpp"
#include "io/watched_reading.hpp"

namespace palpate {

namespace {

constexpr const char* damaged = "cannot be read: the file is damaged; copy or record it again";

// Copies of a chunk in memory: stored, inflated (which grows by doubling) and unshuffled.
constexpr std::uint64_t copies_of_a_chunk = 5;

// Largest compression ratio of HDF5's own filters: deflate turns at most 258 bytes into 2 bits.
constexpr std::uint64_t largest_compression = 1032;

/// Reads the shape of a dataspace, which may be invalid; false where the file is damaged.
bool read_shape(hid_t space, std::vector<std::uint64_t>& shape) {
  const int rank = space >= 0 ? H5Sget_simple_extent_ndims(space) : -1;
  if (rank < 0) {
    return false;
  }
  std::vector<hsize_t> extents(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space, extents.data(), nullptr);
  shape.assign(extents.begin(), extents.end());
  if (H5Sget_simple_extent_type(space) == H5S_NULL) {
    shape = {0};  // h5py's Empty, its form of an empty fixed-length string
  }
  return true;
}

bool holds_numbers(H5T_class_t kind) {
  return kind == H5T_INTEGER || kind == H5T_FLOAT || kind == H5T_ENUM;
}

bool read_texts(hid_t attribute, hid_t type, hid_t space, std::size_t count,
                std::vector<std::string>& all) {
  if (H5Tis_variable_str(type) > 0) {
    std::vector<char*> texts(count, nullptr);
    if (H5Aread(attribute, type, texts.data()) < 0) {
      return false;
    }
    for (const char* text : texts) {
      all.emplace_back(text == nullptr ? "" : text);
    }
    H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data());
    return true;
  }
  const std::size_t width = H5Tget_size(type);
  std::string texts(count * width, '\0');
  if (H5Aread(attribute, type, texts.data()) < 0) {
    return false;
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::string text = texts.substr(i * width, width);
    text.resize(std::min(text.find('\0'), text.size()));
    if (H5Tget_strpad(type) == H5T_STR_SPACEPAD) {
      text.resize(text.find_last_not_of(' ') + 1);
    }
    all.push_back(std::move(text));
  }
  return true;
}

std::string open_fault(const std::string& reason) {
  if (reason.find("truncated") != std::string::npos) {
    return "is truncated; copy or record it again";
  }
  if (reason.find("lock file") != std::string::npos) {
    return "is being written by another program; wait until it is done";
  }
  return damaged;
}

// Opens the file; invalid, with HDF5's account in `reason`, where that fails.
Hdf5Handle open_file(const std::filesystem::path& path, std::string& reason) {
  const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_file_locking(access.get(), true, true);  // some network file systems have no locks
  Hdf5Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  if (!file.valid()) {
    const std::vector<std::string> errors = hdf5_errors();
    reason = errors.empty() ? "" : errors.front();
    // SWMR opens a stream that is being recorded, or whose recorder was killed.
    file = {H5Fopen(path.c_str(), H5F_ACC_RDONLY | H5F_ACC_SWMR_READ, access.get()), H5Fclose};
  }
  return file;
}

// Checked before the shape: for a virtual dataset's shape, HDF5 reads other files.
std::string storage_fault(hid_t creation) {
  if (H5Pget_layout(creation) == H5D_VIRTUAL) {
    return "is a virtual dataset, whose numbers lie in other datasets, which are not read; copy "
           "them into this file";
  }
  if (H5Pget_external_count(creation) != 0) {
    return "keeps its numbers in another file, which is not opened; copy them into this file";
  }
  return "";
}

// Returns a bound of a dataset's size in bytes, from what is stored of it. A damaged shape would
// otherwise have terabytes allocated before the first read fails.
std::uint64_t largest_dataset(hid_t dataset, hid_t creation, std::uint64_t file_bytes) {
  const std::uint64_t stored = std::min<std::uint64_t>(H5Dget_storage_size(dataset), file_bytes);
  return H5Pget_layout(creation) == H5D_CHUNKED && H5Pget_nfilters(creation) > 0
             ? stored * largest_compression
             : stored;
}

bool read_box(hid_t dataset, const std::vector<hsize_t>& begin, const std::vector<hsize_t>& count,
              std::span<double> values) {
  const Hdf5Handle there(H5Dget_space(dataset), H5Sclose);
  const hsize_t size = values.size();
  const Hdf5Handle here(H5Screate_simple(1, &size, nullptr), H5Sclose);
  return there.valid() &&
         (H5Sget_simple_extent_ndims(there.get()) == 0 ||  // one number, which needs no selection
          H5Sselect_hyperslab(there.get(), H5S_SELECT_SET, begin.data(), nullptr, count.data(),
                              nullptr) >= 0) &&
         H5Dread(dataset, H5T_NATIVE_DOUBLE, here.get(), there.get(), H5P_DEFAULT, values.data()) >=
             0;
}

/// The file's size in bytes, which bounds what a damaged shape may claim. A file that is being
/// recorded grows.
std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code failure;
  const std::uintmax_t bytes = std::filesystem::file_size(path, failure);
  return failure ? 0 : bytes;
}

}  // namespace

std::uint64_t stored_bytes(std::span<const std::uint64_t> shape, std::uint64_t width) {
  std::uint64_t bytes = width;
  for (const std::uint64_t extent : shape) {
    if (__builtin_mul_overflow(bytes, extent, &bytes)) {
      return UINT64_MAX;
    }
  }
  return bytes;
}

Hdf5Contents::Hdf5Contents(const std::filesystem::path& path,
                           const std::vector<std::string>& attributes,
                           const std::vector<std::string>& datasets)
    : path_(path) {
  if (require_readable(path) == 0) {
    refuse("is empty; copy or record it again");
  }
  if (const std::string fault = fault_known_of(path); !fault.empty()) {
    refuse("{}", fault);
  }
  // Checked before the file is opened: a file closed by now is read as a whole.
  closed_ = !is_marked_open(path);
  const ConfinedSession session(path);
  try {
    open_fields(attributes, datasets);
  } catch (...) {
    close();  // within the session, which ends before the members do
    throw;
  }
}

Hdf5Contents::~Hdf5Contents() {
  const ConfinedSession session(path_);
  close();
}

void Hdf5Contents::close() {
  datasets_.clear();
  file_ = Hdf5Handle(H5I_INVALID_HID, H5Fclose);
}

void Hdf5Contents::open_fields(const std::vector<std::string>& attributes,
                               const std::vector<std::string>& datasets) {
  if (H5Fis_hdf5(path_.c_str()) <= 0) {
    refuse("is not an HDF5 file; give a file that Palpate or h5py wrote");
  }
  std::string reason;
  file_ = open_file(path_, reason);
  if (!file_.valid()) {
    refuse("{}", open_fault(reason));
  }
  for (const std::string& name : attributes) {
    if (H5Aexists(file_.get(), name.c_str()) != 0) {
      const Hdf5Handle attribute(H5Aopen(file_.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
      Attribute& value = attributes_[name];
      value.fault = read_attribute(attribute.get(), size_of(path_), value);
    }
  }
  for (const std::string& name : datasets) {
    if (H5Lexists(file_.get(), name.c_str(), H5P_DEFAULT) != 0) {
      Dataset& dataset = datasets_[name];
      dataset.fault = open(name, size_of(path_), dataset);
    }
  }
}

std::string Hdf5Contents::read_attribute(hid_t attribute, std::uint64_t file_bytes,
                                         Attribute& value) {
  const Hdf5Handle type(attribute >= 0 ? H5Aget_type(attribute) : -1, H5Tclose);
  const Hdf5Handle space(attribute >= 0 ? H5Aget_space(attribute) : -1, H5Sclose);
  const std::size_t width = type.valid() ? H5Tget_size(type.get()) : 0;
  if (!read_shape(space.get(), value.shape) || width == 0) {
    return damaged;
  }
  const H5T_class_t kind = H5Tget_class(type.get());
  if (kind != H5T_STRING && !holds_numbers(kind)) {
    return "has a type that Palpate does not read; store numbers or strings";
  }
  const std::uint64_t bytes = stored_bytes(value.shape, width);
  if (bytes > file_bytes) {
    return damaged;
  }
  const std::size_t count = bytes / width;
  value.numbers.resize(kind == H5T_STRING ? 0 : count);
  const bool read =
      count == 0 ||
      (kind == H5T_STRING ? read_texts(attribute, type.get(), space.get(), count, value.texts)
                          : H5Aread(attribute, H5T_NATIVE_DOUBLE, value.numbers.data()) >= 0);
  return read ? "" : damaged;
}

std::string Hdf5Contents::open(const std::string& name, std::uint64_t file_bytes,
                               Dataset& dataset) const {
  H5L_info_t info{};
  const H5L_type_t link = H5Lget_info(file_.get(), name.c_str(), &info, H5P_DEFAULT) < 0
                              ? H5L_TYPE_ERROR  // the file is damaged
                              : info.type;
  if (link != H5L_TYPE_HARD && link != H5L_TYPE_SOFT && link != H5L_TYPE_ERROR) {
    return "is a link to another file, which is not followed; copy the dataset into this file";
  }
  // Only a process that is watched has made libhdf5 follow no link to another file.
  if (link == H5L_TYPE_SOFT && !is_reading_watched()) {
    return "is a link, which may lead to another file; store the dataset itself";
  }
  Hdf5Handle& handle = dataset.handle;
  handle = Hdf5Handle(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Handle creation(handle.valid() ? H5Dget_create_plist(handle.get()) : -1, H5Pclose);
  if (!creation.valid()) {
    return link == H5L_TYPE_SOFT
               ? "is a link that leads to no dataset of this file; store the dataset itself"
               : damaged;
  }
  if (std::string fault = storage_fault(creation.get()); !fault.empty()) {
    return fault;
  }
  const Hdf5Handle type(H5Dget_type(handle.get()), H5Tclose);
  const Hdf5Handle space(H5Dget_space(handle.get()), H5Sclose);
  const std::size_t width = type.valid() ? H5Tget_size(type.get()) : 0;
  if (!read_shape(space.get(), dataset.shape) || width == 0) {
    return damaged;
  }
  if (const H5T_class_t kind = H5Tget_class(type.get()); !holds_numbers(kind)) {
    return kind == H5T_STRING ? "holds strings; store numbers"
                              : "has a type that Palpate does not read; store numbers";
  }
  if (stored_bytes(dataset.shape, width) >
      largest_dataset(handle.get(), creation.get(), file_bytes)) {
    return fmt::format(
        "has the shape {}, more than is stored of it: it is damaged or was never written; copy or "
        "record it again",
        dataset.shape);
  }
  return reopen_with_cache(name, creation.get(), width, dataset);
}

// A pass over the rows meets each of their chunks again and again. All these chunks stay in HDF5's
// cache; else each would be inflated once for every piece.
std::string Hdf5Contents::reopen_with_cache(const std::string& name, hid_t creation,
                                            std::size_t width, Dataset& dataset) const {
  if (H5Pget_layout(creation) != H5D_CHUNKED) {
    return "";
  }
  std::vector<hsize_t> chunk(dataset.shape.size());
  const int rank = static_cast<int>(chunk.size());
  if (rank == 0 || H5Pget_chunk(creation, rank, chunk.data()) != rank ||
      std::count(chunk.begin(), chunk.end(), 0) > 0) {
    return damaged;
  }
  const auto deep = static_cast<std::size_t>(
      std::find_if(chunk.begin(), chunk.end() - 1, [](hsize_t extent) { return extent > 1; }) -
      chunk.begin());
  std::uint64_t chunks = 1;
  for (std::size_t axis = deep + 1; axis < chunk.size(); ++axis) {
    chunks *= dataset.shape[axis] / chunk[axis] + 1;
  }
  const std::uint64_t chunk_bytes =
      stored_bytes(std::vector<std::uint64_t>(chunk.begin(), chunk.end()), width);
  if (__builtin_mul_overflow(chunk_bytes, chunks, &dataset.band_bytes)) {
    return damaged;
  }
  const std::uint64_t needed_bytes = dataset.band_bytes + copies_of_a_chunk * chunk_bytes;
  if (needed_bytes > machine_bytes()) {
    return fmt::format(
        "is stored in chunks of {}, of which {:.1f} GB have to be held at a time; the machine has "
        "{:.1f} GB of memory: store it in smaller chunks",
        chunk, static_cast<double>(needed_bytes) * 1e-9,
        static_cast<double>(machine_bytes()) * 1e-9);
  }
  const Hdf5Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  // HDF5 hashes chunks to slots: ten slots a chunk, and an odd number, make collisions rare.
  const std::size_t slots = std::min<std::size_t>(10 * chunks + 521, 1'000'003);
  H5Pset_chunk_cache(access.get(), slots, std::max<std::size_t>(dataset.band_bytes, 1 << 20), 1.0);
  dataset.handle = Hdf5Handle(H5I_INVALID_HID, H5Dclose);  // an open dataset would keep its cache
  dataset.handle = Hdf5Handle(H5Dopen2(file_.get(), name.c_str(), access.get()), H5Dclose);
  return dataset.handle.valid() ? "" : damaged;
}

const std::vector<std::uint64_t>& Hdf5Contents::shape(const std::string& name,
                                                      std::optional<std::size_t> rank) const {
  const Dataset& dataset = find(datasets_, "dataset", name);
  if (rank && dataset.shape.size() != *rank) {
    refuse("dataset '{}' has {} dimensions; give it {}", name, dataset.shape.size(), *rank);
  }
  return dataset.shape;
}

std::uint64_t Hdf5Contents::size(const std::string& name, std::uint64_t first_row,
                                 std::uint64_t rows) const {
  std::vector<std::uint64_t> extents = shape(name);
  if (extents.empty()) {
    extents.push_back(1);  // one number is a row
  }
  extents[0] = std::min(rows, extents[0] - std::min(first_row, extents[0]));
  return stored_bytes(extents, 1);
}

void Hdf5Contents::read(const std::string& name, const Take& take, std::uint64_t first_row,
                        std::uint64_t rows) const {
  const Dataset& dataset = find(datasets_, "dataset", name);
  std::vector<std::uint64_t> end = dataset.shape;
  if (end.empty()) {
    end.push_back(1);
  }
  std::vector<hsize_t> begin(end.size(), 0);
  begin[0] = std::min(first_row, end[0]);
  end[0] = begin[0] + std::min<std::uint64_t>(rows, end[0] - begin[0]);
  if (size(name, first_row, rows) == 0) {
    return;
  }
  const auto numbers_behind = [&](std::size_t axis) {
    return std::accumulate(end.begin() + static_cast<std::ptrdiff_t>(axis) + 1, end.end(),
                           std::uint64_t{1}, std::multiplies<>());
  };
  // A piece is a block along one axis: all of the axes after it, a single index of those before it.
  std::vector<hsize_t> box(end.begin(), end.end());
  std::size_t axis = 0;
  while (axis + 1 < end.size() && numbers_behind(axis) > hdf5_piece) {
    box[axis++] = 1;
  }
  const std::uint64_t inner = numbers_behind(axis);
  const std::uint64_t block = std::max<std::uint64_t>(1, hdf5_piece / inner);
  const ConfinedSession session(path_);
  std::vector<double> values;
  std::uint64_t taken = 0;
  for (bool more = true; more;) {
    box[axis] = std::min<hsize_t>(block, end[axis] - begin[axis]);
    values.resize(box[axis] * inner);
    begin_reading_step(dataset.band_bytes);  // at most: the chunks of a pass
    if (!read_box(dataset.handle.get(), begin, box, values)) {
      refuse("dataset '{}' {}", name, damaged);
    }
    take(taken, values);
    taken += values.size();
    more = false;
    for (std::size_t k = axis + 1; k-- > 0 && !more;) {
      begin[k] += box[k];
      more = begin[k] < end[k];
      if (!more && k > 0) {
        begin[k] = 0;
      }
    }
  }
}

}  // namespace palpate
