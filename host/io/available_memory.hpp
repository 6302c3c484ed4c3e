#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace palpate {

/// Bytes of memory that this process can still be given: by the machine, swap included, by its
/// control group and by its own limits.
std::uint64_t available_memory_bytes();

/// Throws Error (Fault::system), "<path>: <what> needs ... GB of memory", where there are fewer
/// bytes. Called before they are allocated: where memory is overcommitted, no allocation fails and
/// the system ends a process instead.
void require_memory(const std::filesystem::path& path, std::string_view what, std::uint64_t bytes);

}  // namespace palpate
