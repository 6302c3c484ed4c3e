#include "recognition/scales_of_maps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "model/element_spacing.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

namespace {

/// A pose between bins that are so many times wider than the maps resolve fits worse.
constexpr double too_wide = 2.0;

/// Whether recognition judges touches as `map` did: by Eq. 7 with the same numbers, on bins that
/// resolve the maps.
bool judges_as_map(const RecognitionTask& task, std::optional<double> near_mm) {
  const ContactModel& contact = task.contact();
  const auto alike = [&](const Hypothesis& hypothesis) {
    const auto& source = hypothesis.map.source;
    if (!source || !source->left_out) {
      return true;
    }
    const ContactClassifier& own = source->options.classifier;
    return own.threshold == contact.classifier.threshold && own.ratio == contact.classifier.ratio &&
           contact.prior.value_or(hypothesis.map.prior) == hypothesis.map.prior;
  };
  return !contact.table && contact.gamma == usual_gamma && traits_of(task.filter).bins &&
         std::ranges::all_of(task.hypotheses, alike) &&
         resolves(task.lattice(), task.hypotheses, too_wide, near_mm);
}

}  // namespace

bool resolves(const PoseLattice& lattice, std::span<const Hypothesis> hypotheses, double wider,
              std::optional<double> near_mm) {
  const auto balanced_on = [&](const PoseLattice& region) {
    return balanced_lattice(region, hypotheses, std::numeric_limits<std::int64_t>::max()).lattice;
  };
  PoseLattice balanced = balanced_on(lattice);
  if (near_mm) {
    PoseLattice near = touch_region(hypotheses, *near_mm).lattice;
    near.theta_rad = lattice.theta_rad;
    balanced.theta_rad.count =
        std::min(balanced.theta_rad.count, balanced_on(near).theta_rad.count);
  }
  const auto holds = [wider](const Axis& axis, const Axis& fine) {
    return wider * axis.count >= fine.count;
  };
  return holds(lattice.x_mm, balanced.x_mm) && holds(lattice.y_mm, balanced.y_mm) &&
         holds(lattice.theta_rad, balanced.theta_rad);
}

Scales scales_of_maps(const RecognitionTask& task, std::optional<double> near_mm) {
  std::vector<FitScale> fits;
  double logs = 0.0;
  double squares = 0.0;
  double poses = 0.0;
  std::optional<FitArray> array;  // of the last map: all are touched by one as a rule
  for (const Hypothesis& hypothesis : task.hypotheses) {
    const auto& source = hypothesis.map.source;
    if (source && source->left_out) {
      fits.push_back(*source->left_out);
      const std::size_t elements = source->touches.elements();
      if (const auto spacing = spacing_of(std::span(source->touches.elements_mm).first(elements))) {
        array = {static_cast<double>(elements), spacing->nearest_mm.most};
      }
    }
    if (source && source->pose_scale) {
      logs += std::log(source->pose_scale->factor);
      squares += source->pose_scale->map_sd_mm * source->pose_scale->map_sd_mm;
      poses += 1.0;
    }
  }
  const bool as_map = judges_as_map(task, near_mm);
  Scales scales;
  const bool exact = task.touch_sd().none() && task.slip_sd().none();
  if (!fits.empty() && as_map && exact) {
    scales.fit = pooled(fits);
    scales.fit.array = array;
  }
  if (poses > 0.0) {
    scales.pose = {as_map ? std::exp(logs / poses) : 1.0, std::sqrt(squares / poses)};
  }
  return scales;
}

std::string far_pivot_sentence(const RecognitionTask& task, double reach_mm, bool without_none) {
  const PoseLattice& lattice = task.lattice();
  if (task.auto_pivot || !traits_of(task.filter).bins ||
      resolves(lattice, task.hypotheses, too_wide, {}) ||
      !resolves(lattice, task.hypotheses, too_wide, reach_mm)) {
    return "";
  }
  const double far_mm = 0.5 * std::hypot(lattice.x_mm.upper - lattice.x_mm.lower,
                                         lattice.y_mm.upper - lattice.y_mm.lower);
  std::string left_out;
  if (without_none) {
    left_out = ", and \"(none)\" is left out";
  } else if (!task.contact().table) {
    left_out = ", and fits and deviations may be off";
  }
  return fmt::format(
      "a step of theta moves an object {:.0f} mm from the pivot by {:.2g} mm, more than the maps "
      "resolve{}. Give `pivot-mm auto`, which turns objects about the first touch, or more bins of "
      "theta",
      far_mm, far_mm * lattice.theta_rad.step(), left_out);
}

}  // namespace palpate
