#include "without_memory.hpp"

#include <cstdlib>
#include <new>

namespace {
thread_local bool without_memory = false;
}

// Replaces the standard library's operator new, also for the driver's library.
void* operator new(std::size_t bytes) {
  void* memory = without_memory ? nullptr : std::malloc(bytes > 0 ? bytes : 1);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace palpate {

WithoutMemory::WithoutMemory() { without_memory = true; }
WithoutMemory::~WithoutMemory() { without_memory = false; }

}  // namespace palpate
