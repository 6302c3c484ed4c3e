#include "io/atomic_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "io/input_file.hpp"
#include "model/descriptor.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

[[noreturn]] void fail(const std::filesystem::path& target, const char* action) {
  throw Error(Fault::system, fmt::format("{}: cannot {}: {}; free or repair the disk and try again",
                                         target.string(), action, std::strerror(errno)));
}

std::filesystem::path folder_of(const std::filesystem::path& target) {
  return target.has_parent_path() ? target.parent_path() : ".";
}

// A link stays a link; the file that it points to is replaced.
std::filesystem::path file_behind(const std::filesystem::path& target) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(target, ignored) ? std::filesystem::canonical(target)
                                                           : target;
}

// Creates an empty file under a new name in the target's folder, which does not extend the
// target's: that might be too long for the file system. Returns it; empty, with errno, where that
// fails.
std::filesystem::path make_beside(const std::filesystem::path& target) {
  static std::atomic<unsigned> serial = 0;
  for (;;) {
    std::filesystem::path name =
        folder_of(target) / fmt::format(".palpate-{}-{}.part", ::getpid(), serial++);
    if (Descriptor(name, O_WRONLY | O_CREAT | O_EXCL, 0666).valid()) {
      return name;
    }
    if (errno != EEXIST) {
      return {};
    }
  }
}

}  // namespace

AtomicFile::AtomicFile(const std::filesystem::path& target, Links links)
    : target_(links == Links::followed ? file_behind(target) : target) {
  std::error_code ignored;
  const auto status = links == Links::followed ? std::filesystem::status(target, ignored)
                                               : std::filesystem::symlink_status(target, ignored);
  const auto type = status.type();
  if (type == std::filesystem::file_type::directory || !target.has_filename()) {
    refuse(target, "is a folder; give the name of a file");
  }
  if (type != std::filesystem::file_type::regular && type != std::filesystem::file_type::symlink &&
      type != std::filesystem::file_type::not_found && type != std::filesystem::file_type::none) {
    refuse(target, "is not a regular file; give the name of a file");
  }
  const std::filesystem::path folder = folder_of(target_);
  if (!std::filesystem::is_directory(folder, ignored)) {
    refuse(target, "folder '{0}' does not exist; create it (mkdir -p '{0}')", folder.string());
  }
  temporary_ = make_beside(target_);
  if (temporary_.empty()) {
    refuse(target, "cannot create a file in folder '{}': {}; choose another folder",
           folder.string(), std::strerror(errno));
  }
}

AtomicFile::~AtomicFile() {
  if (!temporary_.empty()) {
    ::unlink(temporary_.c_str());
  }
}

void AtomicFile::write(std::string_view bytes) { write(bytes, O_TRUNC); }

void AtomicFile::append(std::string_view bytes) { write(bytes, O_APPEND); }

void AtomicFile::write(std::string_view bytes, int flags) {
  const Descriptor file(temporary_, O_WRONLY | flags);
  if (!file.valid()) {
    fail(target_, "open its temporary file");
  }
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      fail(target_, "write");
    }
  }
}

void AtomicFile::bring_to_disk() const {
  const Descriptor file(temporary_, O_RDONLY);
  if (!file.valid() || ::fsync(file.get()) != 0) {
    fail(target_, "write");
  }
}

void AtomicFile::bring_name_to_disk() const {
  const Descriptor folder(folder_of(target_), O_RDONLY | O_DIRECTORY);
  if (folder.valid()) {
    ::fsync(folder.get());  // file systems that cannot sync a folder may refuse
  }
}

void AtomicFile::commit() {
  bring_to_disk();
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
    fail(target_, "rename the finished file to it");
  }
  temporary_.clear();
  bring_name_to_disk();
}

bool AtomicFile::commit_new() {
  bring_to_disk();
  // A second name, not renameat2(), which NFS refuses.
  if (::link(temporary_.c_str(), target_.c_str()) != 0) {
    if (errno == EEXIST) {
      return false;
    }
    fail(target_, "give the finished file its name");
  }
  bring_name_to_disk();
  return true;
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder)) {
    refuse(folder, "the folder cannot be made ({}); choose another name", error.message());
  }
}

}  // namespace palpate
