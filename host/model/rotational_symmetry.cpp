#include "palpate/occupancy_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include <glm/vec2.hpp>

#include "model/refuse.hpp"

namespace palpate {

namespace {

/// The occupied cells of a map, in units of cells.
struct Occupied {
  std::vector<glm::dvec2> samples;  ///< relative to the centroid; all cells, or some thousand
  glm::dvec2 centroid{0.0};
  double cells = 0.0;
  double outline = 0.0;  ///< length
  double radius = 0.0;   ///< of gyration
};

Occupied occupied_cells(const OccupancyGrid& map) {
  constexpr double most_samples = 4096.0;
  require_sound_map(map);
  Occupied occupied;
  std::int64_t crossings = 0;
  const auto is_occupied = [&](int i, int j) {
    return i >= 0 && j >= 0 && i < map.nx && j < map.ny && map.at(i, j) > 0.0F;
  };
  const auto for_each_occupied = [&](int stride, const auto& visit) {
    for (int j = 0; j < map.ny; j += stride) {
      for (int i = 0; i < map.nx; i += stride) {
        if (map.at(i, j) > 0.0F) {
          visit(i, j);
        }
      }
    }
  };
  for_each_occupied(1, [&](int i, int j) {
    occupied.cells += 1.0;
    occupied.centroid += glm::dvec2(i, j);
    for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      crossings += is_occupied(i + di, j + dj) ? 0 : 1;
    }
  });
  if (occupied.cells == 0.0) {
    return occupied;
  }
  occupied.centroid /= occupied.cells;
  // A curve of length L crosses the lines of a unit grid 4 L / pi times on average (Crofton).
  occupied.outline = std::numbers::pi / 4.0 * static_cast<double>(crossings);
  const int stride = static_cast<int>(std::ceil(std::sqrt(occupied.cells / most_samples)));
  double sum = 0.0;
  for_each_occupied(stride, [&](int i, int j) {
    const glm::dvec2 p = glm::dvec2(i, j) - occupied.centroid;
    occupied.samples.push_back(p);
    sum += p.x * p.x + p.y * p.y;
  });
  occupied.radius = std::sqrt(sum / std::max(1.0, static_cast<double>(occupied.samples.size())));
  return occupied;
}

/// Compares a map with its turned self.
class TurnedMap {
 public:
  TurnedMap(const OccupancyGrid& map, const Occupied& occupied)
      : occupied_(occupied),
        nx_(static_cast<std::size_t>(map.nx)),
        ny_(static_cast<std::size_t>(map.ny)),
        log_odds_(map.log_odds) {
    constexpr float clip = 4.0F;  // a cell that is very sure must not drown its neighbours
    constexpr double not_sensed = 1e-3;
    const double prior = map.prior_log_odds();
    for (float& l : log_odds_) {
      l = std::abs(l - prior) < not_sensed ? std::numeric_limits<float>::quiet_NaN()
                                           : std::clamp(l, -clip, clip);
    }
  }

  /// Largest share of the object that falls on itself, over shifts of the centre.
  double likeness(double turn_rad) const {
    constexpr double finest = 0.2;  // cells
    glm::dvec2 shift{0.0};
    double best = likeness(turn_rad, shift);
    for (double step = std::max(1.0, occupied_.radius / 8.0); step > finest; step /= 2.0) {
      for (bool moved = true; moved;) {
        moved = false;
        for (const glm::dvec2 change : {glm::dvec2{step, 0.0}, glm::dvec2{-step, 0.0},
                                        glm::dvec2{0.0, step}, glm::dvec2{0.0, -step}}) {
          const double changed = likeness(turn_rad, shift + change);
          // Rounding must not make the search go round in circles.
          if (changed > best + 1e-9) {
            best = changed;
            shift += change;
            moved = true;
            break;
          }
        }
      }
    }
    return best;
  }

 private:
  double likeness(double turn_rad, const glm::dvec2& shift) const {
    constexpr double least_seen = 0.75;
    const double c = std::cos(turn_rad);
    const double s = std::sin(turn_rad);
    const glm::dvec2 centre = occupied_.centroid + shift;
    double sum = 0.0;
    std::int64_t seen = 0;
    for (const glm::dvec2& p : occupied_.samples) {
      const double share = occupancy(centre + glm::dvec2(c * p.x - s * p.y, s * p.x + c * p.y));
      if (!std::isnan(share)) {
        sum += share;
        ++seen;
      }
    }
    const auto all = static_cast<double>(occupied_.samples.size());
    return static_cast<double>(seen) < least_seen * all ? 0.0 : sum / static_cast<double>(seen);
  }

