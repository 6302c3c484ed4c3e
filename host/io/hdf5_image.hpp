#pragma once

#include <cstddef>
#include <string>

#include "hdf5_handle.hpp"

namespace palpate {

/// The bytes of an HDF5 file made in memory. H5Fget_file_image() would not do: HDF5 1.10 spoils a
/// checksum in the image of a file with SWMR.
struct Hdf5Image {
  std::string bytes;         ///< complete once the file is closed; free space follows its end
  std::size_t capacity = 0;  ///< of HDF5's memory for it
};

/// Makes a file of this access property list live in memory; closing it writes its bytes to
/// `image`, which must live as long as the file.
void set_in_memory(hid_t access, Hdf5Image& image);

}  // namespace palpate
