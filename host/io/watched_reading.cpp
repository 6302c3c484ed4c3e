#include "io/watched_reading.hpp"

#include <hdf5.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <utility>

namespace palpate {

namespace {

// A fifth of the measured rate of inflating and widening.
constexpr std::uint64_t bytes_per_second = 20'000'000;

WatchedReading* watching = nullptr;
BrokenFiles broken_files;

std::uint64_t page_bytes() { return static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)); }

/// Private writable memory of this process in bytes, about as RLIMIT_DATA counts it; more than any
/// where the system does not tell.
std::uint64_t data_bytes() {
  std::uint64_t pages[6] = {};  // size, resident, shared, text, library, data
  std::ifstream statm("/proc/self/statm");
  for (std::uint64_t& field : pages) {
    statm >> field;
  }
  return statm ? pages[5] * page_bytes() : RLIM_INFINITY / 2;
}

}  // namespace

void watch_reading(WatchedReading& watched, BrokenFiles broken) {
  watching = &watched;
  broken_files = std::move(broken);
  // Of damaged files the library keeps pieces that it cannot close as the program ends, and says
  // so.
  ::H5dont_atexit();
}

bool is_reading_watched() { return watching != nullptr; }

std::string fault_known_of(const std::filesystem::path& path) {
  const auto found = broken_files.find(path.native());
  return found == broken_files.end() ? "" : found->second;
}

ReadingMark::ReadingMark(const std::filesystem::path& path) {
  if (watching == nullptr) {
    return;
  }
  dumpable_ = ::prctl(PR_GET_DUMPABLE);
  ::prctl(PR_SET_DUMPABLE, 0);
  // What the process holds already counts too: drivers may reserve more than the machine has.
  ::getrlimit(RLIMIT_DATA, &memory_);
  rlimit memory = memory_;
  memory.rlim_cur = std::min<rlim_t>(memory.rlim_cur, data_bytes() + machine_bytes());
  ::setrlimit(RLIMIT_DATA, &memory);
  watching->thread = ::gettid();
  begin_reading_step(0);
  std::strncpy(watching->file, path.c_str(), sizeof watching->file - 1);
}

ReadingMark::~ReadingMark() {
  if (watching == nullptr) {
    return;
  }
  watching->file[0] = '\0';
  ::setrlimit(RLIMIT_DATA, &memory_);
  ::prctl(PR_SET_DUMPABLE, dumpable_);
}

void begin_reading_step(std::uint64_t bytes) {
  if (watching != nullptr) {
    watching->patience_s = watching->least_patience_s + bytes / bytes_per_second;
    ++watching->steps;
  }
}

std::uint64_t machine_bytes() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * page_bytes();
}

}  // namespace palpate
