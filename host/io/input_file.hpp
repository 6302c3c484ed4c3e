#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace palpate {

/// Throws Error (Fault::input), "<path>: <message>".
[[noreturn]] void refuse(const std::filesystem::path& path, std::string_view message);

/// Size in bytes of a regular file that may be read.
/// @throws Error where it is missing, a folder, not a regular file or not readable.
std::uintmax_t require_readable(const std::filesystem::path& path);

}  // namespace palpate
