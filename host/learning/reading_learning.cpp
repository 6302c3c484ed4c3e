#include "learning/reading_learning.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "learning/contact_learning.hpp"
#include "learning/point_spread.hpp"
#include "palpate/error.hpp"

namespace palpate {

MapOptions LearnedReadings::maps(double spacing_mm) const {
  return {.cell_mm = 0.5 * spacing_mm,
          .sensor = {.spread_mm = spread_mm, .prior = prior},
          .classifier = classifier};
}

LearnedReadings learn_readings(const std::vector<Press>& presses, const ReadingOptions& options) {
  LearnedReadings readings;
  if (options.threshold && options.ratio) {
    readings.classifier = {.threshold = *options.threshold, .ratio = *options.ratio};
  } else {
    readings.classifier = learn_classifier(presses, options.threshold);
    readings.classifier.ratio = options.ratio.value_or(readings.classifier.ratio);
  }
  readings.noise = noise_floor(presses, readings.classifier);
  // Noise alone is to make no contact.
  constexpr double noise_sd = 3.0;
  if (!options.threshold) {
    readings.classifier.threshold =
        std::max(readings.classifier.threshold, noise_sd * readings.noise);
  }
  readings.classifier.validate();
  if (contact_pressures(presses, readings.classifier).empty()) {
    throw Error(Fault::input,
                fmt::format("no pressure is above the contact threshold, {:g} {}; give a lower "
                            "`threshold`",
                            readings.classifier.threshold, options.pressure_unit));
  }
  std::vector<Touch> touches;
  bool known_poses = true;
  for (const Press& press : presses) {
    touches.insert(touches.end(), press.touches.begin(), press.touches.end());
    known_poses = known_poses && press.T_object_robot.has_value();
  }
  readings.prior = share_in_contact(touches, readings.classifier);
  if (known_poses) {
    readings.psf_mm = learn_point_spread(presses, readings.classifier);
  }
  // As for maps of presses at unknown poses: leaves no gaps between the elements of a press.
  constexpr double of_spacing = 0.6;
  readings.spread_mm = readings.psf_mm ? *readings.psf_mm / 2.0 : of_spacing * options.spacing_mm;
  return readings;
}

std::vector<double> level_edges_of(const std::vector<Press>& presses,
                                   const ContactClassifier& classifier, std::size_t levels) {
  const std::vector<double> pressures = contact_pressures(presses, classifier);
  std::vector<double> edges;
  for (std::size_t level = 2; level < levels && !pressures.empty(); ++level) {
    const double edge = pressures[(level - 1) * pressures.size() / (levels - 1)];
    if (edge > (edges.empty() ? pressures.front() : edges.back())) {
      edges.push_back(edge);
    }
  }
  return edges;
}

}  // namespace palpate
