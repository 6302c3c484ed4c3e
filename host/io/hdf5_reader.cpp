#include "io/hdf5_reader.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/available_memory.hpp"
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
  const std::uint64_t bytes = stored_bytes(value.shape, width);
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

// Reading a piece takes milliseconds; a child that takes this long loops.
constexpr std::uint64_t piece_cpu_seconds = 2;
// A fifth of the measured rate of inflating and widening.
constexpr std::uint64_t cpu_bytes_per_second = 20'000'000;
// Enough for metadata and a piece of an answer.
constexpr std::uint64_t base_bytes = 256 << 20;
// Copies of a chunk in memory: stored, inflated (which grows by doubling) and unshuffled.
constexpr std::uint64_t copies_of_a_chunk = 5;

// Largest compression ratio of HDF5's own filters: deflate turns at most 258 bytes into 2 bits.
constexpr std::uint64_t largest_compression = 1032;

// Returns the type of the dataset's link; H5L_TYPE_ERROR where the file is damaged.
H5L_type_t link_type(hid_t file, const std::string& name) {
  H5L_info_t link{};
  return H5Lget_info(file, name.c_str(), &link, H5P_DEFAULT) < 0 ? H5L_TYPE_ERROR : link.type;
}

// Checked before the shape: for a virtual dataset's shape, HDF5 reads other files.
std::string storage_problem(hid_t creation) {
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

std::uint64_t product(std::span<const std::uint64_t> factors) {
  return std::accumulate(factors.begin(), factors.end(), std::uint64_t{1}, std::multiplies<>());
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

bool hdf5_shape(hid_t space, std::vector<std::uint64_t>& shape) {
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

Hdf5Rows::Hdf5Rows(hid_t file, const std::string& name, std::uint64_t file_bytes,
                   const Hdf5Confinement& confinement)
    : confinement_(confinement) {
  const H5L_type_t link = link_type(file, name);
  if (link != H5L_TYPE_HARD && link != H5L_TYPE_SOFT && link != H5L_TYPE_ERROR) {
    problem_ = "is a link to another file, which is not followed; copy the dataset into this file";
    return;
  }
  if (link == H5L_TYPE_SOFT && !confinement_.follows_links) {
    problem_ = "is a link, which may lead to another file; store the dataset itself";
    return;
  }
  dataset_ = Hdf5Handle(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
  const Hdf5Handle creation(dataset_.valid() ? H5Dget_create_plist(dataset_.get()) : -1, H5Pclose);
  if (!creation.valid()) {
    problem_ = link == H5L_TYPE_SOFT
                   ? "is a link that leads to no dataset of this file; store the dataset itself"
                   : hdf5_damaged;
    return;
  }
  if (problem_ = storage_problem(creation.get()); !problem_.empty()) {
    return;
  }
  const Hdf5Handle type(H5Dget_type(dataset_.get()), H5Tclose);
  const Hdf5Handle space(H5Dget_space(dataset_.get()), H5Sclose);
  const std::size_t width = type.valid() ? H5Tget_size(type.get()) : 0;
  if (!hdf5_shape(space.get(), shape_) || width == 0) {
    problem_ = hdf5_damaged;
    return;
  }
  const H5T_class_t kind = H5Tget_class(type.get());
  if (kind == H5T_STRING) {
    problem_ = "holds strings; store numbers";
  } else if (kind != H5T_INTEGER && kind != H5T_FLOAT && kind != H5T_ENUM) {
    problem_ = "has a type that Palpate does not read; store numbers";
  } else if (stored_bytes(shape_, width) >
             largest_dataset(dataset_.get(), creation.get(), file_bytes)) {
    problem_ = fmt::format(
        "has the shape {}, more than is stored of it: it is damaged or was never written; copy or "
        "record it again",
        shape_);
  } else if (!reopen_with_cache(file, name, creation.get(), width)) {
    problem_ = hdf5_damaged;
  }
}

// A pass over the rows meets each of their chunks again and again. All these chunks stay in HDF5's
// cache; else each would be inflated once for every piece.
bool Hdf5Rows::reopen_with_cache(hid_t file, const std::string& name, hid_t creation,
                                 std::size_t width) {
  if (H5Pget_layout(creation) != H5D_CHUNKED) {
    return true;
  }
  std::vector<hsize_t> chunk(shape_.size());
  const int rank = static_cast<int>(chunk.size());
  if (rank == 0 || H5Pget_chunk(creation, rank, chunk.data()) != rank ||
      std::count(chunk.begin(), chunk.end(), 0) > 0) {
    return false;
  }
  const auto deep = static_cast<std::size_t>(
      std::find_if(chunk.begin(), chunk.end() - 1, [](hsize_t extent) { return extent > 1; }) -
      chunk.begin());
  std::uint64_t chunks = 1;
  for (std::size_t axis = deep + 1; axis < chunk.size(); ++axis) {
    chunks *= shape_[axis] / chunk[axis] + 1;
  }
  const std::uint64_t chunk_bytes =
      stored_bytes(std::vector<std::uint64_t>(chunk.begin(), chunk.end()), width);
  if (__builtin_mul_overflow(chunk_bytes, chunks, &band_bytes_)) {
    return false;
  }
  const std::uint64_t needed = band_bytes_ + copies_of_a_chunk * chunk_bytes;
  // Otherwise a child's own limit would count as what is available.
  confinement_.memory_bytes(UINT64_MAX);
  const std::uint64_t available = available_memory_bytes();
  confinement_.memory_bytes(base_bytes);
  if (needed > available) {
    problem_ = fmt::format(
        "is stored in chunks of {}, of which {:.1f} GB have to be held at a time; {:.1f} GB of "
        "memory are available: store it in smaller chunks",
        chunk, static_cast<double>(needed) * 1e-9, static_cast<double>(available) * 1e-9);
    return true;
  }
  needed_bytes_ = needed;
  const Hdf5Handle access(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  // HDF5 hashes chunks to slots: ten slots a chunk, and an odd number, make collisions rare.
  const std::size_t slots = std::min<std::size_t>(10 * chunks + 521, 1'000'003);
  H5Pset_chunk_cache(access.get(), slots, std::max<std::size_t>(band_bytes_, 1 << 20), 1.0);
  dataset_ = Hdf5Handle(H5I_INVALID_HID, H5Dclose);  // an open dataset would keep its cache
  dataset_ = Hdf5Handle(H5Dopen2(file, name.c_str(), access.get()), H5Dclose);
  return dataset_.valid();
}

bool Hdf5Rows::read(std::uint64_t rows, const Take& take) {
  const std::size_t rank = shape_.size();
  std::vector<hsize_t> begin(rank, 0);
  std::vector<hsize_t> box(shape_.begin(), shape_.end());
  // A piece is a block along one axis: all of the axes after it, a single index of those before it.
  std::size_t axis = 0;
  while (axis + 1 < rank && product(std::span(shape_).subspan(axis + 1)) > hdf5_piece) {
    box[axis++] = 1;
  }
  const std::uint64_t inner = rank == 0 ? 1 : product(std::span(shape_).subspan(axis + 1));
  const std::uint64_t block =
      std::max<std::uint64_t>(1, hdf5_piece / std::max<std::uint64_t>(inner, 1));
  std::vector<double> values;
  confinement_.memory_bytes(base_bytes + needed_bytes_);
  const auto end = [&](std::size_t k) { return k == 0 ? rows : shape_[k]; };
  for (bool more = true; more;) {
    if (rank > 0) {
      box[axis] = std::min<hsize_t>(block, end(axis) - begin[axis]);
    }
    values.resize((rank == 0 ? 1 : box[axis]) * inner);
    // The time limit follows what a piece reads: the chunks of a pass, at most.
    confinement_.cpu_seconds(piece_cpu_seconds + band_bytes_ / cpu_bytes_per_second);
    if (values.empty() || !read_box(begin, box, values)) {
      return false;
    }
    take(values);
    more = false;
    for (std::size_t k = rank == 0 ? 0 : axis + 1; k-- > 0 && !more;) {
      begin[k] += box[k];
      more = begin[k] < end(k);
      if (!more && k > 0) {
        begin[k] = 0;
      }
    }
  }
  return true;
}

bool Hdf5Rows::read_box(const std::vector<hsize_t>& begin, const std::vector<hsize_t>& count,
                        std::span<double> values) const {
  if (begin.empty()) {
    return H5Dread(dataset_.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT,
                   values.data()) >= 0;
  }
  const Hdf5Handle there(H5Dget_space(dataset_.get()), H5Sclose);
  const hsize_t size = values.size();
  const Hdf5Handle here(H5Screate_simple(1, &size, nullptr), H5Sclose);
  return there.valid() &&
         H5Sselect_hyperslab(there.get(), H5S_SELECT_SET, begin.data(), nullptr, count.data(),
                             nullptr) >= 0 &&
         H5Dread(dataset_.get(), H5T_NATIVE_DOUBLE, here.get(), there.get(), H5P_DEFAULT,
                 values.data()) >= 0;
}

}  // namespace palpate
