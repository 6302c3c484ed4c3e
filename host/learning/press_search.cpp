#include "press_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <tbb/parallel_for.h>

#include <glm/common.hpp>

#include "interpolated_map.hpp"
#include "turned_map.hpp"

namespace palpate {

/// The gains of one side of one press at one angle: [ny, nx] translations.
struct PressSearch::Scores {
  std::size_t press = 0;
  std::size_t side = 0;
  int angle = 0;
  int x = 0;  ///< the first translation, in steps
  int y = 0;
  int nx = 0;
  int ny = 0;
  std::vector<float> gains;

  /// The pose at (i, j), given the press's side and the lattice's step.
  Pose pose(const PressReadings& readings, double step_mm, double theta_rad, int i, int j) const {
    const glm::dvec2 shift = step_mm * glm::dvec2(x + i, y + j) - readings.first_mm;
    return {rotate(theta_rad, shift), theta_rad};
  }
};

/// A pose on the way to the best one.
struct PressSearch::Found {
  std::size_t side = 0;
  Pose T_object_sensor;
  double gain = 0.0;
};

namespace {

/// The centres of the map's occupied cells.
std::vector<glm::dvec2> occupied_places(const OccupancyGrid& map) {
  std::vector<glm::dvec2> places;
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      if (map.at(i, j) > 0.0F) {
        places.push_back(map.centre_mm(i, j));
      }
    }
  }
  return places;
}

}  // namespace

PressSearch::PressSearch(ReadingGains gains, double step_mm, int angles, double temperature)
    : gains_(std::move(gains)), step_mm_(step_mm), angles_(angles), temperature_(temperature) {}

double PressSearch::theta(int angle) const { return 2.0 * std::numbers::pi * angle / angles_; }

double PressSearch::gain(const PressReadings& press, const OccupancyGrid& compared,
                         const Pose& T_object_sensor, Elements of) const {
  const InterpolatedMap place(compared, compared.prior);
  const glm::dvec2 along = rotate(T_object_sensor.theta_rad, {1.0, 0.0});
  const glm::dvec2 across(-along.y, along.x);
  double sum = 0.0;
  for (std::size_t e = 0; e < press.elements_mm.size(); ++e) {
    if (of == Elements::in_contact && !is_contact(static_cast<Reading>(press.levels[e]))) {
      continue;
    }
    const glm::dvec2& p = press.elements_mm[e];
    const double value =
        place.log_odds(T_object_sensor.translation_mm + p.x * along + p.y * across);
    sum += static_cast<double>(gains_.at(press.levels[e], value));
  }
  return sum;
}

std::vector<PressSearch::Scores> PressSearch::scores_at(
    int angle, std::span<const SearchedPress* const> presses, const SearchedMap& map) const {
  const double theta_rad = theta(angle);
  BoundingBox box;
  for (const glm::dvec2& p : occupied_places(map.map)) {
    box.take_in(rotate(-theta_rad, p));
  }
  std::vector<Scores> all;
  if (box.empty()) {
    return all;
  }
  int reach = 0;
  for (std::size_t p = 0; p < presses.size(); ++p) {
    for (std::size_t side = 0; side < presses[p]->sides.size(); ++side) {
      const PressReadings& press = presses[p]->sides[side];
      if (press.contacts == 0) {
        continue;
      }
      const glm::dvec2 beside = 0.25 * press.contact_box.extent();
      const glm::dvec2 middle = press.centre_mm - press.first_mm;
      const glm::dvec2 from = glm::ceil((box.lower - beside - middle) / step_mm_);
      const glm::dvec2 to = glm::max(from, glm::floor((box.upper + beside - middle) / step_mm_));
      Scores scores{.press = p,
                    .side = side,
                    .angle = angle,
                    .x = static_cast<int>(from.x),
                    .y = static_cast<int>(from.y),
                    .nx = static_cast<int>(to.x - from.x) + 1,
                    .ny = static_cast<int>(to.y - from.y) + 1,
                    .gains = {}};
      // From the middle of the contact, which stays in the box, to the farthest element.
      reach = std::max(reach, static_cast<int>(std::ceil(1.25 * press.nodes.extent().x)) + 3);
      scores.gains.assign(static_cast<std::size_t>(scores.nx) * scores.ny, 0.0F);
      all.push_back(std::move(scores));
    }
  }
  const TurnedMap turned(map.compared, gains_, step_mm_, theta_rad, reach);
  for (Scores& scores : all) {
    for (const ReadingRun& run : presses[scores.press]->sides[scores.side].runs) {
      // Columns beyond those of the turned map add nothing.
      const int first = run.x + scores.x - turned.first_column();
      const int skipped = std::max(0, -first);
      const int fitting = turned.last_column() - turned.first_column() - first - run.length + 1;
      const int end = std::min(scores.nx, fitting);
      for (int j = std::max(0, turned.first_row() - run.y - scores.y);
           j < std::min(scores.ny, turned.last_row() - run.y - scores.y + 1); ++j) {
        const float* sums = turned.row(run.level, run.y + scores.y + j);
        float* gains = scores.gains.data() + static_cast<std::size_t>(j) * scores.nx;
        for (int i = skipped; i < end; ++i) {
          gains[i] += sums[first + run.length + i] - sums[first + i];
        }
      }
    }
  }
  return all;
}

