#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "io/hdf5_handle.hpp"

namespace palpate {

/// Most numbers in one piece of a dataset.
inline constexpr std::uint64_t hdf5_piece = 1 << 17;

/// What the process that reads a file allows.
struct Hdf5Confinement {
  /// Links within the file are followed. Only where HDF5 can follow none to another file.
  bool follows_links = false;
  // Called with what the next step needs; a forked child has limits, which these raise.
  std::function<void(std::uint64_t)> memory_bytes = [](std::uint64_t) {};
  std::function<void(std::uint64_t)> cpu_seconds = [](std::uint64_t) {};
};

/// A dataset of numbers that is read row by row.
class Hdf5Rows {
 public:
  using Take = std::function<void(std::span<const double> numbers)>;

  /// Opens the dataset of this name; numbers stored outside this file are refused.
  /// @param file_bytes size of the file, which bounds what a damaged shape may claim
  Hdf5Rows(hid_t file, const std::string& name, std::uint64_t file_bytes,
           const Hdf5Confinement& confinement);

  const std::string& problem() const { return problem_; }  ///< why it cannot be read; "": it can
  const std::vector<std::uint64_t>& shape() const { return shape_; }

  /// Reads the first rows in row-major order, in pieces of 1 to hdf5_piece numbers; false where
  /// they cannot be read.
  bool read(std::uint64_t rows, const Take& take);

 private:
  bool reopen_with_cache(hid_t file, const std::string& name, hid_t creation, std::size_t width);
  bool read_box(const std::vector<hsize_t>& begin, const std::vector<hsize_t>& count,
                std::span<double> values) const;

  Hdf5Confinement confinement_;
  Hdf5Handle dataset_{H5I_INVALID_HID, H5Dclose};
  std::vector<std::uint64_t> shape_;
  std::uint64_t band_bytes_ = 0;    ///< of the chunks that a pass over the rows holds at once
  std::uint64_t needed_bytes_ = 0;  ///< of memory for these chunks and for inflating one
  std::string problem_;
};

/// Problem of a file on whose bytes HDF5 fails.
inline constexpr const char* hdf5_damaged =
    "cannot be read: the file is damaged; copy or record it again";

/// Reads the shape of a dataspace, which may be invalid; false where the file is damaged.
bool hdf5_shape(hid_t space, std::vector<std::uint64_t>& shape);

/// Value of an attribute (numbers or strings in row-major order), or shape of a dataset.
struct Hdf5Value {
  std::vector<std::uint64_t> shape;  ///< empty for a scalar
  std::vector<double> numbers;       ///< integers, floats and enumerations of any width
  std::vector<std::string> strings;  ///< of fixed or variable length
  std::string problem;               ///< why it cannot be read; "": it can
};

/// An open HDF5 file, those of the named attributes and datasets that its root group has, and the
/// rows of the datasets. Checks what a file claims before it allocates memory for it. Every call is
/// for one thread at a time that uses HDF5.
class Hdf5Reader {
 public:
  Hdf5Reader(const std::filesystem::path& path, std::uint64_t file_bytes,
             const std::vector<std::string>& attributes, const std::vector<std::string>& datasets,
             const Hdf5Confinement& confinement);

  const std::string& problem() const { return problem_; }  ///< why it cannot be opened; "": it can
  const std::map<std::string, Hdf5Value>& attributes() const { return attributes_; }
  /// Shapes and problems, without numbers.
  const std::map<std::string, Hdf5Value>& datasets() const { return datasets_; }

  /// Hdf5Rows::read() of a dataset in datasets().
  bool read(const std::string& dataset, std::uint64_t rows, const Hdf5Rows::Take& take);

 private:
  Hdf5Handle file_;
  std::string problem_;
  std::map<std::string, Hdf5Value> attributes_;
  std::map<std::string, Hdf5Value> datasets_;
  std::map<std::string, Hdf5Rows> rows_;
};

}  // namespace palpate
