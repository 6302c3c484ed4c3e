#pragma once

#include <filesystem>

namespace palpate {

/// The folder of the driver's data files: the udev rule and the profiles of serial boards. It is
/// found from the loaded library's path, in the build tree and in a moved installation alike.
std::filesystem::path data_folder();

}  // namespace palpate
