#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "model/refuse.hpp"

namespace palpate {

/// Size in bytes of a regular file that may be read.
/// @throws Error where it is missing, a folder, not a regular file or not readable.
std::uintmax_t require_readable(const std::filesystem::path& path);

/// The paths in a folder, sorted. @throws Error where it cannot be read
std::vector<std::filesystem::path> paths_in(const std::filesystem::path& folder);

/// A file's content. @throws Error as require_readable()
std::string read_bytes(const std::filesystem::path& file);

/// Hash of bytes, in hexadecimal (FNV-1a, 64 bits): tells files apart that nobody has forged.
std::string hash_of(std::string_view bytes);
/// Hash of a file's content. @throws Error
std::string hash_of_file(const std::filesystem::path& file);

/// Device and inode, which all names of a file share, links and hard links included.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;

  friend bool operator<(const FileIdentity& a, const FileIdentity& b) {
    return std::tie(a.device, a.inode) < std::tie(b.device, b.inode);
  }
  friend bool operator==(const FileIdentity&, const FileIdentity&) = default;
};

inline FileIdentity identity_of(const struct stat& status) {
  return {.device = status.st_dev, .inode = status.st_ino};
}

/// Returns none where the file does not exist.
inline std::optional<FileIdentity> identity_of(const std::filesystem::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 ? std::optional(identity_of(status)) : std::nullopt;
}

}  // namespace palpate
