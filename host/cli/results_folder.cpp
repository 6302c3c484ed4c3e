#include "cli/results_folder.hpp"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>

#include "cli/options.hpp"
#include "io/input_file.hpp"

namespace palpate::cli {

namespace {

std::optional<std::size_t> count_in(std::string_view text) {
  std::size_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  return error == std::errc{} && rest == end ? std::optional(number) : std::nullopt;
}

/// That of a job array's task; the whole outside of one.
Shard shard_of_array() {
  const auto id = slurm_number("SLURM_ARRAY_TASK_ID");
  const auto count = slurm_number("SLURM_ARRAY_TASK_COUNT");
  if (!id || !count) {
    return {};
  }
  const std::size_t first = slurm_number("SLURM_ARRAY_TASK_MIN").value_or(0);
  const std::size_t step = slurm_number("SLURM_ARRAY_TASK_STEP").value_or(1);
  const bool even = step > 0 && *id >= first && (*id - first) % step == 0;
  const std::size_t index = even ? (*id - first) / step : *count;
  if (index >= *count || *count > most_shards) {
    refuse_flag("SLURM_ARRAY_TASK_ID", *id,
                "is not one of {} evenly spaced numbers from {}; submit with --array=0-{}, or give "
                "--shard I/N",
                *count, first, *count - 1);
  }
  return {index, *count};
}

}  // namespace

std::optional<std::size_t> slurm_number(const char* variable) {
  const char* const text = std::getenv(variable);
  if (text == nullptr || *text == '\0') {
    return {};
  }
  const auto number = count_in(text);
  if (!number) {
    refuse_flag(variable, text, "is no whole number; unset it, or give --shard I/N");
  }
  return number;
}

Shard shard_of(const std::string& flag) {
  if (!flag.empty()) {
    const std::string_view text = flag;
    const std::size_t slash = text.find('/');
    const auto index = count_in(text.substr(0, slash));
    const auto count = slash == text.npos ? std::nullopt : count_in(text.substr(slash + 1));
    if (!index || !count || *index >= *count || *count > most_shards) {
      refuse_flag("--shard", flag, "give it as I/N, with I from 0 to N - 1 and N up to {}",
                  most_shards);
    }
    return {*index, *count};
  }
  const Shard array = shard_of_array();
  // Not SLURM_NTASKS, which a batch script has outside of its steps, too.
  const std::size_t tasks = slurm_number("SLURM_STEP_NUM_TASKS").value_or(1);
  const std::size_t task = slurm_number("SLURM_PROCID").value_or(0);
  if (task >= tasks || tasks > most_shards / array.count) {
    refuse_flag("SLURM_PROCID", task,
                "of {} tasks is no shard among up to {}; unset it, or give --shard I/N", tasks,
                most_shards);
  }
  return {array.index * tasks + task, array.count * tasks};
}

std::string local_device(std::span<const DeviceInfo> devices, const std::string& wished,
                         std::size_t rank) {
  const auto chosen = std::ranges::find_if(devices, &DeviceInfo::chosen);
  const bool index =
      !wished.empty() && std::ranges::all_of(wished, [](char c) { return c >= '0' && c <= '9'; });
  if (chosen == devices.end() || index) {
    return wished;
  }
  std::vector<int> alike;
  for (const DeviceInfo& device : devices) {
    if (device.usable && device.name == chosen->name) {
      alike.push_back(device.index);
    }
  }
  return alike.size() > 1 ? std::to_string(alike[rank % alike.size()]) : wished;
}

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

/// What the folder holds; nothing where there is no such folder.
std::vector<fs::path> paths_in(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    paths.push_back(entry.path());
  }
  if (error && error != std::errc::no_such_file_or_directory &&
      error != std::errc::not_a_directory) {
    refuse(folder, "cannot be read: {}; check its permissions", error.message());
  }
  return paths;
}

