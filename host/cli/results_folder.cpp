#include "cli/results_folder.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>

#include <nlohmann/json.hpp>

#include "cli/options.hpp"
#include "io/input_file.hpp"

namespace palpate::cli {

namespace {

namespace fs = std::filesystem;

std::string numbered(std::size_t index, const char* suffix) {
  return fmt::format("{:06}{}", index, suffix);
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
    for (const fs::path& path : paths_in(folder)) {
      if (!is_part(path) && path != chunks() && path != runs()) {
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
  // A day: no living process takes so long to write a chunk, by whatever clock.
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(24);
  for (const fs::path& folder : {folder_, chunks(), runs()}) {
    for (const fs::path& path : paths_in(folder)) {
      std::error_code error;
      const auto written = fs::last_write_time(path, error);
      if (is_part(path) && !error && written < old) {
        fs::remove(path, error);
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

}  // namespace palpate::cli
