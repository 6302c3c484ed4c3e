#include "recognition/recognition_task.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "model/element_spacing.hpp"

namespace palpate {

namespace {

/// RecognitionTask::labels
std::vector<std::string> labels_in(const std::vector<Hypothesis>& hypotheses, bool with_none) {
  std::vector<std::string> labels;
  for (const Hypothesis& hypothesis : hypotheses) {
    const std::string& label = hypothesis.map.label;
    if (std::ranges::find(labels, label) == labels.end()) {
      labels.push_back(label);
    }
  }
  if (with_none) {
    labels.emplace_back(none_label);
  }
  return labels;
}

/// RecognitionTask::label_of
std::vector<std::size_t> label_indices(const std::vector<Hypothesis>& hypotheses,
                                       const std::vector<std::string>& labels) {
  std::vector<std::size_t> indices;
  for (const Hypothesis& hypothesis : hypotheses) {
    const auto known = std::ranges::find(labels, hypothesis.map.label);
    indices.push_back(static_cast<std::size_t>(known - labels.begin()));
  }
  return indices;
}

/// RecognitionTask::bodies
std::vector<std::optional<Body>> bodies_of(const std::vector<Hypothesis>& hypotheses) {
  std::vector<std::optional<Body>> bodies;
  for (const Hypothesis& hypothesis : hypotheses) {
    const bool occupied =
        std::ranges::any_of(hypothesis.map.log_odds, [](float l) { return l > 0.0F; });
    bodies.push_back(occupied ? std::optional(body_of(hypothesis.map)) : std::nullopt);
  }
  return bodies;
}

}  // namespace

std::int64_t bins_in_all(std::size_t objects, const PoseLattice& lattice) {
  // In float64, as counts of three axes may exceed an integer.
  const double all = static_cast<double>(objects) * lattice.x_mm.count * lattice.y_mm.count *
                     lattice.theta_rad.count;
  constexpr double most = 9e18;
  return static_cast<std::int64_t>(std::min(all, most));
}

RecognitionTask::RecognitionTask(std::vector<Hypothesis> objects, FilterOptions options)
    : hypotheses(std::move(objects)),
      filter(std::move(options)),
      labels(labels_in(hypotheses, traits_of(filter).none_weight.has_value())),
      label_of(label_indices(hypotheses, labels)),
      bodies(bodies_of(hypotheses)) {}

std::string RecognitionTask::name_of(int object) const {
  const Hypothesis& hypothesis = hypotheses[static_cast<std::size_t>(object)];
  return hypothesis.map.label + (hypothesis.mirrored ? " mirrored" : "");
}

double RecognitionTask::temperature_after(std::span<const TouchEvidence> touches) const {
  const auto informative = std::ranges::count_if(touches, &TouchEvidence::tells);
  return temperature_of(static_cast<std::size_t>(std::max<std::ptrdiff_t>(informative, 1)),
                        sensor.temperature, sensor.temperature_growth);
}

FitScale RecognitionTask::fit_scale_for(std::span<const TouchEvidence> touches) const {
  double known = 0.0;
  double in_contact = 0.0;
  const TouchEvidence* last = nullptr;
  for (const TouchEvidence& touch : touches) {
    if (touch.in_contact()) {
      known += static_cast<double>(touch.readings.size()) -
               static_cast<double>(std::ranges::count(touch.readings, Reading::unknown));
      in_contact += 1.0;
      last = &touch;
    }
  }
  const FitScale scale = fit_scale();
  if (last == nullptr || !scale.array) {
    return scale;
  }
  const std::optional<ElementSpacing> spacing = spacing_of(last->elements_mm);
  return scale.for_array({known / in_contact, spacing ? spacing->nearest_mm.most : 0.0});
}

std::string wider_bins_sentence(const RecognitionTask& task) {
  if (!task.sensor.bins || !traits_of(task.filter).bins) {
    return "";
  }
  constexpr double much = 1.5;
  const BinSteps& learned = *task.sensor.bins;
  const PoseLattice& lattice = task.lattice();
  // A fixed axis has a step of 0, and is no wider than any.
  const double x_mm = lattice.x_mm.step();
  const double y_mm = lattice.y_mm.step();
  const double theta_rad = lattice.theta_rad.step();
  // Bins are narrow beside a belief that is smooth over so much of a standard deviation: a little
  // more than balanced_lattice() takes.
  constexpr double of_sd = 0.51;
  const DisplacementSd sd = task.touch_sd();
  if (!(x_mm > std::max(much * learned.x_mm, of_sd * sd.mm) ||
        y_mm > std::max(much * learned.y_mm, of_sd * sd.mm) ||
        theta_rad > std::max(much * learned.theta_rad, of_sd * sd.rad))) {
    return "";
  }
  constexpr double degrees = 180.0 / std::numbers::pi;
  return fmt::format(
      "bins are {:.3g} x {:.3g} mm x {:.3g} degrees wide, wider than the {:.3g} x {:.3g} mm x "
      "{:.3g} degrees that the sensor model is for: probabilities are too sure; calibrate with "
      "`bins {}x{}x{}` and this region, or take more bins",
      x_mm, y_mm, degrees * theta_rad, learned.x_mm, learned.y_mm, degrees * learned.theta_rad,
      lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count);
}

}  // namespace palpate