PressSearch::Found PressSearch::climb(const PressReadings& press, const OccupancyGrid& compared,
                                      Found from) const {
  constexpr int halvings = 4;
  double shift_mm = step_mm_ / 2.0;
  double turn_rad = std::numbers::pi / angles_;
  for (int halving = 0; halving < halvings;) {
    Found best = from;
    const Pose& pose = from.T_object_sensor;
    const glm::dvec2 middle = pose * press.centre_mm;
    const auto attempt = [&](const glm::dvec2& shift, double turn) {
      // Turns about the middle of the contact.
      Pose moved{{0.0, 0.0}, pose.theta_rad + turn};
      moved.translation_mm = middle + shift - moved * press.centre_mm;
      if (const double g = gain(press, compared, moved); g > best.gain) {
        best.gain = g;
        best.T_object_sensor = moved;
      }
    };
    for (const double sign : {-1.0, 1.0}) {
      attempt({sign * shift_mm, 0.0}, 0.0);
      attempt({0.0, sign * shift_mm}, 0.0);
      attempt({0.0, 0.0}, sign * turn_rad);
    }
    if (best.gain > from.gain) {
      from = best;
    } else {
      shift_mm /= 2.0;
      turn_rad /= 2.0;
      ++halving;
    }
  }
  return from;
}

PressPlace PressSearch::best_of(const SearchedPress& press, std::span<const Scores> scores,
                                const SearchedMap& map) const {
  PressPlace place;
  // The best translation of each side at each angle, best first.
  std::vector<Found> summits;
  std::size_t places = 0;
  for (const Scores& at : scores) {
    const auto best = std::ranges::max_element(at.gains);
    const int index = static_cast<int>(best - at.gains.begin());
    summits.push_back(
        {at.side,
         at.pose(press.sides[at.side], step_mm_, theta(at.angle), index % at.nx, index / at.nx),
         double{*best}});
    places += at.gains.size();
  }
  if (summits.empty()) {
    return place;
  }
  std::ranges::stable_sort(summits, std::ranges::greater{}, &Found::gain);
  const Found highest = summits.front();

  constexpr std::size_t most_climbs = 4;
  std::vector<Found> starts;
  for (const Found& summit : summits) {
    const bool near_another = std::ranges::any_of(starts, [&](const Found& start) {
      return start.side == summit.side &&
             displacement_mm(press.sides[summit.side], start.T_object_sensor,
                             summit.T_object_sensor) < 2.0 * step_mm_;
    });
    if (!near_another && starts.size() < most_climbs) {
      starts.push_back(summit);
    }
  }
  Found best{.side = 0, .T_object_sensor = {}, .gain = -std::numeric_limits<double>::infinity()};
  for (Found start : starts) {
    const PressReadings& side = press.sides[start.side];
    start.gain = gain(side, map.compared, start.T_object_sensor);
    const Found top = climb(side, map.compared, start);
    if (top.gain > best.gain) {
      best = top;
    }
  }

  constexpr double negligible = 20.0;  // e^-20: a million such places weigh 2e-3
  double near = 0.0;
  double total = 0.0;
  for (const Scores& at : scores) {
    const PressReadings& side = press.sides[at.side];
    for (int j = 0; j < at.ny; ++j) {
      for (int i = 0; i < at.nx; ++i) {
        const auto index = static_cast<std::size_t>(j) * at.nx + static_cast<std::size_t>(i);
        const double below = (highest.gain - double{at.gains[index]}) / temperature_;
        if (below > negligible) {
          continue;
        }
        const double weight = std::exp(-below);
        total += weight;
        const Pose pose = at.pose(side, step_mm_, theta(at.angle), i, j);
        if (at.side == best.side &&
            displacement_mm(side, pose, best.T_object_sensor) <= 2.0 * step_mm_) {
          near += weight;
        }
      }
    }
  }
  place.T_object_sensor = best.T_object_sensor;
  place.mirrored = best.side == 1;
  place.gain = best.gain;
  place.certainty = near / total;
  place.log_places = std::log(static_cast<double>(places));
  return place;
}

std::vector<PressPlace> PressSearch::best_places(std::span<const SearchedPress* const> presses,
                                                 const SearchedMap& map) const {
  // Presses at a time: bounds the memory of their scores.
  constexpr std::size_t batch = 32;
  std::vector<PressPlace> places(presses.size());
  for (std::size_t begin = 0; begin < presses.size(); begin += batch) {
    const auto part = presses.subspan(begin, std::min(batch, presses.size() - begin));
    std::vector<std::vector<Scores>> by_angle(static_cast<std::size_t>(angles_));
    tbb::parallel_for(0, angles_, [&](int angle) {
      by_angle[static_cast<std::size_t>(angle)] = scores_at(angle, part, map);
    });
    tbb::parallel_for(std::size_t{0}, part.size(), [&](std::size_t p) {
      std::vector<Scores> own;
      for (std::vector<Scores>& at : by_angle) {
        for (Scores& scores : at) {
          if (scores.press == p) {
            own.push_back(std::move(scores));
          }
        }
      }
      places[begin + p] = best_of(*part[p], own, map);
    });
  }
  return places;
}

}  // namespace palpate
