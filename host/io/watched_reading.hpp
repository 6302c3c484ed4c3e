#pragma once

#include <sys/resource.h>
#include <sys/types.h>

#include <atomic>
#include <climits>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace palpate {

/// The HDF5 file that a process is reading, in memory that it shares with the process that watches
/// it: libhdf5 is known to crash and to loop on damaged files.
struct WatchedReading {
  char file[PATH_MAX];                    ///< "" between files
  std::atomic<pid_t> thread;              ///< that reads the file
  std::atomic<std::uint64_t> steps;       ///< grows with every step of reading
  std::atomic<std::uint64_t> patience_s;  ///< a step that takes longer never ends
  std::uint64_t least_patience_s;         ///< of steps that process nothing
};

/// Files that no process could read, and what is wrong with them.
using BrokenFiles = std::map<std::string, std::string>;

/// Has this process tell `watched` from now on what it reads. For a program that has its process to
/// itself: files may then also use as much memory as the machine has and no more, dump no core, and
/// follow links within them, since libhdf5 follows none to other files any more. Without it, as by
/// default, nothing changes for other users of libhdf5 in the process.
/// @param broken read no more
void watch_reading(WatchedReading& watched, BrokenFiles broken);
bool is_reading_watched();

/// Why the file is one of the broken files, or "".
std::string fault_known_of(const std::filesystem::path& path);

/// Names the file as the one that this thread reads with libhdf5, while it lives. One at a time.
class ReadingMark {
 public:
  explicit ReadingMark(const std::filesystem::path& path);
  ~ReadingMark();
  ReadingMark(const ReadingMark&) = delete;
  ReadingMark& operator=(const ReadingMark&) = delete;

 private:
  rlimit memory_{};
  int dumpable_ = 0;
};

/// Begins a step of reading, which processes so many bytes.
void begin_reading_step(std::uint64_t bytes);

/// The machine's memory.
std::uint64_t machine_bytes();

}  // namespace palpate
