#include "data_folder.hpp"

#include <dlfcn.h>

namespace palpate {

std::filesystem::path data_folder() {
  Dl_info info{};
  // Any address of this code will do.
  if (dladdr(reinterpret_cast<const void*>(&data_folder), &info) != 0) {
    std::error_code code;
    auto folder = std::filesystem::weakly_canonical(info.dli_fname, code).parent_path();
    // From lib/x86_64-linux-gnu up to the prefix: two folders.
    for (int up = 0; up < 3 && !code; ++up, folder = folder.parent_path()) {
      auto data = folder / "share" / "palpate";
      if (std::filesystem::is_directory(data, code)) {
        return data;
      }
    }
  }
  return PALPATE_INSTALLED_DATA;
}

}  // namespace palpate
