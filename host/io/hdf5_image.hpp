#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>

#include "io/hdf5_handle.hpp"

namespace palpate {

/// The bytes of an HDF5 file made in memory. H5Fget_file_image() would not do: HDF5 1.10 spoils a
/// checksum in the image of a file with SWMR.
struct Hdf5Image {
  struct Free {
    void operator()(char* memory) const { std::free(memory); }
  };
  std::unique_ptr<char, Free> bytes;  ///< HDF5's own, once the file is closed
  std::size_t capacity = 0;           ///< in bytes; free space follows the file's end
};

/// Makes a file of this access property list live in memory; closing it leaves its bytes to
/// `image`, which must live as long as the file.
void set_in_memory(hid_t access, Hdf5Image& image);

}  // namespace palpate
