#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "model/descriptor.hpp"

namespace palpate {

/// Reads the lines of a text file in constant memory: UTF-8, or UTF-16 with a byte order mark, as
/// spreadsheets save it.
class TextLines {
 public:
  /// @throws Error where the file cannot be read
  explicit TextLines(std::filesystem::path path);

  /// Goes on to the next line; false after the last.
  /// @throws Error where the file cannot be read, is no text, or a line is longer than 16 MB
  bool next();
  /// The line without its end; valid until next().
  std::string_view line() const { return line_; }
  std::uint64_t number() const { return number_; }  ///< of the line, from 1

 private:
  void read_block();
  void append_utf16(std::string_view bytes);

  std::filesystem::path path_;
  Descriptor file_;
  enum class Encoding { unknown, utf8, utf16_little, utf16_big } encoding_ = Encoding::unknown;
  std::string bytes_;      ///< of the file, as read
  std::string left_;       ///< of UTF-16: bytes of a character whose rest is not read yet
  std::string block_;      ///< text in UTF-8, from the present line on
  std::size_t begin_ = 0;  ///< where the next line begins in block_
  bool at_end_ = false;    ///< the whole file is in block_
  std::string_view line_;
  std::uint64_t number_ = 0;
};

}  // namespace palpate
