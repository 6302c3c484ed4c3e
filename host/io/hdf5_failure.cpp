#include "io/hdf5_failure.hpp"

#include <unistd.h>

#include <string_view>

#include "io/descriptor.hpp"

namespace palpate {

std::string hdf5_failure() {
  std::string reason = "HDF5 failed";
  H5Ewalk2(
      H5E_DEFAULT, H5E_WALK_UPWARD,
      [](unsigned, const H5E_error2_t* error, void* text) -> herr_t {
        const std::string_view said = error->desc == nullptr ? "" : error->desc;
        const std::string_view key = "error message = '";
        if (const std::size_t at = said.find(key); at != std::string_view::npos) {
          const std::string_view rest = said.substr(at + key.size());
          *static_cast<std::string*>(text) = rest.substr(0, rest.find('\''));
          return 1;
        }
        return 0;
      },
      &reason);
  return reason;
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
