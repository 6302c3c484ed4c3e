#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

#include "learning/press_fusion.hpp"
#include "learning/press_placement.hpp"
#include "model/bounding_box.hpp"
#include "model/contact_readings.hpp"

namespace palpate {

PressSide::PressSide(const Touch& touch, const ContactModel& contact, bool mirrored)
    : evidence_(touch, contact), contact_(evidence_.contact()), touch_(touch) {
  if (mirrored) {
    for (std::vector<glm::dvec2>* elements : {&evidence_.elements_mm, &contact_.elements_mm}) {
      for (glm::dvec2& element : *elements) {
        element.x = -element.x;
      }
    }
    touch_.elements_mm = evidence_.elements_mm;
  }
  const double count = in_contact() ? static_cast<double>(evidence_.contacts) : 1.0;
  glm::dvec2 middle_mm(0.0);
  for (const glm::dvec2& element : contact_.elements_mm) {
    middle_mm += element;
  }
  middle_mm /= count;
  for (const glm::dvec2& element : contact_.elements_mm) {
    const glm::dvec2 from_middle = element - middle_mm;
    reach_mm_ += glm::dot(from_middle, from_middle) / count;
  }
  reach_mm_ = std::sqrt(reach_mm_);
  for (Pose* pose : {&evidence_.T_robot_sensor, &contact_.T_robot_sensor, &touch_.T_robot_sensor}) {
    *pose = {-middle_mm, 0.0};
  }
}

double displacement_mm(const PressSide& press, const Pose& T_object_robot, const Pose& other) {
  const glm::dvec2 d = T_object_robot.translation_mm - other.translation_mm;
  const double turned = 1.0 - std::cos(T_object_robot.theta_rad - other.theta_rad);
  return std::sqrt(glm::dot(d, d) + 2.0 * press.reach_mm() * press.reach_mm() * turned);
}

/// One side of a press on a map, at all bins.
struct PressSearch::SideScores {
  const PressSide& side;
  bool mirrored;
  PoseLattice lattice;
  PressPlacer placer;
  std::vector<float> bins;
};

/// A pose on the way to the best one.
struct PressSearch::Summit {
  const SideScores* of = nullptr;
  Pose T_object_robot;
  double log_likelihood = -std::numeric_limits<double>::infinity();
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
  const double beside_mm = side.reach_mm() / 2.0;
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

PressSearch::PressSearch(const ContactModel& contact, double step_mm, int angles,
                         double temperature)
    : contact_(tabulated(contact)), step_mm_(step_mm), angles_(angles), temperature_(temperature) {}

double PressSearch::gain(std::span<const TouchEvidence> press, const Hypothesis& map,
                         const Pose& T_object_robot) const {
  const PressPlacer placer(map, contact_, {});
  return placer.log_likelihood(press, T_object_robot) - placer.log_likelihood(press, beyond);
}

PressSearch::Summit PressSearch::climb(const Summit& start) const {
  constexpr int halvings = 3;
  const std::span<const TouchEvidence> press = start.of->side.evidence();
  const PressPlacer& placer = start.of->placer;
  double shift_mm = step_mm_ / 2.0;
  double turn_rad = std::numbers::pi / angles_;
  Summit from = start;
  from.log_likelihood = placer.log_likelihood(press, from.T_object_robot);
  for (int halving = 0; halving < halvings;) {
    Summit best = from;
    for (const double sign : {-1.0, 1.0}) {
      for (const Pose& move : {Pose{{sign * shift_mm, 0.0}, 0.0}, Pose{{0.0, sign * shift_mm}, 0.0},
                               Pose{{0.0, 0.0}, sign * turn_rad}}) {
        const Pose moved{from.T_object_robot.translation_mm + move.translation_mm,
                         from.T_object_robot.theta_rad + move.theta_rad};
        if (const double l = placer.log_likelihood(press, moved); l > best.log_likelihood) {
          best.log_likelihood = l;
          best.T_object_robot = moved;
        }
      }
    }
    if (best.log_likelihood > from.log_likelihood) {
      from = best;
    } else {
      shift_mm /= 2.0;
      turn_rad /= 2.0;
      ++halving;
    }
  }
  return from;
}

double PressSearch::certainty_of(const Summit& best, const std::vector<SideScores>& scores) const {
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
      if (&of == best.of &&
          displacement_mm(of.side, of.lattice.T_object_robot(static_cast<std::int64_t>(bin)),
                          best.T_object_robot) <= 2.0 * step_mm_) {
        near += weight;
      }
    }
  }
  return near / total;
}

PressPlace PressSearch::best_place(const std::vector<PressSide>& sides,
                                   const Hypothesis& map) const {
  std::vector<SideScores> scores;
  scores.reserve(sides.size());
  std::vector<Summit> summits;
  std::size_t places = 0;
  for (const PressSide& side : sides) {
    const PoseLattice lattice = lattice_for(side, map, step_mm_, angles_);
    SideScores& of = scores.emplace_back(
        SideScores{side, !scores.empty(), lattice, PressPlacer(map, contact_, lattice), {}});
    of.bins = of.placer.log_likelihoods(side.evidence());
    places += of.bins.size();
    for (const std::size_t bin : best_bins(of.bins, lattice)) {
      summits.push_back(
          {&of, lattice.T_object_robot(static_cast<std::int64_t>(bin)), double{of.bins[bin]}});
    }
  }
  std::ranges::stable_sort(summits, std::ranges::greater{}, &Summit::log_likelihood);

  constexpr std::size_t most_climbs = 2;
  std::vector<Summit> starts;
  for (const Summit& summit : summits) {
    const bool near_another = std::ranges::any_of(starts, [&](const Summit& start) {
      return start.of == summit.of && displacement_mm(summit.of->side, start.T_object_robot,
                                                      summit.T_object_robot) < 2.0 * step_mm_;
    });
    if (!near_another && starts.size() < most_climbs) {
      starts.push_back(summit);
    }
  }
  Summit best;
  for (const Summit& start : starts) {
    const Summit top = climb(start);
    if (top.log_likelihood > best.log_likelihood) {
      best = top;
    }
  }
  return {.T_object_robot = best.T_object_robot,
          .mirrored = best.of->mirrored,
          .gain = best.log_likelihood -
                  best.of->placer.log_likelihood(best.of->side.evidence(), beyond),
          .certainty = certainty_of(best, scores),
          .log_places = std::log(static_cast<double>(places))};
}

}  // namespace palpate
