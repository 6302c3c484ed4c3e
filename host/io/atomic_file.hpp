#pragma once

#include <filesystem>
#include <string_view>

namespace palpate {

/// An output file that appears whole or not at all. It is written under a temporary name in the
/// target's folder, so that commit() can rename it into place; without commit() it is removed and
/// an older file at the target stays as it was.
class AtomicFile {
 public:
  /// Creates the empty temporary file.
  /// @throws Error where the folder is missing or refuses, or the target is not a regular file.
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The temporary file, for a library that writes by name.
  const std::filesystem::path& path() const { return temporary_; }
  /// Makes `bytes` the file's content.
  /// @throws Error (Fault::system) where the disk refuses, as when it is full.
  void write(std::string_view bytes);
  /// Brings the content to the disk and renames the file to its target.
  /// @throws Error (Fault::system) where the disk refuses.
  void commit();

 private:
  std::filesystem::path target_;
  std::filesystem::path temporary_;  ///< empty once committed
};

}  // namespace palpate
