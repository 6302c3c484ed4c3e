#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// Refuses command lines that write a file which they also read, or write twice, even under another
/// path, a symbolic link or a hard link. Holds each file with the flag that names it.
class CommandFiles {
 public:
  /// Whether "-" names a file called "-", or standard input or output.
  enum class Dash { file, stream };

  /// Adds a file that the command reads.
  /// @throws Error (Fault::input) where it is standard input, which is closed
  void reads(const std::string& flag, const std::filesystem::path& file, Dash dash = Dash::file);
  /// Adds a file that the command writes, which need not exist.
  /// @throws Error (Fault::input) where it is standard output, which is closed
  void writes(const std::string& flag, const std::filesystem::path& file, Dash dash = Dash::file);

  /// Compares existing regular files and FIFOs by device and inode, others by their paths.
  /// Terminals and other devices may be both read and written. Call it before the work, which may
  /// take hours, and before anything is written.
  /// @throws Error (Fault::input) naming both flags and both files
  void require_distinct() const;

 private:
  struct Named {
    std::string flag;
    std::filesystem::path file;
    bool is_stream = false;
  };
  std::vector<Named> read_;
  std::vector<Named> written_;
};

}  // namespace palpate
