#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace palpate {

/// Hash of bytes, in hexadecimal (FNV-1a, 64 bits): tells files apart that nobody has forged.
std::string hash_of(std::string_view bytes);
/// Hash of a file's content. @throws Error
std::string hash_of_file(const std::filesystem::path& file);

}  // namespace palpate
