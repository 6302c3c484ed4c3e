#pragma once

#include <filesystem>

namespace palpate {

/// The folder of the driver's data files, the udev rule and the profiles of serial boards:
/// share/palpate in the nearest folder above the file that holds this code, the shared library or a
/// program that links it statically. So it is found in the build tree and in a moved installation.
/// Where there is no such folder, it is the one that the library was configured to be installed to.
std::filesystem::path data_folder();

}  // namespace palpate
