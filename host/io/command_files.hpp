#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// The files that a command line names, each with the flag that names it. None that is written may
/// be one that is read, or one that is written besides: a link, another spelling of the path or
/// another name of the same file does not hide that.
class CommandFiles {
 public:
  /// What "-" names: a file called so, or standard input or output.
  enum class Dash { file, stream };

  /// Adds a file that the command reads.
  /// @throws Error (Fault::input) where it is standard input, and closed
  void reads(const std::string& flag, const std::filesystem::path& file, Dash dash = Dash::file);
  /// Adds a file that the command writes, which need not exist.
  /// @throws Error (Fault::input) where it is standard output, and closed
  void writes(const std::string& flag, const std::filesystem::path& file, Dash dash = Dash::file);

  /// To be called before the work, which may take hours, and before anything is written. Compares
  /// existing regular files and FIFOs by device and inode, files to come by their paths. Terminals
  /// and other devices may be read and written at once.
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
