#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "io/descriptor.hpp"

namespace palpate {

/// Reads the lines of a file, a FIFO or standard input as they come, a block at a time.
class LineReader {
 public:
  struct Line {
    std::uint64_t number = 0;  ///< from 1
    std::string_view text;     ///< not blank; "" where the line is too long
    bool too_long = false;
  };

  /// @param kind what the lines hold, for messages
  /// @param name path of a file or FIFO, or "-": standard input
  /// @param longest bytes of a line; a stream that never ends its line must not fill the memory
  /// @param take called from within read_some() with each line that is not blank
  /// @throws Error (Fault::input) where `name` cannot be read
  LineReader(std::string kind, const std::string& name, std::size_t longest,
             std::function<void(const Line&)> take);

  /// Waits at most so long for bytes and reads one block of them; false where none came.
  /// @throws Error (Fault::input) where a file cannot be read; what `take` throws
  bool read_some(std::chrono::milliseconds wait = {});

  /// The path, or "standard input".
  const std::string& name() const { return name_; }
  bool is_file() const { return is_file_; }
  /// True after the last line; a FIFO has none, as it may get another writer.
  bool ended() const { return ended_; }

 private:
  void take(std::string_view bytes);
  void end_line();

  std::string kind_;
  std::string name_;
  std::size_t longest_;
  std::function<void(const Line&)> take_;
  Descriptor file_;      ///< none for standard input
  int descriptor_ = -1;  ///< its number
  bool is_file_ = false;
  bool is_fifo_ = false;
  bool ended_ = false;
  std::string line_;       ///< the line under way
  bool too_long_ = false;  ///< the line under way is longer than `longest_`
  std::uint64_t lines_ = 0;
};

}  // namespace palpate
