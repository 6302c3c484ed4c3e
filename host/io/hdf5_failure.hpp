#pragma once

#include <hdf5.h>

#include <string>

namespace palpate {

/// Returns why HDF5's last call on this thread failed, in the words of the operating system, such
/// as "No space left on device"; "HDF5 failed" where the system was not the cause.
std::string hdf5_failure();

/// Gives up a file that could not be written: it stays as if the program had been killed now, and
/// H5Fclose() succeeds. Without this, HDF5 1.10 crashes at exit where a file has unsaved parts.
void give_up_hdf5_file(hid_t file);

}  // namespace palpate
