#pragma once

namespace palpate {

/// While it lives, every `new` of this thread throws std::bad_alloc.
class WithoutMemory {
 public:
  WithoutMemory();
  ~WithoutMemory();
  WithoutMemory(const WithoutMemory&) = delete;
  WithoutMemory& operator=(const WithoutMemory&) = delete;
};

}  // namespace palpate
