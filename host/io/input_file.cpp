#include "io/input_file.hpp"

#include <cerrno>
#include <cstring>
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

}  // namespace palpate
