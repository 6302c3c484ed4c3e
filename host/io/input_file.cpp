#include "io/input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "model/descriptor.hpp"

namespace palpate {

std::uintmax_t require_readable(const std::filesystem::path& path) {
  std::error_code failure;
  const std::filesystem::file_status status = std::filesystem::status(path, failure);
  if (status.type() == std::filesystem::file_type::not_found) {
    refuse(path, "no such file; check the path");
  }
  if (status.type() == std::filesystem::file_type::directory) {
    refuse(path, "is a folder; name a file in it");
  }
  if (!failure && status.type() != std::filesystem::file_type::regular) {
    refuse(path, "is not a regular file; save the data to one first");
  }
  if (!Descriptor(path, O_RDONLY | O_NONBLOCK).valid()) {
    refuse(path, "cannot be read: {}; check its permissions", std::strerror(errno));
  }
  return std::filesystem::file_size(path);
}

std::vector<std::filesystem::path> paths_in(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    paths.push_back(entry.path());
  }
  if (error) {
    refuse(folder, "cannot be read: {}; check its permissions", error.message());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::string hash_of(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : bytes) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  }
  return fmt::format("{:016x}", hash);
}

std::string read_bytes(const std::filesystem::path& file) {
  require_readable(file);
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) {
    refuse(file, "cannot be read; copy it again");
  }
  return bytes;
}

std::string hash_of_file(const std::filesystem::path& file) { return hash_of(read_bytes(file)); }

}  // namespace palpate
