#include "cli/command_files.hpp"

#include <unistd.h>

#include <map>
#include <optional>
#include <system_error>
#include <utility>

#include "io/atomic_file.hpp"
#include "io/input_file.hpp"

namespace palpate::cli {

namespace {

/// Identity of a file; its path where it does not exist yet.
using Place = std::pair<FileIdentity, std::filesystem::path>;

/// Returns none for what cannot be overwritten, such as a terminal.
std::optional<Place> place_of(const std::filesystem::path& file, std::optional<int> stream) {
  struct stat status {};
  const bool found = stream ? ::fstat(*stream, &status) == 0 : ::stat(file.c_str(), &status) == 0;
  if (!found) {
    std::error_code ignored;
    // Absolute first: weakly_canonical() leaves a relative path as it is where no part of it
    // exists.
    return Place{
        {}, std::filesystem::weakly_canonical(std::filesystem::absolute(file, ignored), ignored)};
  }
  if (!S_ISREG(status.st_mode) && !S_ISFIFO(status.st_mode)) {
    return {};
  }
  return Place{identity_of(status), {}};
}

}  // namespace

CommandFiles& CommandFiles::reads(const std::string& flag, const std::filesystem::path& file,
                                  Dash dash) {
  if (!file.empty()) {
    read_.push_back({flag, file, dash == Dash::stream && file == "-"});
  }
  return *this;
}

CommandFiles& CommandFiles::reads(const std::string& flag, const std::vector<std::string>& files) {
  for (const std::string& file : files) {
    reads(flag, std::filesystem::path(file));
  }
  return *this;
}

CommandFiles& CommandFiles::writes(const std::string& flag, const std::filesystem::path& file,
                                   Dash dash) {
  if (!file.empty()) {
    written_.push_back({flag, file, dash == Dash::stream && file == "-"});
  }
  return *this;
}

CommandFiles& CommandFiles::writes_in(const std::string& flag, const std::filesystem::path& folder,
                                      const std::string& name) {
  if (!folder.empty()) {
    written_.push_back({flag, folder / name, false, true});
  }
  return *this;
}

void CommandFiles::require_distinct() const {
  // Every file so far, with its flag and use.
  std::map<Place, std::pair<const Named*, const char*>> taken;
  for (const Named& input : read_) {
    if (const auto place =
            place_of(input.file, input.is_stream ? std::optional(STDIN_FILENO) : std::nullopt)) {
      taken.emplace(*place, std::pair{&input, "reads"});
    }
  }
  for (const Named& output : written_) {
    const auto place =
        place_of(output.file, output.is_stream ? std::optional(STDOUT_FILENO) : std::nullopt);
    if (!place) {
      continue;
    }
    const auto [other, is_new] = taken.emplace(*place, std::pair{&output, "writes"});
    if (!is_new) {
      const auto& [named, verb] = other->second;
      refuse(output.flag + " " + output.file.string(),
             "would overwrite {}, which {} {}; choose another name", named->file.string(),
             named->flag, verb);
    }
  }
}

void CommandFiles::prepare() const {
  require_distinct();
  for (const Named& output : written_) {
    const std::filesystem::path folder = output.file.parent_path();
    const bool later = output.in_own_folder && !std::filesystem::exists(folder);
    if (output.in_own_folder && !later && !std::filesystem::is_directory(folder)) {
      refuse(folder, "the folder cannot be made ({}); choose another name",
             std::make_error_code(std::errc::not_a_directory).message());
    }
    if (!output.is_stream && !later) {
      const AtomicFile probe(output.file);
    }
  }
}

}  // namespace palpate::cli
