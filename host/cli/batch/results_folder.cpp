#include "results_folder.hpp"

#include <fcntl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <system_error>
#include <utility>
#include <vector>

#include "input_file.hpp"
#include "options.hpp"

namespace palpate::cli {

namespace {

namespace fs = std::filesystem;

std::string numbered(std::size_t index, const char* suffix) {
  return fmt::format("{:06}{}", index, suffix);
}

void remove_file(const fs::path& file) {
  std::error_code error;
  if (!fs::remove(file, error) && error) {
    throw Error(Fault::system, fmt::format("{}: cannot be removed: {}; make the folder writable",
                                           file.string(), error.message()));
  }
}

}  // namespace

fs::path ResultsFolder::chunk(std::size_t index) const {
  return chunks() / numbered(index, ".ndjson");
}

fs::path ResultsFolder::run(std::size_t index) const { return runs() / numbered(index, ".json"); }

bool ResultsFolder::has_task() const {
  std::error_code ignored;
  return fs::is_regular_file(task(), ignored);
}

bool ResultsFolder::has_chunk(std::size_t index) const {
  std::error_code ignored;
  return fs::is_regular_file(chunk(index), ignored);
}

void ResultsFolder::make() const {
  make_folder(chunks());
  make_folder(runs());
}

void ResultsFolder::remove_chunk(std::size_t index) const {
  remove_file(chunk(index));
  remove_file(run(index));
}

void ResultsFolder::remove_chunks_from(std::size_t first) const {
  std::error_code error;
  std::vector<std::size_t> found;
  for (const auto& entry : fs::directory_iterator(chunks(), error)) {
    const std::string stem = entry.path().stem().string();
    std::size_t index = 0;
    const auto [rest, bad] = std::from_chars(stem.data(), stem.data() + stem.size(), index);
    if (bad == std::errc{} && rest == stem.data() + stem.size() && index >= first) {
      found.push_back(index);
    }
  }
  std::ranges::for_each(found, [this](std::size_t index) { remove_chunk(index); });
}

void ResultsFolder::remove_parts() const {
  for (const fs::path& folder : {folder_, chunks(), runs()}) {
    std::error_code error;
    std::vector<fs::path> parts;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with(".palpate-") && name.ends_with(".part")) {
        parts.push_back(entry.path());
      }
    }
    for (const fs::path& part : parts) {
      fs::remove(part, error);
    }
  }
}

bool is_results_folder(const fs::path& folder) { return ResultsFolder(folder).has_task(); }

ChunkCounts count_records(std::string_view chunk) {
  // Quotes within a text are escaped: this is a key, and only failed records have it.
  constexpr std::string_view key = ",\"error\":";
  ChunkCounts counts{static_cast<std::size_t>(std::ranges::count(chunk, '\n')), 0};
  for (std::size_t at = chunk.find(key); at != chunk.npos; at = chunk.find(key, at + key.size())) {
    ++counts.failed;
  }
  return counts;
}

// The lock file holds no bytes; its locks are of single bytes beyond its end: the first one is of
// the process that settles the task, the others are of the shards, each count in a range of its
// own.
namespace {

constexpr off_t settling = 0;

off_t place_of(const Shard& shard) {
  return static_cast<off_t>(shard.count * most_shards + shard.index);
}

struct flock lock_of(short type, off_t start, off_t length) {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = start;
  lock.l_len = length;
  return lock;
}

/// The place of a lock that another process holds in [start, start + length), or to the end where
/// length is 0; -1 where there is none.
off_t held_by_others(int descriptor, off_t start, off_t length) {
  struct flock lock = lock_of(F_WRLCK, start, length);
  if (length < 0 || ::fcntl(descriptor, F_GETLK, &lock) != 0 || lock.l_type == F_UNLCK) {
    return -1;
  }
  return lock.l_start;
}

[[noreturn]] void fail_to_lock(const fs::path& file) {
  throw Error(Fault::system,
              fmt::format("{}: cannot be locked: {}; put the folder on a file system with locks",
                          file.string(), std::strerror(errno)));
}

}  // namespace

FolderLock::FolderLock(const ResultsFolder& folder, const Shard& shard)
    : file_(folder.path() / "lock"), shard_(shard), descriptor_(file_, O_RDWR | O_CREAT, 0666) {
  if (!descriptor_.valid()) {
    refuse(folder.path(),
           "cannot be written: {}; choose another folder (palpate merge and evaluate only read it)",
           std::strerror(errno));
  }
  struct flock lock = lock_of(F_WRLCK, place_of(shard), 1);
  if (::fcntl(descriptor_.get(), F_SETLK, &lock) != 0) {
    if (errno != EACCES && errno != EAGAIN) {
      fail_to_lock(file_);
    }
    refuse(folder.path(),
           "another process works on shard {}/{}; wait until it has ended, or give another --shard",
           shard.index, shard.count);
  }
  const auto range = static_cast<off_t>(most_shards);
  const off_t own = place_of({0, shard.count});
  for (const auto& [start, length] : {std::pair{range, own - range}, {own + range, off_t{0}}}) {
    if (length == 0 && start <= own) {
      continue;  // no count is smaller
    }
    if (const off_t other = held_by_others(descriptor_.get(), start, length); other >= 0) {
      refuse(folder.path(),
             "another process works on shard {}/{} of it; wait until it has ended, or give --shard "
             "I/{}",
             other % range, other / range, other / range);
    }
  }
}

void FolderLock::begin_settling() const {
  struct flock lock = lock_of(F_WRLCK, settling, 1);
  while (::fcntl(descriptor_.get(), F_SETLKW, &lock) != 0) {
    if (errno != EINTR) {
      fail_to_lock(file_);
    }
  }
}

void FolderLock::end_settling() const {
  struct flock lock = lock_of(F_UNLCK, settling, 1);
  ::fcntl(descriptor_.get(), F_SETLK, &lock);
}

bool FolderLock::is_alone() const {
  return held_by_others(descriptor_.get(), static_cast<off_t>(most_shards), 0) < 0;
}

}  // namespace palpate::cli
