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

/// Problem of a file on whose bytes HDF5 fails.
inline constexpr const char* hdf5_damaged =
    "cannot be read: the file is damaged; copy or record it again";

/// Value of an attribute (numbers or strings in row-major order), or shape of a dataset.
struct Hdf5Value {
  std::vector<std::uint64_t> shape;  ///< empty for a scalar
  std::vector<double> numbers;       ///< integers, floats and enumerations of any width
  std::vector<std::string> strings;  ///< of fixed or variable length
  std::string problem;               ///< why it cannot be read; "": it can
};

/// An open HDF5 file, those of the named attributes and datasets that its root group has, and the
/// rows of the datasets, which must hold numbers. Checks what a file claims before it allocates
/// memory for it. Every call is for one thread at a time that uses HDF5.
class Hdf5Reader {
 public:
  using Take = std::function<void(std::span<const double> numbers)>;

  /// A dataset's shape and problem, without numbers.
  struct Dataset : Hdf5Value {
    Hdf5Handle handle{H5I_INVALID_HID, H5Dclose};
    std::uint64_t band_bytes = 0;  ///< of the chunks that a pass over the rows holds at once
  };

  /// @param follows_links within the file; only where HDF5 can follow none to another file
  Hdf5Reader(const std::filesystem::path& path, const std::vector<std::string>& attributes,
             const std::vector<std::string>& datasets, bool follows_links);

  const std::string& problem() const { return problem_; }  ///< why it cannot be opened; "": it can
  const std::map<std::string, Hdf5Value>& attributes() const { return attributes_; }
  const std::map<std::string, Dataset>& datasets() const { return datasets_; }

  /// Reads the first rows of one of datasets() in row-major order, in pieces of 1 to hdf5_piece
  /// numbers; false where they cannot be read.
  bool read(const std::string& name, std::uint64_t rows, const Take& take);

 private:
  std::string open(const std::string& name, std::uint64_t file_bytes, Dataset& dataset) const;
  std::string reopen_with_cache(const std::string& name, hid_t creation, std::size_t width,
                                Dataset& dataset) const;

  bool follows_links_;
  Hdf5Handle file_{H5I_INVALID_HID, H5Fclose};
  std::string problem_;
  std::map<std::string, Hdf5Value> attributes_;
  std::map<std::string, Dataset> datasets_;
};

}  // namespace palpate
