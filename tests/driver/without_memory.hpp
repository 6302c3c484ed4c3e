#pragma once

namespace palpate {

/// While it lives, whatever this thread allocates by `new` throws std::bad_alloc.
class WithoutMemory {
 public:
  WithoutMemory();
  ~WithoutMemory();
  WithoutMemory(const WithoutMemory&) = delete;
  WithoutMemory& operator=(const WithoutMemory&) = delete;
};

}  // namespace palpate
