#include "recordings.hpp"

#include <set>

#include <fmt/format.h>

#include "file_identity.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate::cli {

std::vector<Recording> read_touch_recordings(const std::vector<std::string>& paths) {
  std::vector<Recording> recordings;
  std::set<std::optional<FileIdentity>> seen;
  for (const std::string& path : paths) {
    recordings.push_back(read_recording(path));
    const Recording& recording = recordings.back();
    if (!seen.insert(identity_of(path)).second) {
      throw Error(Fault::input, fmt::format("{}: given twice; leave one out", path));
    }
    if (recording.rows == "frames") {
      throw Error(Fault::input,
                  fmt::format("{}: rows = frames, a raw stream; find its touches first: palpate "
                              "touches {} -o TOUCHES.h5",
                              path, path));
    }
    if (recording.pressure_unit != recordings.front().pressure_unit) {
      throw Error(Fault::input,
                  fmt::format("{}: pressure_unit is {} but {} has {}; one threshold does not fit "
                              "both, use a call for each",
                              path, recording.pressure_unit, paths.front(),
                              recordings.front().pressure_unit));
    }
  }
  return recordings;
}

Frames select(const Recording& recording, const std::optional<Frames>& frames) {
  if (!frames) {
    return {0, recording.size()};
  }
  if (frames->end > recording.size()) {
    throw Error(Fault::input,
                fmt::format("{}: has {} touches, --frames {}:{} reaches beyond; end at most at {}",
                            recording.path, recording.size(), frames->begin, frames->end,
                            recording.size()));
  }
  return *frames;
}

ContactClassifier make_classifier(const std::string& pressure_unit, const std::string& source,
                                  std::optional<double> threshold, std::optional<double> ratio) {
  ContactClassifier classifier;
  if (threshold) {
    classifier.threshold = require_above("--threshold", *threshold, 0.0, true);
  } else if (pressure_unit == "raw") {
    throw Error(
        Fault::input,
        fmt::format("{}: pressure_unit = raw has no default threshold; give --threshold", source));
  }
  if (ratio) {
    if (!(*ratio >= 0.0 && *ratio < 1.0)) {
      throw Error(Fault::input, fmt::format("--ratio {}: must be at least 0 and below 1", *ratio));
    }
    classifier.ratio = *ratio;
  }
  return classifier;
}

}  // namespace palpate::cli
