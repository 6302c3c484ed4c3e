#include "atomic_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "descriptor.hpp"
#include "input_file.hpp"
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

}  // namespace

AtomicFile::AtomicFile(const std::filesystem::path& target) : target_(target) {
  std::error_code ignored;
  const auto type = std::filesystem::status(target, ignored).type();
  if (type == std::filesystem::file_type::directory || !target.has_filename()) {
    refuse(target, "is a folder; give the name of a file");
  }
  if (type == std::filesystem::file_type::regular) {
    // A link stays a link: what it points to is replaced.
    target_ = std::filesystem::canonical(target);
  } else if (type != std::filesystem::file_type::not_found &&
             type != std::filesystem::file_type::none) {
    refuse(target, "is not a regular file; give the name of a file");
  }
  const std::filesystem::path folder = folder_of(target_);
  if (!std::filesystem::is_directory(folder, ignored)) {
    refuse(target,
           fmt::format("folder '{0}' does not exist; create it (mkdir -p '{0}')", folder.string()));
  }
  // A name of its own, not the target's with a suffix, which might be too long for the file system.
  static std::atomic<unsigned> serial = 0;
  for (;;) {
    std::filesystem::path name = folder / fmt::format(".palpate-{}-{}.part", ::getpid(), serial++);
    if (Descriptor(name, O_WRONLY | O_CREAT | O_EXCL, 0666).valid()) {
      temporary_ = std::move(name);
      return;
    }
    if (errno != EEXIST) {
      refuse(target, fmt::format("cannot create a file in folder '{}': {}; choose another folder",
                                 folder.string(), std::strerror(errno)));
    }
  }
}

AtomicFile::~AtomicFile() {
  if (!temporary_.empty()) {
    ::unlink(temporary_.c_str());
  }
}

void AtomicFile::write(std::string_view bytes) {
  const Descriptor file(temporary_, O_WRONLY | O_TRUNC);
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

void AtomicFile::commit() {
  {
    const Descriptor file(temporary_, O_RDONLY);
    if (!file.valid() || ::fsync(file.get()) != 0) {
      fail(target_, "write");
    }
  }
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
    fail(target_, "rename the finished file to it");
  }
  temporary_.clear();
  // Makes the new name last through a power cut; file systems that cannot do it may refuse.
  const Descriptor folder(folder_of(target_), O_RDONLY | O_DIRECTORY);
  if (folder.valid()) {
    ::fsync(folder.get());
  }
}

}  // namespace palpate
