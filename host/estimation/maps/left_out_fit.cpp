#include "estimation/maps/left_out_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "estimation/lattice/refinement.hpp"
#include "model/body_spread.hpp"
#include "model/interpolated_map.hpp"
#include "model/random.hpp"

namespace palpate {

namespace {

constexpr std::size_t parts = 4;
constexpr std::size_t enough = 200;  // that are judged
constexpr std::size_t least = 16;    // fewer would tell the sd to no more than a fifth of it

/// Bins of T_object_robot about the identity, wide enough for refine() to move its window.
PoseLattice lattice_about(const Body& body) {
  constexpr double step_mm = 0.6;
  constexpr int steps = 15;
  const auto axis = [](double middle, double step) {
    return Axis{middle - 0.5 * steps * step, middle + 0.5 * steps * step, steps};
  };
  const double spin_mm = std::sqrt(std::max(body.inertia_mm2, step_mm * step_mm));
  return {axis(body.centroid_mm.x, step_mm), axis(body.centroid_mm.y, step_mm),
          axis(0.0, step_mm / spin_mm), body.centroid_mm};
}

}  // namespace

std::optional<FitScale> scale_of(std::span<const double> z) {
  const auto n = static_cast<double>(z.size());
  FitScale scale{.mean = 0.0, .sd = 0.0};
  for (const double one : z) {
    scale.mean += one / n;
  }
  for (const double one : z) {
    scale.sd += (one - scale.mean) * (one - scale.mean) / (n - 1.0);
  }
  scale.sd = std::sqrt(scale.sd);
  return z.size() > 1 && scale.sd > 0.0 ? std::optional(scale) : std::nullopt;
}

std::vector<PlaceError> place_errors(std::span<const TouchEvidence> touches, const Hypothesis& of,
                                     const ContactModel& contact, std::size_t object) {
  constexpr std::size_t in_group = 9;
  constexpr std::size_t most_groups = 8;
  const Body body = displaced_body(of.map);
  const InterpolatedMap map(of.compared(), *contact.prior);
  const PoseLattice lattice = lattice_about(body);
  const std::size_t groups = touches.size() / in_group;
  std::vector<PlaceError> errors;
  for (std::size_t group = 0; group < std::min(groups, most_groups); ++group) {
    const auto log_likelihood = [&](std::span<const BinBox> boxes) {
      std::vector<double> logs;
      for (const BinBox& box : boxes) {
        for (std::int64_t i = 0; i < box.bins(); ++i) {
          const Pose T_object_robot = lattice.T_object_robot(box.bin(i, lattice));
          double& sum = logs.emplace_back(0.0);
          // Neighbours of a scan are in groups of their own.
          for (std::size_t k = group; k < touches.size(); k += groups) {
            const Pose T_object_sensor = T_object_robot * touches[k].T_robot_sensor;
            for (std::size_t e = 0; e < touches[k].readings.size(); ++e) {
              const glm::dvec2 at_mm = T_object_sensor * touches[k].elements_mm[e];
              sum += contact.log_likelihood(touches[k].readings[e], {map.log_odds(at_mm)}, object);
            }
          }
        }
      }
      return logs;
    };
    const Mode own{.T_object_robot = Pose{}};
    const ObjectPose found = inverse(refine(log_likelihood, lattice, body, own));
    const Pose& at = found.T_robot_object;
    const glm::dvec3 moved_mm(at * body.centroid_mm - body.centroid_mm,
                              at.theta_rad * std::sqrt(body.inertia_mm2));
    constexpr double another_peak_mm = 1.5;
    if (glm::length(moved_mm) < another_peak_mm) {
      errors.push_back({moved_mm, motion_covariance(body, found)});
    }
  }
  return errors;
}

std::optional<double> place_sd_of(std::span<const PlaceError> errors) {
  constexpr std::size_t enough_errors = 8;
  constexpr int halvings = 30;
  if (errors.size() < enough_errors) {
    return {};
  }
  const auto too_far = [&](double variance) {
    double squared = 0.0;
    for (const auto& [moved_mm, covariance] : errors) {
      squared += glm::dot(moved_mm, glm::inverse(covariance + glm::dmat3(variance)) * moved_mm);
    }
    return squared > 3.0 * static_cast<double>(errors.size());
  };
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < halvings && too_far(0.0); ++i) {
    const double middle = 0.5 * (low + high);
    (too_far(middle) ? low : high) = middle;
  }
  return std::sqrt(low);
}

void judge_left_out(Device& device, MapSource& source) {
  const std::vector<Touch> touches = source.touches.touches(0, source.touches.size());
  const ContactModel contact{.classifier = source.options.classifier,
                             .gamma = usual_gamma,
                             .prior = source.options.sensor.prior};
  const std::vector<TouchEvidence> evidence = evidence_of(touches, contact);
  source.left_out.reset();
  source.place_sd_mm.reset();
  if (std::cmp_less(std::ranges::count_if(evidence, &TouchEvidence::in_contact), least)) {
    return;
  }
  constexpr std::uint64_t seed = 0;
  Random random(seed, Stream::touch_order);
  std::vector<std::size_t> part(touches.size());
  for (std::size_t& one : part) {
    one = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(parts)));
  }
  MapBuilder builder(device, source.options);
  std::vector<double> z;
  std::vector<PlaceError> errors;
  for (std::size_t left_out = 0; left_out < parts && z.size() < enough; ++left_out) {
    std::vector<Touch> others;
    std::vector<TouchEvidence> judged;
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (part[i] != left_out) {
        others.push_back(touches[i]);
      } else if (evidence[i].in_contact()) {
        judged.push_back(evidence[i]);
      }
    }
    builder.clear();
    builder.add(others);
    const Hypothesis of{.map = builder.build(source.touches.object)};
    for (const TouchEvidence& touch : judged) {
      z.push_back(evidence_fit(std::span(&touch, 1), Pose{}, of.map, contact, 0)->z);
    }
    std::ranges::move(place_errors(judged, of, contact, 0), std::back_inserter(errors));
  }
  source.left_out = scale_of(z);
  source.place_sd_mm = place_sd_of(errors);
}

}  // namespace palpate
