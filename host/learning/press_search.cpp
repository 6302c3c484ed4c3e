#include "learning/press_placement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>

#include "learning/local_search.hpp"
#include "model/bounding_box.hpp"
#include "model/map_likelihood.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

PressSide::PressSide(const Touch& given, const ContactModel& model, bool mirrored) : touch(given) {
  TouchEvidence& all = evidence.emplace_back(given, model);
  for (glm::dvec2& element : all.elements_mm) {
    element.x *= mirrored ? -1.0 : 1.0;
  }
  if (mirrored) {
    touch.elements_mm = all.elements_mm;
  }
  TouchEvidence& touched = contact.emplace_back(all.contact());
  const double count = all.in_contact() ? static_cast<double>(all.contacts) : 1.0;
  glm::dvec2 middle_mm(0.0);
  for (const glm::dvec2& element : touched.elements_mm) {
    middle_mm += element;
  }
  middle_mm /= count;
  double squares = 0.0;
  for (const glm::dvec2& element : touched.elements_mm) {
    const glm::dvec2 from_middle = element - middle_mm;
    squares += glm::dot(from_middle, from_middle) / count;
  }
  reach_mm = std::sqrt(squares);
  all.T_robot_sensor = touched.T_robot_sensor = touch.T_robot_sensor = {-middle_mm, 0.0};
}

double displacement_mm(const PressSide& press, const Pose& T_object_robot, const Pose& other) {
  const glm::dvec2 d = T_object_robot.translation_mm - other.translation_mm;
  const double turned = 1.0 - std::cos(T_object_robot.theta_rad - other.theta_rad);
  return std::sqrt(glm::dot(d, d) + 2.0 * press.reach_mm * press.reach_mm * turned);
}

/// One side of a press on a map, at all bins.
struct PressSearch::SideScores {
  const PressSide& side;
  bool mirrored;
  PoseLattice lattice;
  PressPlacer placer;
  std::vector<float> bins;
};

namespace {

/// A pose so far beyond every map that only the map's prior counts there.
constexpr Pose beyond{{2.0 * farthest_mm, 0.0}, 0.0};

/// The best bin at each angle.
std::vector<std::size_t> best_bins(const std::vector<float>& bins, const PoseLattice& lattice) {
  std::vector<std::size_t> best;
  const auto plane = static_cast<std::ptrdiff_t>(lattice.plane());
  for (auto from = bins.begin(); from != bins.end(); from += plane) {
    best.push_back(static_cast<std::size_t>(std::max_element(from, from + plane) - bins.begin()));
  }
  return best;
}

/// All angles, and the places of the middle of a press's contact that PressSearch compares.
PoseLattice lattice_for(const PressSide& side, const Hypothesis& map, double step_mm, int angles) {
  const BoundingBox box = occupied_box(map.map);
  const double beside_mm = side.reach_mm / 2.0;
  const auto axis = [&](double lower, double upper) {
    const double middle = (lower + upper) / 2.0;
    const double extent = upper - lower + 2.0 * beside_mm;
    const int count = std::max(1, static_cast<int>(std::ceil(extent / step_mm)));
    return Axis{middle - count * step_mm / 2.0, middle + count * step_mm / 2.0, count};
  };
  return {.x_mm = axis(box.lower.x, box.upper.x),
          .y_mm = axis(box.lower.y, box.upper.y),
          .theta_rad = {0.0, 2.0 * std::numbers::pi, angles}};
}

}  // namespace

PressSearch::PressSearch(const ContactModel& contact, double step_mm, double reach_mm,
                         double temperature)
    : contact_(tabulated(contact)), step_mm_(step_mm), temperature_(temperature) {
  // So many that the lattice moves a contact by about one and a half steps; the search climbs
  // between them.
  constexpr int fewest = 24;
  constexpr int limit = 48;
  const double angles = std::ceil(2.0 * std::numbers::pi * reach_mm / (1.5 * step_mm));
  angles_ = std::clamp(static_cast<int>(angles), fewest, limit);
}

double PressSearch::gain(std::span<const TouchEvidence> press, const Hypothesis& map,
                         const Pose& T_object_robot) const {
  ContactModel contact = contact_;
  contact.prior = map.compared().prior;  // beyond the layer lies its own prior
  const MapLikelihood likelihood(map.compared(), contact);
  return likelihood.at(press, T_object_robot) - likelihood.at(press, beyond);
}

double PressSearch::certainty_of(const Pose& best, const SideScores& on,
                                 const std::vector<SideScores>& scores) const {
  constexpr double negligible = 20.0;  // e^-20: a million such places weigh 2e-3
  float highest = -std::numeric_limits<float>::infinity();
  for (const SideScores& of : scores) {
    highest = std::max(highest, *std::ranges::max_element(of.bins));
  }
  double near = 0.0;
  double total = 0.0;
  for (const SideScores& of : scores) {
    for (std::size_t bin = 0; bin < of.bins.size(); ++bin) {
      const double below = static_cast<double>(highest - of.bins[bin]) / temperature_;
      if (below > negligible) {
        continue;
      }
      const double weight = std::exp(-below);
      total += weight;
      if (&of == &on &&
          displacement_mm(of.side, of.lattice.T_object_robot(static_cast<std::int64_t>(bin)),
                          best) <= 2.0 * step_mm_) {
        near += weight;
      }
    }
  }
  return near / total;
}

PressPlace PressSearch::best_place(const std::vector<PressSide>& sides,
                                   const Hypothesis& map) const {
  struct Start {
    const SideScores* on;
    Summit<Pose> at;
  };
  std::vector<SideScores> scores;
  scores.reserve(sides.size());
  std::vector<Start> best_at_angles;
  std::size_t places = 0;
  for (const PressSide& side : sides) {
    const PoseLattice lattice = lattice_for(side, map, step_mm_, angles_);
    SideScores& on = scores.emplace_back(
        SideScores{side, !scores.empty(), lattice, PressPlacer(map, contact_, lattice), {}});
    on.bins = on.placer.log_likelihoods(side.evidence);
    places += on.bins.size();
    for (const std::size_t bin : best_bins(on.bins, lattice)) {
      best_at_angles.push_back(
          {&on, {lattice.T_object_robot(static_cast<std::int64_t>(bin)), on.bins[bin]}});
    }
  }
  std::ranges::stable_sort(best_at_angles, std::ranges::greater{},
                           [](const Start& start) { return start.at.value; });

  constexpr std::size_t most_climbs = 2;
  std::vector<Start> starts;
  for (const Start& start : best_at_angles) {
    const bool near_another = std::ranges::any_of(starts, [&](const Start& other) {
      return other.on == start.on &&
             displacement_mm(start.on->side, other.at.place, start.at.place) < 2.0 * step_mm_;
    });
    if (!near_another && starts.size() < most_climbs) {
      starts.push_back(start);
    }
  }
  for (Start& start : starts) {
    const auto value_of = [&](const Pose& pose) {
      return start.on->placer.log_likelihood(start.on->side.evidence, pose);
    };
    start.at.value = value_of(start.at.place);
    start.at = climb_poses(start.at, {glm::dvec2(step_mm_ / 2.0), std::numbers::pi / angles_}, 3,
                           value_of);
  }
  const auto& [on, best] =
      *std::ranges::max_element(starts, {}, [](const Start& start) { return start.at.value; });
  return {.T_object_robot = best.place,
          .mirrored = on->mirrored,
          .gain = best.value - on->placer.log_likelihood(on->side.evidence, beyond),
          .certainty = certainty_of(best.place, *on, scores),
          .log_places = std::log(static_cast<double>(places))};
}

}  // namespace palpate
