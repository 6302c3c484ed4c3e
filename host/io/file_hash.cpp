#include "io/file_hash.hpp"

#include <cstdint>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "io/input_file.hpp"

namespace palpate {

std::string hash_of(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : bytes) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  }
  return fmt::format("{:016x}", hash);
}

std::string hash_of_file(const std::filesystem::path& file) {
  require_readable(file);
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) {
    refuse(file, "cannot be read; copy it again");
  }
  return hash_of(bytes);
}

}  // namespace palpate
