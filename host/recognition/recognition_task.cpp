#include "recognition/recognition_task.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

namespace palpate {

std::int64_t bins_in_all(std::size_t objects, const PoseLattice& lattice) {
  // In float64, as counts of three axes may exceed an integer.
  const double all = static_cast<double>(objects) * lattice.x_mm.count * lattice.y_mm.count *
                     lattice.theta_rad.count;
  constexpr double most = 9e18;
  return static_cast<std::int64_t>(std::min(all, most));
}

RecognitionTask::RecognitionTask(std::vector<Hypothesis> objects, const FilterOptions& options)
    : hypotheses(std::move(objects)), filter(options) {
  for (const Hypothesis& hypothesis : hypotheses) {
    const std::string& label = hypothesis.map.label;
    const auto known = std::find(labels.begin(), labels.end(), label);
    label_of.push_back(static_cast<std::size_t>(known - labels.begin()));
    const bool occupied =
        std::ranges::any_of(hypothesis.map.log_odds, [](float l) { return l > 0.0F; });
    bodies.push_back(occupied ? std::optional(body_of(hypothesis.map)) : std::nullopt);
    if (known == labels.end()) {
      labels.push_back(label);
    }
  }
  if (traits_of(filter).none_weight) {
    labels.emplace_back(none_label);
  }
}

FilterOptions opened_filter(const RecognitionTask& task) {
  constexpr double share = 0.05;
  constexpr double negligible = 1e-4;
  constexpr std::int64_t poor_bins = 20'000;  // about as many as Eq. 7 needs of such touches
  FilterOptions filter = task.filter;
  auto* bounded = std::get_if<BoundedOptions>(&filter);
  if (bounded == nullptr) {
    return filter;
  }
  if (task.cancel_point) {
    bounded->cancel_point = task.cancel_point;
  }
  if (task.contact().table) {
    bounded->poor_bins = poor_bins;
  }
  const bool tempered = task.temperature > 1.0 || task.temperature_growth > 0.0;
  if ((tempered || task.features || task.familiarity) && !bounded->evidence_nats) {
    bounded->evidence_nats = share * task.temperature;
    bounded->evidence_range_nats = -std::log(negligible) * task.temperature;
    // Familiarity is told of a single touch.
    bounded->single_touch_range_nats = task.familiarity ? FamiliarityScore::most_lead_nats : 0.0;
    bounded->evidence_growth = task.temperature_growth / task.temperature;
  }
  return filter;
}

std::string wider_bins_sentence(const RecognitionTask& task) {
  if (!task.learned_bins || !traits_of(task.filter).bins) {
    return "";
  }
  constexpr double much = 1.5;
  const BinSteps& learned = *task.learned_bins;
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

bool tells_known(const RecognitionTask& task) {
  return task.familiarity && traits_of(task.filter).bins;
}

}  // namespace palpate
