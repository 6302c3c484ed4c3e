#pragma once

namespace palpate {

/// Lets libhdf5 read in forked children from now on, or else, as by default, in this process. For a
/// program that has its process to itself; in another one, a fork may meet its threads, its memory
/// and its device at any moment.
void read_hdf5_in_children(bool in_children);
bool reads_hdf5_in_children();

}  // namespace palpate
