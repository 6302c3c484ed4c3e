#include "data_folder.hpp"

#include <dlfcn.h>

namespace palpate {

std::filesystem::path data_folder() {
  Dl_info info{};
  // Any address in the library will do.
  if (dladdr(reinterpret_cast<const void*>(&data_folder), &info) == 0) {
    return PALPATE_DATA_FROM_LIBRARY;
  }
  std::error_code code;
  const auto folder =
      std::filesystem::path(info.dli_fname).parent_path() / PALPATE_DATA_FROM_LIBRARY;
  return std::filesystem::weakly_canonical(folder, code);
}

}  // namespace palpate
