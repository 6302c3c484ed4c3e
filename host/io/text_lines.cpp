#include "io/text_lines.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "io/input_file.hpp"

namespace palpate {

namespace {

constexpr std::size_t block_bytes = 1 << 20;
// A row of 100,000 numbers is shorter; a file without line ends must not fill the memory.
constexpr std::size_t longest_line = 16 << 20;

void append_utf8(std::uint32_t code, std::string& text) {
  const auto add = [&](std::uint32_t byte) { text += static_cast<char>(byte); };
  const auto continued = [&](int shift) { add(0x80U | ((code >> shift) & 0x3FU)); };
  if (code < 0x80U) {
    add(code);
  } else if (code < 0x800U) {
    add(0xC0U | (code >> 6));
    continued(0);
  } else if (code < 0x10000U) {
    add(0xE0U | (code >> 12));
    continued(6);
    continued(0);
  } else {
    add(0xF0U | (code >> 18));
    continued(12);
    continued(6);
    continued(0);
  }
}

}  // namespace

TextLines::TextLines(std::filesystem::path path) : path_(std::move(path)) {
  require_readable(path_);
  file_ = Descriptor(path_, O_RDONLY);
  block_.reserve(2 * block_bytes);  // on the heap, so that a line stays where it is as this moves
}

bool TextLines::next() {
  std::size_t end = block_.find('\n', begin_);
  while (end == block_.npos && !at_end_) {
    const std::size_t unread = block_.size() - begin_;
    read_block();
    end = block_.find('\n', unread);
  }
  if (end == block_.npos && begin_ == block_.size()) {
    return false;
  }
  end = std::min(end, block_.size());
  line_ = std::string_view(block_).substr(begin_, end - begin_);
  begin_ = std::min(end + 1, block_.size());
  ++number_;
  return true;
}

void TextLines::read_block() {
  block_.erase(0, begin_);
  begin_ = 0;
  const std::size_t kept = block_.size();
  if (kept > longest_line) {
    refuse(path_, "line {} is longer than 16 MB: this is no table; give one row a line",
           number_ + 1);
  }
  bytes_.resize(block_bytes);
  const ssize_t got = ::read(file_.get(), bytes_.data(), bytes_.size());
  if (got < 0) {
    refuse(path_, "cannot be read: {}; copy or record it again", std::strerror(errno));
  }
  std::string_view bytes(bytes_.data(), static_cast<std::size_t>(got));
  at_end_ = bytes.empty();
  if (encoding_ == Encoding::unknown) {
    constexpr std::pair<std::string_view, Encoding> marks[] = {{"\xEF\xBB\xBF", Encoding::utf8},
                                                               {"\xFF\xFE", Encoding::utf16_little},
                                                               {"\xFE\xFF", Encoding::utf16_big}};
    encoding_ = Encoding::utf8;
    for (const auto& [mark, encoding] : marks) {
      if (bytes.starts_with(mark)) {
        encoding_ = encoding;
        bytes.remove_prefix(mark.size());
        break;
      }
    }
  }
  if (encoding_ == Encoding::utf8) {
    block_ += bytes;
  } else {
    append_utf16(bytes);
  }
  if (block_.find('\0', kept) != block_.npos) {
    refuse(path_, "is no text; save the table as CSV in UTF-8; palpate.Recording takes arrays");
  }
}

void TextLines::append_utf16(std::string_view bytes) {
  const std::string all = std::exchange(left_, {}) + std::string(bytes);
  const std::size_t high = encoding_ == Encoding::utf16_big ? 0 : 1;
  const auto unit = [&](std::size_t at) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(all[at + high])) << 8 |
           static_cast<unsigned char>(all[at + 1 - high]);
  };
  const auto is_within = [](std::uint32_t code, std::uint32_t first) {
    return code >= first && code < first + 0x400U;
  };
  std::size_t at = 0;
  while (at + 2 <= all.size()) {
    std::uint32_t code = unit(at);
    std::size_t size = 2;
    if (is_within(code, 0xD800U)) {  // the first half of a pair
      if (at + 4 > all.size()) {
        break;
      }
      const std::uint32_t second = unit(at + 2);
      const bool is_pair = is_within(second, 0xDC00U);
      size = is_pair ? 4 : 2;
      code = is_pair ? 0x10000U + ((code - 0xD800U) << 10) + (second - 0xDC00U) : 0xFFFDU;
    }
    append_utf8(code, block_);
    at += size;
  }
  left_ = all.substr(at);
}

}  // namespace palpate
