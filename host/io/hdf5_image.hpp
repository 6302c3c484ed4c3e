#pragma once

#include <cstddef>
#include <string>

#include "hdf5_handle.hpp"

namespace palpate {

/// The bytes of an HDF5 file that is made in memory. Not those of H5Fget_file_image(): HDF5 1.10
/// spoils a checksum in the image of a file with SWMR.
struct Hdf5Image {
  std::string bytes;         ///< whole once the file is closed, with free space behind its end
  std::size_t capacity = 0;  ///< of HDF5's memory for it
};

/// Makes the file access property list put a file in memory, whose bytes go to `image` when it is
/// closed: it has to live as long as the file.
void set_in_memory(hid_t access, Hdf5Image& image);

}  // namespace palpate
