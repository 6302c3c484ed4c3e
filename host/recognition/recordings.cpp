#include "recognition/recordings.hpp"

#include <algorithm>
#include <iterator>
#include <set>

#include "io/input_file.hpp"
#include "io/recording_rules.hpp"
#include "options/option.hpp"
#include "palpate/files.hpp"

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
  if (!threshold && pressure_unit == "raw") {
    refuse(source, "pressure_unit = raw has no default threshold; give `threshold`");
  }
  classifier.threshold = threshold.value_or(classifier.threshold);
  classifier.ratio = ratio.value_or(classifier.ratio);
  return classifier;
}

void require_selection(const Request& request) {
  require_sound(request);
  if (request.touches && request.each_frame) {
    refuse_option("touches",
                  "with `each-frame` every unknown has one touch; leave one of them out");
  }
}

std::vector<Query> unknowns_in(const Request& request, const std::optional<Frames>& frames,
                               const Recording& recording) {
  auto [begin, end] = selected_touches(recording, frames);
  if (request.touches && static_cast<std::size_t>(*request.touches) > end - begin) {
    refuse(recording.path, "has {} touches; `touches {}` is too many", end - begin,
           *request.touches);
  }
  const PartialTruth truth = partial_truth(recording.object, recording.truth);
  if (!request.each_frame) {
    end = request.touches ? begin + static_cast<std::size_t>(*request.touches) : end;
    return {{recording.path, {}, recording.touches(begin, end), truth}};
  }
  std::vector<Query> unknowns;
  for (std::size_t i = begin; i < end; ++i) {
    unknowns.push_back({recording.path, i, {recording.touch(i)}, truth});
  }
  return unknowns;
}

std::vector<Query> list_unknowns(const Request& request, std::span<const Recording> recordings) {
  require_selection(request);
  std::vector<Query> unknowns;
  for (const Recording& recording : recordings) {
    std::ranges::move(unknowns_in(request, request.frames, recording),
                      std::back_inserter(unknowns));
  }
  return unknowns;
}

double largest_reach_mm(std::span<const Recording> recordings) {
  double reach = 0.0;
  for (const Recording& recording : recordings) {
    for (const Touch& touch : recording.touches(0, recording.size())) {
      reach = std::max(reach, array_reach_mm(touch.elements_mm));
    }
  }
  return reach;
}

}  // namespace palpate
