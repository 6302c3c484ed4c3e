#pragma once

#include <filesystem>
#include <string_view>

namespace palpate {

/// An output file that appears whole or not at all. It is written under a temporary name in the
/// target's folder; commit() renames it into place. Without commit() it is removed, and an older
/// file at the target stays.
class AtomicFile {
 public:
  /// What becomes of a link under the target's name: the file that it points to is replaced, or
  /// the link itself.
  enum class Links { followed, replaced };

  /// Creates the empty temporary file.
  /// @throws Error where the folder is missing or refuses, or the target is not a regular file.
  explicit AtomicFile(const std::filesystem::path& target, Links links = Links::followed);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The temporary file, for a library that writes by name.
  const std::filesystem::path& path() const { return temporary_; }
  /// Makes `bytes` the file's content.
  /// @throws Error (Fault::system) where the disk refuses, as when it is full.
  void write(std::string_view bytes);
  /// Adds `bytes` to the file's content.
  /// @throws Error (Fault::system) where the disk refuses
  void append(std::string_view bytes);
  /// Brings the content to the disk and renames the file to its target.
  /// @throws Error (Fault::system) where the disk refuses.
  void commit();
  /// As commit(), but returns false, and leaves the target as it is, where there is one by now. Of
  /// several processes that write one target, one is told true.
  bool commit_new();

 private:
  void bring_to_disk() const;
  /// Has the new name last through a power cut.
  void bring_name_to_disk() const;
  void write(std::string_view bytes, int flags);

  std::filesystem::path target_;
  std::filesystem::path temporary_;  ///< empty once committed
};

/// Makes the folder if it does not exist.
/// @throws Error where it cannot be made
void make_folder(const std::filesystem::path& folder);

}  // namespace palpate
