#include "recognition/scales_of_maps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "palpate/map_builder.hpp"

namespace palpate {

namespace {

/// Whether recognition judges touches as `map` did: by Eq. 7 with the same numbers, on bins that
/// resolve the maps.
bool judges_as_map(const RecognitionTask& task) {
  constexpr double wider = 2.0;  // a pose between wider bins fits worse
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
         resolves(task.lattice(), task.hypotheses, wider);
}

}  // namespace

bool resolves(const PoseLattice& lattice, std::span<const Hypothesis> hypotheses, double wider) {
  const PoseLattice balanced =
      balanced_lattice(lattice, hypotheses, std::numeric_limits<std::int64_t>::max()).lattice;
  const auto holds = [wider](const Axis& axis, const Axis& fine) {
    return wider * axis.count >= fine.count;
  };
  return holds(lattice.x_mm, balanced.x_mm) && holds(lattice.y_mm, balanced.y_mm) &&
         holds(lattice.theta_rad, balanced.theta_rad);
}

Scales scales_of_maps(const RecognitionTask& task) {
  std::vector<FitScale> fits;
  double logs = 0.0;
  double squares = 0.0;
  double poses = 0.0;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    const auto& source = hypothesis.map.source;
    if (source && source->left_out) {
      fits.push_back(*source->left_out);
    }
    if (source && source->pose_scale) {
      logs += std::log(source->pose_scale->factor);
      squares += source->pose_scale->map_sd_mm * source->pose_scale->map_sd_mm;
      poses += 1.0;
    }
  }
  const bool as_map = judges_as_map(task);
  Scales scales;
  const bool exact = task.touch_sd().none() && task.slip_sd().none();
  if (!fits.empty() && as_map && exact) {
    scales.fit = pooled(fits);
  }
  if (poses > 0.0) {
    scales.pose = {as_map ? std::exp(logs / poses) : 1.0, std::sqrt(squares / poses)};
  }
  return scales;
}

}  // namespace palpate
