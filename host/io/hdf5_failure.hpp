#pragma once

#include <hdf5.h>

#include <string>

namespace palpate {

/// Why HDF5's last call on this thread failed, as the operating system put it, such as "No space
/// left on device"; "HDF5 failed" where it was not the system.
std::string hdf5_failure();

/// Gives up a file that could not be written: it stays as if the program had been killed here, and
/// H5Fclose() succeeds. HDF5 1.10 crashes at the program's end where a file with unsaved parts
/// could not be closed.
void give_up_hdf5_file(hid_t file);

}  // namespace palpate
