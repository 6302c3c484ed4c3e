#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "bounded_answers.hpp"
#include "bounded_parts.hpp"
#include "pressed_objects.hpp"

namespace palpate::bench {

namespace {

constexpr double x_mm = 50.0;
constexpr double y_mm = 31.0;
constexpr double most_ms = 500.0;

/// Frames of every object that the dense engine answers, too, besides the map's.
constexpr std::size_t dense_frames[] = {1, 13};

/// The region in steps of half a pitch and 2.5 degrees.
PoseLattice lattice_of(const PressedObjects& objects, bool quick) {
  const double step_mm = objects.pitch_mm / 2.0 * (quick ? 10.0 : 1.0);
  const auto axis = [step_mm](double extent_mm) {
    return Axis{-extent_mm, extent_mm, static_cast<int>(std::lround(2.0 * extent_mm / step_mm))};
  };
  return {.x_mm = axis(x_mm),
          .y_mm = axis(y_mm),
          .theta_rad = {0.0, 2.0 * std::numbers::pi, quick ? 4 : 144}};
}

std::size_t best_of(const Estimate& estimate) {
  return static_cast<std::size_t>(std::ranges::max_element(estimate.identity) -
                                  estimate.identity.begin());
}

}  // namespace

Json measure_bounded_presses(const BoundedInputs& inputs, Report& report) {
  const bool quick = inputs.options.quick;
  const PressedObjects objects = read_presses(inputs.device, inputs.options.presses);
  const PoseLattice lattice = lattice_of(objects, quick);
  const auto bins = lattice.bins() * static_cast<std::int64_t>(objects.maps.size());
  const BoundedOptions options{.lattice = lattice, .contact = objects.contact};
  BoundedPosterior posterior(objects.maps, options);
  // All frames lie at one place: the dense engine evaluates what is in contact, and the rest once.
  PoseHistogram histogram(inputs.device, objects.maps,
                          {.lattice = lattice, .contact = objects.contact, .still_array = true});
  BoundedAnswers answers;
  int right = 0;
  int compared = 0;
  int same = 0;
  std::vector<double> dense_ms;
  Json bests = Json::array();
  for (std::size_t i = 0; i < objects.recordings.size(); ++i) {
    const Recording& recording = objects.recordings[i];
    const std::size_t frames =
        quick ? std::min<std::size_t>(recording.size(), 2) : recording.size();
    for (std::size_t frame = 1; frame < frames; ++frame) {
      const std::vector<Touch> touch = recording.touches(frame, frame + 1);
      posterior.reset();
      answers.all.push_back(answer(posterior, touch));
      const std::size_t best = best_of(answers.all.back().estimate);
      right += best == i ? 1 : 0;
      bests.push_back(objects.maps[best].map.label);
      if (std::ranges::count(dense_frames, frame) > 0) {
        histogram.reset();
        Estimate dense;
        dense_ms.push_back(1e3 * seconds_of([&] {
                             histogram.update(touch);
                             dense = histogram.estimate();
                           }));
        ++compared;
        same += best_of(dense) == best ? 1 : 0;
      }
    }
  }
  Case measured{.name = fmt::format("presses {}", size_of(lattice)),
                .facts = {{"objects", objects.maps.size()},
                          {"elements", objects.recordings.front().elements()},
                          {"bins in all", bins},
                          {"frames", answers.all.size()},
                          {"path", posterior.path()}},
                .measurements = measurements_of(answers, "a frame", bins, at_most(most_ms))};
  std::vector<Measurement>& rows = measured.measurements;
  rows.push_back({"dense engine, array at rest, median", median(dense_ms), "ms"});
  rows.push_back(share_of("the dense engine's best label", same, static_cast<std::size_t>(compared),
                          at_least(100.0)));
  rows.push_back(share_of("label right", right, answers.all.size()));
  report.add(measured);
  Json record{{"bins_in_all", bins},
              {"host_bytes", posterior.host_bytes()},
              {"best", bests},
              {"dense_ms", dense_ms}};
  record.update(record_of(answers));
  return record;
}

}  // namespace palpate::bench