/// Whether a process that was killed has left this half-written.
bool is_part(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with(".palpate-") && name.ends_with(".part");
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

void ResultsFolder::require_own() const {
  for (const fs::path& path : {chunks(), runs(), lock()}) {
    std::error_code ignored;
    if (fs::is_symlink(path, ignored)) {
      refuse(path, "is a link, and palpate batch writes through none; give another folder");
    }
  }
  const std::optional<fs::path> foreign = foreign_file();
  // Asked last: another shard may have written the task, and chunks after it, meanwhile.
  if (foreign && !has_task()) {
    refuse(folder_, "holds '{}' and no task of palpate batch; give an empty or a new folder",
           foreign->lexically_relative(folder_).string());
  }
}

std::optional<fs::path> ResultsFolder::foreign_file() const {
  for (const fs::path& folder : {folder_, chunks(), runs()}) {
    for (const fs::path& path : paths_in(folder)) {
      if (!is_part(path) && path != chunks() && path != runs() && path != lock()) {
        return path;
      }
    }
  }
  return {};
}

std::vector<std::size_t> ResultsFolder::finished_chunks(std::size_t end) const {
  std::vector<std::size_t> found;
  for (const fs::path& path : paths_in(chunks())) {
    const std::string stem = path.stem().string();
    std::size_t index = 0;
    std::from_chars(stem.data(), stem.data() + stem.size(), index);
    std::error_code ignored;
    if (index < end && path == chunk(index) && fs::is_regular_file(path, ignored)) {
      found.push_back(index);
    }
  }
  std::ranges::sort(found);
  return found;
}

void ResultsFolder::make() const {
  make_folder(chunks());
  make_folder(runs());
}

void ResultsFolder::remove_chunk(std::size_t index) const {
  remove_file(chunk(index));
  remove_file(run(index));
}

void ResultsFolder::remove_parts() const {
  for (const fs::path& folder : {folder_, chunks(), runs()}) {
    for (const fs::path& path : paths_in(folder)) {
      if (is_part(path)) {
        std::error_code ignored;
        fs::remove(path, ignored);
      }
    }
  }
}

Chunk read_chunk(const fs::path& file, std::size_t unknowns) {
  using Json = nlohmann::json;
  std::ifstream stream(file, std::ios::binary);
  Chunk chunk{.text = {std::istreambuf_iterator<char>(stream), {}}};
  std::size_t records = 0;
  for (std::string_view left = chunk.text; !left.empty(); ++records) {
    const std::string_view line = left.substr(0, left.find('\n'));
    left.remove_prefix(std::min(line.size() + 1, left.size()));
    bool failed = false;
    // Keeps no value: only the record's own keys count, not those of its identity.
    const auto note = [&](int depth, Json::parse_event_t event, const Json& parsed) {
      const bool is_key = event == Json::parse_event_t::key;
      failed = failed || (is_key && depth == 1 && parsed == "error");
      return !is_key;
    };
    if (!Json::parse(line, note, false).is_object()) {
      refuse(file, "line {} is no record; remove it and call palpate batch again", records + 1);
    }
    chunk.failed += failed ? 1 : 0;
  }
  if (records != unknowns) {
    refuse(file, "has {} records instead of {}; remove it and call palpate batch again", records,
           unknowns);
  }
  return chunk;
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

FolderLock::FolderLock(const ResultsFolder& folder, const Shard& shard,
                       const std::function<bool()>& wait)
    : file_(folder.lock()), shard_(shard), descriptor_(file_, O_RDWR | O_CREAT | O_NOFOLLOW, 0666) {
  if (!descriptor_.valid()) {
    refuse(folder.path(),
           "cannot be written: {}; choose another folder (palpate merge and evaluate only read it)",
           std::strerror(errno));
  }
  std::optional<Shard> other = take();
  while (other && wait()) {
    other = take();
  }
  if (other && other->count == shard.count) {
    refuse(folder.path(),
           "another process works on shard {}/{}; wait until it has ended, or give another --shard",
           shard.index, shard.count);
  }
  if (other) {
    refuse(folder.path(),
           "another process works on shard {}/{} of it; wait until it has ended, or give --shard "
           "I/{}",
           other->index, other->count, other->count);
  }
}

std::function<bool()> FolderLock::wait_for_a_second() {
  constexpr int times = 20;
  return [left = times]() mutable {
    std::this_thread::sleep_for(std::chrono::milliseconds(1000 / times));
    return --left >= 0;
  };
}

std::optional<Shard> FolderLock::take() const {
  struct flock lock = lock_of(F_WRLCK, place_of(shard_), 1);
  if (::fcntl(descriptor_.get(), F_SETLK, &lock) != 0) {
    if (errno != EACCES && errno != EAGAIN) {
      fail_to_lock(file_);
    }
    return shard_;
  }
  const auto range = static_cast<off_t>(most_shards);
  const off_t own = place_of({0, shard_.count});
  for (const auto& [start, length] : {std::pair{range, own - range}, {own + range, off_t{0}}}) {
    if (length == 0 && start <= own) {
      continue;  // no count is smaller
    }
    if (const off_t other = held_by_others(descriptor_.get(), start, length); other >= 0) {
      // Two that wait for each other shall not both find the other's lock.
      lock.l_type = F_UNLCK;
      ::fcntl(descriptor_.get(), F_SETLK, &lock);
      return Shard{static_cast<std::size_t>(other % range),
                   static_cast<std::size_t>(other / range)};
    }
  }
  return {};
}

void FolderLock::lock() const {
  struct flock lock = lock_of(F_WRLCK, settling, 1);
  while (::fcntl(descriptor_.get(), F_SETLKW, &lock) != 0) {
    if (errno != EINTR) {
      fail_to_lock(file_);
    }
  }
}

void FolderLock::unlock() const {
  struct flock lock = lock_of(F_UNLCK, settling, 1);
  ::fcntl(descriptor_.get(), F_SETLK, &lock);
}

bool FolderLock::is_alone() const {
  return held_by_others(descriptor_.get(), static_cast<off_t>(most_shards), 0) < 0;
}

}  // namespace palpate::cli
