#include "recognition/placed_touches.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "estimation/lattice/refinement.hpp"
#include "model/touch_evidence.hpp"
#include "recognition/belief_cells.hpp"

namespace palpate {

namespace {

ContactModel with_prior(ContactModel contact, const OccupancyGrid& map) {
  contact.prior = contact.prior.value_or(map.prior);
  return contact;
}

bool stays(const Axis& axis) { return axis.lower == axis.upper; }

}  // namespace

PlacedTouches::PlacedTouches(std::span<const TouchEvidence> touches, const RecognitionTask& task,
                             std::size_t object, const PoseLattice& region)
    : touches_(touches),
      likelihood_(task.hypotheses[object].compared(),
                  tabulated(with_prior(task.contact(), task.hypotheses[object].compared())),
                  object),
      region_(region),
      rad_per_mm_(
          1.0 / std::sqrt(std::max(1.0, displaced_body(task.hypotheses[object].map).inertia_mm2))) {
  for (const TouchEvidence& touch : touches) {
    middle_mm_ += touch.middle_mm() / static_cast<double>(touches.size());
  }
}

double PlacedTouches::evaluate(const TouchEvidence& touch, const Pose& T_object_robot,
                               std::span<const Pose> displacements, std::span<double> nats) const {
  const Pose T_object_sensor = T_object_robot * touch.T_robot_sensor;
  for (std::size_t k = 0; k < nats.size(); ++k) {
    nats[k] = likelihood_.at(touch, T_object_sensor * displacements[k]);
  }
  return *std::ranges::max_element(nats);
}

double PlacedTouches::log_likelihood(const Pose& T_object_robot,
                                     std::span<const Pose> displacements, TouchRange range) const {
  std::vector<double> nats(displacements.size());
  double sum = 0.0;
  for (const TouchEvidence& touch : touches_.subspan(range.begin, range.end - range.begin)) {
    const double largest = evaluate(touch, T_object_robot, displacements, nats);
    double mean = 0.0;
    for (const double one : nats) {
      mean += std::exp(one - largest) / static_cast<double>(nats.size());
    }
    sum += largest + std::log(mean);
  }
  return sum;
}

Pose PlacedTouches::moved(const Pose& T_object_robot, const glm::dvec2& shift_mm,
                          double turn_rad) const {
  Pose to{{}, T_object_robot.theta_rad + (stays(region_.theta_rad) ? 0.0 : turn_rad)};
  to.translation_mm = T_object_robot * middle_mm_ + shift_mm - rotate(to.theta_rad, middle_mm_);
  const glm::dvec2 before = T_object_robot * region_.pivot_mm;
  const glm::dvec2 pivot = to * region_.pivot_mm;
  if (stays(region_.x_mm)) {
    to.translation_mm.x += before.x - pivot.x;
  }
  if (stays(region_.y_mm)) {
    to.translation_mm.y += before.y - pivot.y;
  }
  return to;
}

PlacedPeak PlacedTouches::climb(const Pose& from, std::span<const Pose> displacements,
                                TouchRange range, double first_mm, KnownNats* known) const {
  constexpr double finest_mm = 0.1;
  constexpr int most_moves = 40;  // of a step's length
  const auto nats_at = [&](const Pose& to) {
    if (known == nullptr) {
      return log_likelihood(to, displacements, range);
    }
    auto& of = (*known)[{to.translation_mm.x, to.translation_mm.y, to.theta_rad}];
    of.resize(touches_.size(), std::nan(""));
    for (std::size_t i = range.begin; i < range.end; ++i) {
      of[i] = std::isnan(of[i]) ? log_likelihood(to, displacements, {i, i + 1}) : of[i];
    }
    return std::accumulate(of.data() + range.begin, of.data() + range.end, 0.0);
  };
  PlacedPeak best{from, nats_at(from)};
  for (double step = first_mm; step >= finest_mm; step /= 2.0) {
    bool better = true;
    for (int moves = 0; better && moves < most_moves; ++moves) {
      better = false;
      for (int axis = 0; axis < 3; ++axis) {
        for (const double way : {step, -step}) {
          const Pose to = moved(best.T_object_robot, {axis == 0 ? way : 0.0, axis == 1 ? way : 0.0},
                                axis == 2 ? way * rad_per_mm_ : 0.0);
          const double nats = nats_at(to);
          if (nats > best.nats) {
            best = {to, nats};
            better = true;
            break;
          }
        }
      }
    }
  }
  return best;
}

double PlacedTouches::log_volume(const PlacedPeak& peak, std::span<const Pose> displacements,
                                 TouchRange range) const {
  constexpr double step_mm = 0.4;
  constexpr double least_curvature = 0.01;  // per mm^2: no peak is wider than 10 mm
  const std::array<const Axis*, 3> axes = axes_of(region_);
  const auto at = [&](const glm::dvec3& steps) {
    return log_likelihood(
        moved(peak.T_object_robot, step_mm * glm::dvec2(steps), step_mm * steps.z * rad_per_mm_),
        displacements, range);
  };
  const glm::dmat3 unit(1.0);
  glm::dmat3 curvature(1.0);
  double log_unit = 0.0;  // of the volume of the axes that do not stay
  for (int i = 0; i < 3; ++i) {
    if (stays(*axes[i])) {
      continue;
    }
    log_unit += 0.5 * std::log(2.0 * std::numbers::pi) + (i == 2 ? std::log(rad_per_mm_) : 0.0);
    const double bent = 2.0 * peak.nats - at(unit[i]) - at(-unit[i]);
    curvature[i][i] = std::max(bent / (step_mm * step_mm), least_curvature);
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < i; ++j) {
      if (!stays(*axes[i]) && !stays(*axes[j])) {
        const double mixed = at(unit[i] + unit[j]) + at(-unit[i] - unit[j]) -
                             at(unit[i] - unit[j]) - at(unit[j] - unit[i]);
        // Where the touches' ripples outweigh the peak, axes count as independent.
        const double limit = 0.9 * std::sqrt(curvature[i][i] * curvature[j][j]);
        curvature[i][j] = curvature[j][i] =
            std::clamp(-mixed / (4.0 * step_mm * step_mm), -limit, limit);
      }
    }
  }
  double determinant = glm::determinant(curvature);
  if (!(determinant > 0.0)) {
    determinant = curvature[0][0] * curvature[1][1] * curvature[2][2];
  }
  return log_unit - 0.5 * std::log(determinant);
}

double PlacedTouches::displaced_mm(const Pose& T_object_robot, std::span<const Pose> displacements,
                                   TouchRange range) const {
  double squares = 0.0;
  double in_contact = 0.0;
  std::vector<double> nats(displacements.size());
  for (const TouchEvidence& touch : touches_.subspan(range.begin, range.end - range.begin)) {
    if (!touch.in_contact()) {
      continue;
    }
    const double largest = evaluate(touch, T_object_robot, displacements, nats);
    double weight = 0.0;
    double weighed = 0.0;
    for (std::size_t k = 0; k < nats.size(); ++k) {
      const double one = std::exp(nats[k] - largest);
      weight += one;
      weighed += one * glm::dot(displacements[k].translation_mm, displacements[k].translation_mm);
    }
    squares += weighed / weight / 2.0;
    in_contact += 1.0;
  }
  return std::sqrt(squares / std::max(in_contact, 1.0));
}

}  // namespace palpate
