#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

namespace palpate {

/// Returns the memory in bytes that this process can still get: the least of what the machine (swap
/// included), its control group and its own limits leave.
std::uint64_t available_memory_bytes();

/// Returns the private writable memory of this process in bytes, as RLIMIT_DATA counts it; none
/// where the system does not tell.
std::optional<std::uint64_t> data_bytes();

/// Returns the bytes of values of this shape and width; UINT64_MAX on overflow.
std::uint64_t stored_bytes(std::span<const std::uint64_t> shape, std::uint64_t width);

/// Throws Error (Fault::system), "<path>: <what> needs ... GB of memory", where fewer than `bytes`
/// are available. Call it before allocating: where memory is overcommitted, no allocation fails,
/// and the system kills a process instead.
void require_memory(const std::filesystem::path& path, std::string_view what, std::uint64_t bytes);

}  // namespace palpate
