#include "input_file.hpp"

#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "descriptor.hpp"
#include "palpate/error.hpp"

namespace palpate {

void refuse(const std::filesystem::path& path, std::string_view message) {
  throw Error(Fault::input, fmt::format("{}: {}", path.string(), message));
}

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
    refuse(path, fmt::format("cannot be read: {}; check its permissions", std::strerror(errno)));
  }
  return std::filesystem::file_size(path);
}

bool is_printable_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i]);
    if (lead < 0x20 || lead == 0x7f) {
      return false;
    }
    const int ones = std::countl_one(lead);
    if (ones == 1 || ones > 4) {
      return false;
    }
    const std::size_t length = ones == 0 ? 1 : static_cast<std::size_t>(ones);
    if (length > text.size() - i) {
      return false;
    }
    std::uint32_t code = ones == 0 ? lead : lead & (0x7fu >> ones);
    for (std::size_t k = 1; k < length; ++k) {
      const auto continuation = static_cast<unsigned char>(text[i + k]);
      if ((continuation & 0xc0) != 0x80) {
        return false;
      }
      code = code << 6 | (continuation & 0x3f);
    }
    // Overlong forms, C1 controls, surrogates and what lies beyond Unicode.
    constexpr std::uint32_t smallest[] = {0, 0, 0xa0, 0x800, 0x10000};
    if (code < smallest[length] || (code >= 0xd800 && code <= 0xdfff) || code > 0x10ffff) {
      return false;
    }
    i += length;
  }
  return true;
}

}  // namespace palpate