  /// How far a place, in cells, can be occupied: 1 where its log odds are at least 0, falling to 0
  /// at -2 nats, since an edge is never exact. NaN where the map was not seen.
  double occupancy(const glm::dvec2& place) const {
    constexpr double unlikely = -2.0;
    const double i = std::floor(place.x);
    const double j = std::floor(place.y);
    if (!(i >= 0.0 && j >= 0.0 && i + 1.0 < nx_ && j + 1.0 < ny_)) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    const double u = place.x - i;
    const double v = place.y - j;
    const float* at = &log_odds_[static_cast<std::size_t>(j) * nx_ + static_cast<std::size_t>(i)];
    const double l =
        (1.0 - v) * ((1.0 - u) * at[0] + u * at[1]) + v * ((1.0 - u) * at[nx_] + u * at[nx_ + 1]);
    return std::clamp(1.0 - l / unlikely, 0.0, 1.0);  // of NaN is NaN
  }

  const Occupied& occupied_;
  std::size_t nx_;
  std::size_t ny_;
  std::vector<float> log_odds_;  ///< [ny, nx], clipped; NaN: not seen
};

constexpr double circle_rad = 2.0 * std::numbers::pi;
constexpr double least_cells = 16.0;

double tolerance_mm(const OccupancyGrid& map) {
  // Among 47 simulated shapes, symmetric ones stay below 0.45 of the detail, others above 0.65.
  constexpr double of_detail = 0.5;
  // Interpolation finds an edge within half a cell.
  return of_detail * (map.spread_mm ? std::max(*map.spread_mm, map.cell_mm / 2.0) : map.cell_mm);
}

/// Mean distance between outlines of which so large a share of the object falls on itself.
double apart_mm(double likeness, const Occupied& occupied, const OccupancyGrid& map) {
  // One half of the outline loses this area, the other half gains it.
  const double lost = (1.0 - likeness) * occupied.cells;
  return 2.0 * lost / occupied.outline * map.cell_mm;
}

}  // namespace

int RotationalSymmetry::nearest() const {
  return static_cast<int>(std::min_element(apart_mm.begin() + 2, apart_mm.end()) -
                          apart_mm.begin());
}

std::optional<RotationalSymmetry> measure_symmetry(const OccupancyGrid& map) {
  constexpr int angles = 8;  // over half a circle, as a turn by -a likens like one by a
  const Occupied occupied = occupied_cells(map);
  if (occupied.cells < least_cells) {
    return {};
  }
  const TurnedMap turned(map, occupied);
  const auto apart = [&](double turn_rad) {
    return apart_mm(turned.likeness(turn_rad), occupied, map);
  };
  RotationalSymmetry symmetry{.apart_mm = {}, .tolerance_mm = tolerance_mm(map)};
  const auto largest_fold = static_cast<int>(symmetry.apart_mm.size()) - 1;
  for (int n = 2; n <= largest_fold; ++n) {
    for (int k = 1; 2 * k <= n; ++k) {
      symmetry.apart_mm[n] = std::max(symmetry.apart_mm[n], apart(circle_rad * k / n));
    }
    symmetry.suggested = symmetry.apart_mm[n] <= symmetry.tolerance_mm ? n : symmetry.suggested;
  }
  for (int k = 0; k < angles; ++k) {
    const double turn_rad = circle_rad * (k + 0.5) / (2 * angles + 1);
    symmetry.apart_mm[0] = std::max(symmetry.apart_mm[0], apart(turn_rad));
  }
  if (symmetry.apart_mm[0] <= symmetry.tolerance_mm) {
    symmetry.suggested = 0;
  }
  return symmetry;
}

std::optional<MirrorSymmetry> measure_mirror_symmetry(const OccupancyGrid& map) {
  constexpr int angles = 36;
  constexpr double finest_rad = 0.005;
  Occupied mirrored = occupied_cells(map);
  if (mirrored.cells < least_cells) {
    return {};
  }
  for (glm::dvec2& p : mirrored.samples) {
    p.x = -p.x;
  }
  const TurnedMap turned(map, mirrored);
  double best_rad = 0.0;
  double best = 0.0;
  const auto look_at = [&](double turn_rad) {
    if (const double likeness = turned.likeness(turn_rad); likeness > best) {
      best = likeness;
      best_rad = turn_rad;
    }
  };
  for (int k = 0; k < angles; ++k) {
    look_at(circle_rad * k / angles);
  }
  for (double step = circle_rad / angles / 2.0; step > finest_rad; step /= 2.0) {
    const double middle = best_rad;
    look_at(middle - step);
    look_at(middle + step);
  }
  return MirrorSymmetry{apart_mm(best, mirrored, map), tolerance_mm(map)};
}

}  // namespace palpate
