#pragma once

#include <filesystem>

namespace palpate {

/// Where the driver's own files are, found from the library's place: the udev rule and the profiles
/// of serial boards. It holds wherever the prefix was moved to, and in the build tree.
std::filesystem::path data_folder();

}  // namespace palpate
