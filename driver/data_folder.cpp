#include "driver/data_folder.hpp"

#include <dlfcn.h>
#include <link.h>

namespace palpate {

namespace {

/// The file that holds this code; empty if unknown.
std::filesystem::path own_file() {
  Dl_info info{};
  void* found = nullptr;
  // Any address of this code will do.
  if (dladdr1(reinterpret_cast<const void*>(&data_folder), &info, &found, RTLD_DL_LINKMAP) == 0) {
    return {};
  }
  const std::filesystem::path name = static_cast<const link_map*>(found)->l_name;
  return name.empty() ? "/proc/self/exe" : name;  // the program itself has no name there
}

}  // namespace

std::filesystem::path data_folder() {
  std::error_code code;
  auto folder = std::filesystem::weakly_canonical(own_file(), code).parent_path();
  // From lib/x86_64-linux-gnu up to the prefix: two folders.
  for (int up = 0; up < 3; ++up, folder = folder.parent_path()) {
    auto data = folder / "share" / "palpate";
    if (std::filesystem::is_directory(data, code)) {
      return data;
    }
  }
  return PALPATE_INSTALLED_DATA;
}

}  // namespace palpate
