#include "recognition/recordings.hpp"

#include <cmath>
#include <set>

#include "io/file_identity.hpp"
#include "io/recording_rules.hpp"
#include "palpate/files.hpp"
#include "recognition/refused_option.hpp"

namespace palpate {

std::vector<Recording> read_touch_recordings(const std::vector<std::string>& paths) {
  std::vector<Recording> recordings;
  std::set<std::optional<FileIdentity>> seen;
  for (const std::string& path : paths) {
    recordings.push_back(read_recording(path));
    const Recording& recording = recordings.back();
    if (!seen.insert(identity_of(path)).second) {
      refuse(path, "given twice; leave one out");
    }
    require_touches(recording, recordings.front());
  }
  return recordings;
}

void require_touches(const Recording& recording, const Recording& first) {
  require_rows_of_touches(recording);
  if (recording.pressure_unit != first.pressure_unit) {
    refuse(
        recording.path,
        "pressure_unit is {} but {} has {}; one threshold does not fit both, use a call for each",
        recording.pressure_unit, first.path, first.pressure_unit);
  }
}

Frames selected_touches(const Recording& recording, const std::optional<Frames>& frames) {
  if (!frames) {
    return {0, recording.size()};
  }
  if (frames->end > recording.size()) {
    refuse(recording.path, "has {} touches, `frames {}:{}` reaches beyond; end at most at {}",
           recording.size(), frames->begin, frames->end, recording.size());
  }
  return *frames;
}

ContactClassifier make_classifier(const std::string& pressure_unit, const std::string& source,
                                  std::optional<double> threshold, std::optional<double> ratio) {
  ContactClassifier classifier;
  if (threshold) {
    if (!(*threshold >= 0.0 && std::isfinite(*threshold))) {
      refuse_option("threshold", *threshold, "must be at least 0");
    }
    classifier.threshold = *threshold;
  } else if (pressure_unit == "raw") {
    refuse(source, "pressure_unit = raw has no default threshold; give `threshold`");
  }
  if (ratio) {
    if (!(*ratio >= 0.0 && *ratio < 1.0)) {
      refuse_option("ratio", *ratio, "must be at least 0 and below 1");
    }
    classifier.ratio = *ratio;
  }
  return classifier;
}

}  // namespace palpate
