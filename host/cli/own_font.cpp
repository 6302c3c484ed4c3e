#include "cli/own_font.hpp"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <fontconfig/fontconfig.h>

namespace palpate {

void use_own_font() {
  std::error_code code;
  const auto program = std::filesystem::canonical("/proc/self/exe", code);
  const auto fonts = program.parent_path().parent_path() / "share" / "palpate" / "fonts";
  if (!std::filesystem::is_directory(fonts, code) || std::getenv("FONTCONFIG_FILE") != nullptr) {
    return;
  }
  // Fonts of an application, one file after another: with a folder, fontconfig would write a cache,
  // and complain on standard error where it must not.
  FcConfig* config = FcConfigCreate();
  for (const char* font : {"DejaVuSans.ttf", "DejaVuSans-Bold.ttf"}) {
    const std::string file = fonts / font;
    FcConfigAppFontAddFile(config, reinterpret_cast<const FcChar8*>(file.c_str()));
  }
  FcConfigSetCurrent(config);
}

}  // namespace palpate
