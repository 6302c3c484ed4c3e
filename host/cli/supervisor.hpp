#pragma once

#include <cstdint>

namespace palpate::cli {

/// What a command does once more where a file that it read took it down.
enum class Restart { never, without_the_file };

/// Forks, and returns in the child, which runs the command. This process waits for the child and
/// ends as it does, by the same status or signal. Signals that are sent to this process reach the
/// child, both stop and go on together, and the child dies with this process, however that ends.
///
/// Where the child crashes in libhdf5, or takes longer than `patience_s` for a step of it, the file
/// is at fault. With Restart::without_the_file another child is forked, for which the file is a
/// broken one (see watch_reading()).
///
/// To be called before any thread, device or file is there.
/// @throws Error (Fault::input) in this process, naming the file, where that ends the command;
/// Error (Fault::system) where the system refuses another process
void supervise(Restart restart, std::uint64_t patience_s = 60);

}  // namespace palpate::cli
