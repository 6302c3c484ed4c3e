#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hdf5_handle.hpp"

namespace palpate {

/// A dataset of numbers that a forked child reads row by row.
class Hdf5Rows {
 public:
  /// Opens the dataset of this name; numbers stored outside this file are refused.
  /// @param file_bytes size of the file, which bounds what a damaged shape may claim
  Hdf5Rows(hid_t file, const std::string& name, std::uint64_t file_bytes);

  const std::string& problem() const { return problem_; }  ///< why it cannot be read; "": it can
  const std::vector<std::uint64_t>& shape() const { return shape_; }

  /// Sends rows [first, first + count) to the socket, as serve_hdf5() answers.
  void send(int socket, std::uint64_t first, std::uint64_t count);

 private:
  bool reopen_with_cache(hid_t file, const std::string& name, hid_t creation, std::size_t width);
  bool read(const std::vector<hsize_t>& begin, const std::vector<hsize_t>& count,
            std::span<double> values) const;

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

/// Returns the bytes of values of this shape and width; UINT64_MAX on overflow.
std::uint64_t hdf5_stored_bytes(std::span<const std::uint64_t> shape, std::uint64_t width);

}  // namespace palpate
