#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace palpate {

/// What a forked child may use up.
struct ForkedLimits {
  std::uint64_t cpu_seconds;
  std::uint64_t memory_bytes;  ///< on top of what the process holds already; also of the answer
};

/// Runs `work` in a forked child and returns the bytes that it wrote to the descriptor it is given.
/// Whatever happens to the child, crash, endless loop or corrupted heap, the caller goes on, with
/// fewer bytes: a complete answer must be told from a part by its content. The child prints
/// nothing, dumps no core, runs no exit handlers, and must touch no device and start no thread.
/// @throws Error (Fault::system) where the system refuses another process.
std::string forked_call(const std::function<void(int descriptor)>& work,
                        const ForkedLimits& limits);

/// Writes all bytes to the descriptor, from within `work`; ends the child where that fails.
void forked_write(int descriptor, const void* data, std::size_t bytes);

}  // namespace palpate
