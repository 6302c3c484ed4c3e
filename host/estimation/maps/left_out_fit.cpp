#include "estimation/maps/left_out_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "estimation/lattice/refinement.hpp"
#include "model/body_spread.hpp"
#include "model/map_likelihood.hpp"
#include "model/random.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

namespace {

constexpr std::size_t parts = 4;
constexpr std::size_t enough = 200;        // that are judged
constexpr std::size_t groups_judged = 20;  // if there are so many, whatever their touches
constexpr std::size_t least_judged = 16;   // fewer would tell the sd to no more than a fifth of it

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
                                     const ContactModel& model) {
  constexpr std::array<std::size_t, 3> in_group{3, 9, 27};
  constexpr std::size_t most_touches = 54;  // in all groups of a size
  constexpr double another_peak_mm = 1.5;
  constexpr double wide_mm = 0.8;
  const MapLikelihood likelihood(of.compared(), tabulated(model));
  const Body body = displaced_body(of.map);
  const PoseLattice lattice = lattice_about(body);
  std::vector<PlaceError> errors;
  const auto add_group = [&](std::size_t first, std::size_t every, std::size_t count) {
    const auto log_likelihood = [&](std::span<const BinBox> boxes) {
      std::vector<double> logs;
      for (const BinBox& box : boxes) {
        for (std::int64_t i = 0; i < box.bins(); ++i) {
          const Pose T_object_robot = lattice.T_object_robot(box.bin(i, lattice));
          double& sum = logs.emplace_back(0.0);
          for (std::size_t k = 0; k < count; ++k) {
            const TouchEvidence& touch = touches[first + k * every];
            sum += likelihood.at(touch, T_object_robot * touch.T_robot_sensor);
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
    if (glm::length(moved_mm) < another_peak_mm && spread_mm(body, found) < wide_mm) {
      errors.push_back({moved_mm, motion_covariance(body, found)});
    }
  };
  for (const std::size_t count : in_group) {
    // Neighbours of a scan are in groups of their own.
    const std::size_t groups = touches.size() / count;
    for (std::size_t group = 0; group < std::min(groups, most_touches / count); ++group) {
      add_group(group, groups, count);
    }
  }
  return errors;
}

std::optional<PoseScale> pose_scale_of(std::span<const PlaceError> errors) {
  constexpr std::size_t enough_errors = 16;
  constexpr double most_factor = 4.0;
  constexpr double most_mm = 1.5;  // errors are below
  constexpr double fine_mm = 0.3;
  if (errors.size() < enough_errors) {
    return {};
  }
  std::optional<PoseScale> best;
  double least_cost = 0.0;
  for (double factor = most_factor / 64.0; factor <= most_factor; factor *= 1.1) {
    for (double sd_mm = 0.0; sd_mm <= most_mm; sd_mm += sd_mm < fine_mm ? 0.01 : 0.05) {
      double cost = 0.0;
      for (const auto& [moved_mm, covariance] : errors) {
        const glm::dmat3 all = factor * covariance + glm::dmat3(sd_mm * sd_mm);
        cost += std::log(glm::determinant(all)) + glm::dot(moved_mm, glm::inverse(all) * moved_mm);
      }
      if (!best || cost < least_cost) {
        best = {factor, sd_mm};
        least_cost = cost;
      }
    }
  }
  return best;
}

std::vector<std::size_t> places_of(std::span<const TouchEvidence> touches, std::size_t least) {
  constexpr double side_mm = 1.7;
  std::map<std::pair<long, long>, std::size_t> place_in;  // [square]
  std::vector<std::size_t> place;
  for (const TouchEvidence& touch : touches) {
    const glm::dvec2 square = (touch.middle_mm() - touches.front().middle_mm()) / side_mm;
    const std::pair key(std::lround(square.x), std::lround(square.y));
    place.push_back(place_in.try_emplace(key, place_in.size()).first->second);
  }
  if (place_in.size() < least) {
    std::iota(place.begin(), place.end(), std::size_t{0});
  }
  return place;
}

namespace {

/// [touch] the number of its group; none where there are fewer than two.
std::vector<std::size_t> groups_of(const MapSource& source) {
  std::map<std::string, std::size_t> number_of;
  std::vector<std::size_t> numbers;
  for (const std::string& group : source.groups) {
    numbers.push_back(number_of.try_emplace(group, number_of.size()).first->second);
  }
  return number_of.size() < 2 ? std::vector<std::size_t>{} : numbers;
}

/// [touch] one of `parts`, at random; the same for the same number.
std::vector<std::size_t> random_parts(std::vector<std::size_t> number) {
  constexpr std::uint64_t seed = 0;
  Random random(seed, Stream::touch_order);
  std::vector<std::size_t> part_of(number.size());
  for (std::size_t& part : part_of) {
    part = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(parts)));
  }
  std::ranges::transform(number, number.begin(), [&](std::size_t one) { return part_of[one]; });
  return number;
}

}  // namespace

void judge_left_out(Device& device, MapSource& source) {
  const std::vector<Touch> touches = source.touches.touches(0, source.touches.size());
  const ContactModel contact{.classifier = source.options.classifier,
                             .gamma = usual_gamma,
                             .prior = source.options.sensor.prior};
  const std::vector<TouchEvidence> evidence = evidence_of(touches, contact);
  source.left_out.reset();
  source.pose_scale.reset();
  if (std::cmp_less(std::ranges::count_if(evidence, &TouchEvidence::in_contact), least_judged)) {
    return;
  }
  MapBuilder builder(device, source.options);
  // Judges touches on maps of the others: how they fit, and where they seem to lie, each where it
  // is asked for. Touches of one part are left out together.
  const auto leave_out = [&](std::span<const std::size_t> part, std::size_t least_parts,
                             std::vector<double>* z, std::vector<PlaceError>* errors) {
    const std::size_t count = std::ranges::max(part) + 1;
    std::size_t all_judged = 0;
    for (std::size_t left_out = 0;
         left_out < count && (all_judged < enough || left_out < least_parts); ++left_out) {
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
        if (z != nullptr) {
          z->push_back(evidence_fit(std::span(&touch, 1), Pose{}, of.map, contact, {}, 0)->z);
        }
      }
      if (errors != nullptr) {
        std::ranges::move(place_errors(judged, of, contact), std::back_inserter(*errors));
      }
      all_judged += judged.size();
    }
  };
  std::vector<double> z;
  std::vector<PlaceError> errors;
  if (const std::vector<std::size_t> group = groups_of(source); !group.empty()) {
    leave_out(group, groups_judged, &z, &errors);
  } else {
    std::vector<std::size_t> each(touches.size());
    std::iota(each.begin(), each.end(), std::size_t{0});
    leave_out(random_parts(each), 0, &z, nullptr);
    leave_out(random_parts(places_of(evidence, parts)), 0, nullptr, &errors);
  }
  source.left_out = scale_of(z);
  source.pose_scale = pose_scale_of(errors);
}

}  // namespace palpate
