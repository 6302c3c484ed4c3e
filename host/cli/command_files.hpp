#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate::cli {

/// Refuses command lines that write a file which they also read, or write twice, even under another
/// path, a symbolic link or a hard link. Holds each file with the flag that names it.
class CommandFiles {
 public:
  /// Whether "-" names a file called "-", or standard input or output.
  enum class Dash { file, stream };

  /// Adds files that the command reads, unless their name is "".
  CommandFiles& reads(const std::string& flag, const std::filesystem::path& file,
                      Dash dash = Dash::file);
  CommandFiles& reads(const std::string& flag, const std::vector<std::string>& files);
  /// Adds a file that the command writes, which need not exist, unless its name is "".
  CommandFiles& writes(const std::string& flag, const std::filesystem::path& file,
                       Dash dash = Dash::file);
  /// Adds a file in a folder that the command makes where it is missing, unless the folder is "".
  CommandFiles& writes_in(const std::string& flag, const std::filesystem::path& folder,
                          const std::string& name);

  /// Compares existing regular files and FIFOs by device and inode, others by their paths.
  /// Terminals and other devices may be both read and written. Call it before the work, which may
  /// take hours, and before anything is written.
  /// @throws Error (Fault::input) naming both flags and both files
  void require_distinct() const;
  /// Requires distinct files, and that each output can be written.
  /// @throws Error
  void prepare() const;

 private:
  struct Named {
    std::string flag;
    std::filesystem::path file;
    bool is_stream = false;
    bool in_own_folder = false;  ///< which the command makes
  };
  std::vector<Named> read_;
  std::vector<Named> written_;
};

}  // namespace palpate::cli
