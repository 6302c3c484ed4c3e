#pragma once

#include <sys/mman.h>

#include <cstddef>

#include "support/child_process.hpp"

namespace palpate {

/// Whether a process can be kept from taking memory: qemu-user, for one, takes limits and does not
/// hold them.
inline bool limits_memory() {
  return status_of([] {
           limit_process(RLIMIT_DATA, 1 << 20);  // not 0: Linux does not hold a soft limit of 0
           constexpr std::size_t bytes = std::size_t{1} << 26;
           const void* const taken =
               ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
           ::_exit(taken == MAP_FAILED ? 0 : 1);
         }) == 0;
}

}  // namespace palpate
