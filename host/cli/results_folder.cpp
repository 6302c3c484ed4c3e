#include "cli/results_folder.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <string_view>
#include <system_error>

#include <nlohmann/json.hpp>

#include "cli/options.hpp"
#include "io/input_file.hpp"

namespace palpate::cli {

namespace {

namespace fs = std::filesystem;

/// What the folder holds; nothing where there is no such folder.
std::vector<fs::path> known_paths_in(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_directory(folder, ignored) ? paths_in(folder) : std::vector<fs::path>();
}

/// Whether a process that was killed has left this half-written.
bool is_part(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with(".palpate-") && name.ends_with(".part");
}

}  // namespace

fs::path ResultsFolder::chunk(std::size_t index) const {
  return chunks() / fmt::format("{:06}.ndjson", index);
}

fs::path ResultsFolder::run(std::size_t index) const {
  return runs() / fmt::format("{:06}.json", index);
}

bool ResultsFolder::has_task() const {
  std::error_code ignored;
  return fs::is_regular_file(task(), ignored);
}

void ResultsFolder::require_own() const {
  for (const fs::path& path : {chunks(), runs()}) {
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
    for (const fs::path& path : known_paths_in(folder)) {
      if (!is_part(path) && path != chunks() && path != runs()) {
        return path;
      }
    }
  }
  return {};
}

std::vector<std::size_t> ResultsFolder::finished_chunks(std::size_t end) const {
  std::vector<std::size_t> found;
  for (const fs::path& path : known_paths_in(chunks())) {
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
  // A day: no living process takes so long to write a chunk, by whatever clock.
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(24);
  for (const fs::path& folder : {folder_, chunks(), runs()}) {
    for (const fs::path& path : known_paths_in(folder)) {
      std::error_code error;
      const auto written = fs::last_write_time(path, error);
      if (is_part(path) && !error && written < old) {
        fs::remove(path, error);
      }
    }
  }
}

Chunk read_chunk(const fs::path& file, std::size_t unknowns) {
  Chunk chunk{.text = read_bytes(file)};
  std::size_t records = 0;
  for (std::string_view left = chunk.text; !left.empty(); ++records) {
    const std::string_view line = left.substr(0, left.find('\n'));
    left.remove_prefix(std::min(line.size() + 1, left.size()));
    const auto record = nlohmann::json::parse(line, nullptr, false);
    if (!record.is_object()) {
      refuse(file, "line {} is no record; remove it and call palpate batch again", records + 1);
    }
    chunk.failed += record.contains("error") ? 1 : 0;
  }
  if (records != unknowns) {
    refuse(file, "has {} records instead of {}; remove it and call palpate batch again", records,
           unknowns);
  }
  return chunk;
}

}  // namespace palpate::cli
