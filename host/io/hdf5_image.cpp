#include "io/hdf5_image.hpp"

#include <cstdlib>
#include <cstring>

namespace palpate {

namespace {

// Callbacks by which HDF5 manages a file's memory.

void* allocate(std::size_t size, H5FD_file_image_op_t, void* image) {
  static_cast<Hdf5Image*>(image)->capacity = size;
  return std::calloc(1, size);
}

void* copy(void* to, const void* from, std::size_t size, H5FD_file_image_op_t, void*) {
  return std::memcpy(to, from, size);
}

void* grow(void* memory, std::size_t size, H5FD_file_image_op_t, void* user) {
  auto& image = *static_cast<Hdf5Image*>(user);
  char* grown = static_cast<char*>(std::realloc(memory, size));
  if (grown != nullptr) {
    if (size > image.capacity) {
      // Zeros, so that the same content gives the same bytes.
      std::memset(grown + image.capacity, 0, size - image.capacity);
    }
    image.capacity = size;
  }
  return grown;
}

herr_t take(void* memory, H5FD_file_image_op_t operation, void* user) {
  auto& image = *static_cast<Hdf5Image*>(user);
  if (operation == H5FD_FILE_IMAGE_OP_FILE_CLOSE) {
    image.bytes.reset(static_cast<char*>(memory));
  } else {
    std::free(memory);
  }
  return 0;
}

void* share(void* image) { return image; }

herr_t keep(void*) { return 0; }

}  // namespace

void set_in_memory(hid_t access, Hdf5Image& image) {
  constexpr std::size_t growth = 1 << 20;
  H5FD_file_image_callbacks_t callbacks{allocate, copy, grow, take, share, keep, &image};
  H5Pset_fapl_core(access, growth, false);
  H5Pset_file_image_callbacks(access, &callbacks);
}

}  // namespace palpate
