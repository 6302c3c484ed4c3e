#include "recognition/scales.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "model/body_spread.hpp"
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

/// The variance after all touches by readings of this variance.
double filtered(double readings_mm2, const MotionVariances& known) {
  const double of_touch = readings_mm2 + known.displacement_mm2;
  double variance = of_touch;
  for (int i = 1; i < known.touches && of_touch > 0.0; ++i) {
    const double moved = variance + known.slip_mm2;
    variance = moved * of_touch / (moved + of_touch);
  }
  return variance;
}

MotionVariances motion_variances(const RecognitionTask& task,
                                 std::span<const TouchEvidence> touches, const Body& body,
                                 const ObjectPose& pose) {
  const DisplacementSd touch_sd = task.touch_sd();
  const DisplacementSd slip_sd = task.slip_sd();
  const glm::dvec2 centroid_mm = pose.T_robot_object * body.centroid_mm;
  const auto variance_mm2 = [&](const DisplacementSd& sd, const glm::dvec2& arm_mm) {
    return 2.0 * sd.mm * sd.mm + sd.rad * sd.rad * (glm::dot(arm_mm, arm_mm) + body.inertia_mm2);
  };
  MotionVariances sum{.slip_mm2 = variance_mm2(slip_sd, {0.0, 0.0})};
  for (const TouchEvidence& touch : touches) {
    if (touch.in_contact()) {
      sum.displacement_mm2 +=
          variance_mm2(touch_sd, touch.T_robot_sensor.translation_mm - centroid_mm);
      ++sum.touches;
    }
  }
  sum.displacement_mm2 /= std::max(sum.touches, 1);
  return sum;
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
  const bool undisplaced = task.touch_sd().none() && task.slip_sd().none();
  if (!fits.empty() && as_map && undisplaced) {
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

double belief_factor(double factor, double variance_mm2, const MotionVariances& known) {
  if (known.displacement_mm2 == 0.0 && known.slip_mm2 == 0.0) {
    return factor;
  }
  // More readings' variance makes the belief's larger.
  double low = 0.0;
  double high = variance_mm2 * std::max(known.touches, 1);
  if (filtered(low, known) >= variance_mm2) {
    return 1.0;
  }
  constexpr int halvings = 40;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (filtered(middle, known) < variance_mm2 ? low : high) = middle;
  }
  return filtered(factor * high, known) / filtered(high, known);
}

ObjectPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                    const Body& body, const ObjectPose& pose) {
  const double sd_mm = spread_mm(body, pose);
  PoseScale scale = task.pose_scale();
  scale.factor =
      belief_factor(scale.factor, sd_mm * sd_mm, motion_variances(task, touches, body, pose));
  return scaled(body, pose, scale);
}

RefinedPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                     const Body& body, const RefinedPose& pose) {
  const ObjectPose of_robot = on_scale(task, touches, body, inverse(pose));
  return {pose.T_object_robot,
          inverse(RefinedPose{of_robot.T_robot_object, of_robot.covariance}).covariance};
}

}  // namespace palpate
