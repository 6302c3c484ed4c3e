#include "pose_window.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "palpate/error.hpp"

namespace palpate::bench {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
// Of the circle, for bodies of full symmetry: few enough for their fixed cost, and narrow enough
// that the body's origin stays near within one.
constexpr int sectors = 8;
// The refined pose takes bins within 2.5 mm of one that may lie a bin or two from the mode.
constexpr double refined_reach_mm = 4.0;

/// Index of the bin that holds a value, which may lie beyond the axis.
int index_of(const Axis& axis, double value) {
  return static_cast<int>(std::floor((value - axis.lower) / axis.step()));
}

/// Indices along an axis, [first, end).
struct Span {
  int first = std::numeric_limits<int>::max();
  int end = std::numeric_limits<int>::min();

  void add(double lower, double upper, const Axis& axis) {
    first = std::min(first, std::clamp(index_of(axis, lower), 0, axis.count - 1));
    end = std::max(end, std::clamp(index_of(axis, upper), 0, axis.count - 1) + 1);
  }
};

Axis part_of(const Axis& axis, const Span& span) {
  const int count = span.end - span.first;
  const double lower = axis.lower + span.first * axis.step();
  return {lower, lower + count * axis.step(), count};
}

/// x and y of the lattice's parameters at which a pose of this theta leaves the body's centroid
/// where it is.
glm::dvec2 place_at(const PoseLattice& lattice, const PlacedBody& placed, double theta_rad) {
  const glm::dvec2 p_robot_mm = inverse(placed.T_object_robot) * placed.body.centroid_mm;
  return placed.body.centroid_mm - rotate(theta_rad, p_robot_mm - lattice.pivot_mm);
}

PoseLattice window_of(const PoseLattice& lattice, const PlacedBody& placed, const Span& thetas,
                      double reach_mm) {
  Span x;
  Span y;
  for (int k = thetas.first; k < thetas.end; ++k) {
    const glm::dvec2 place_mm = place_at(lattice, placed, lattice.theta_rad.centre(k));
    x.add(place_mm.x - reach_mm, place_mm.x + reach_mm, lattice.x_mm);
    y.add(place_mm.y - reach_mm, place_mm.y + reach_mm, lattice.y_mm);
  }
  return {.x_mm = part_of(lattice.x_mm, x),
          .y_mm = part_of(lattice.y_mm, y),
          .theta_rad = part_of(lattice.theta_rad, thetas),
          .pivot_mm = lattice.pivot_mm};
}

RecognitionStep step_in(Device& device, const Hypothesis& letter, const Recording& trial,
                        const PoseLattice& window) {
  const RecognitionTask task({letter}, HistogramOptions{.lattice = window});
  Recogniser recogniser(device, task);
  const RecognitionRecord record = recognise(recogniser, task, unknown_of(trial), false);
  record.require_steps();
  return record.last();
}

/// The letter that a trial is of.
const Hypothesis& letter_of(std::span<const Hypothesis> letters, const Recording& trial) {
  const std::string& label = trial.truth->object;
  const auto letter = std::find_if(letters.begin(), letters.end(), [&](const Hypothesis& known) {
    return known.map.label == label;
  });
  if (letter == letters.end()) {
    throw Error(Fault::input, "'" + label + "' is no learned letter");
  }
  return *letter;
}

}  // namespace

PlacedBody truth_of(std::span<const Hypothesis> letters, const Recording& trial) {
  const OccupancyGrid& map = letter_of(letters, trial).map;
  return {.body = body_of(map),
          .symmetry = map.symmetry,
          .T_object_robot = trial.truth->T_object_robot};
}

std::vector<PoseLattice> windows_about(const PoseLattice& lattice, const PlacedBody& placed,
                                       double reach_mm) {
  const Axis& theta = lattice.theta_rad;
  std::vector<PoseLattice> windows;
  if (placed.symmetry == 0) {
    const int parts = std::min(sectors, theta.count);
    for (int part = 0; part < parts; ++part) {
      const Span thetas{theta.count * part / parts, theta.count * (part + 1) / parts};
      windows.push_back(window_of(lattice, placed, thetas, reach_mm));
    }
    return windows;
  }
  // The error of a turn about the centroid is 2 sqrt(J) sin(turn / 2).
  const double spin_mm = std::sqrt(placed.body.inertia_mm2);
  const double turn_rad = 2.0 * std::asin(std::min(1.0, reach_mm / (2.0 * spin_mm)));
  for (int i = 0; i < placed.symmetry; ++i) {
    const double middle_rad = placed.T_object_robot.theta_rad + i * two_pi / placed.symmetry;
    const int first = index_of(theta, middle_rad - turn_rad);
    const int end = std::min(index_of(theta, middle_rad + turn_rad) + 1, first + theta.count);
    windows.push_back(window_of(lattice, placed, {first, end}, reach_mm));
  }
  return windows;
}

double nearest_bin_mm(const PoseLattice& lattice, const PlacedBody& placed) {
  double least_mm = std::numeric_limits<double>::infinity();
  // At a given theta the error grows with the distance from the place, whatever its direction, so
  // that the nearest bin is that of x and y by themselves.
  for (int k = 0; k < lattice.theta_rad.count; ++k) {
    const double theta_rad = lattice.theta_rad.centre(k);
    const glm::dvec2 place_mm = place_at(lattice, placed, theta_rad);
    Span x;
    Span y;
    x.add(place_mm.x, place_mm.x, lattice.x_mm);
    y.add(place_mm.y, place_mm.y, lattice.y_mm);
    const Pose bin = lattice.T_object_robot(lattice.x_mm.centre(x.first),
                                            lattice.y_mm.centre(y.first), theta_rad);
    least_mm =
        std::min(least_mm, pose_error_mm(placed.body, placed.symmetry, bin, placed.T_object_robot));
  }
  return least_mm;
}

RecognitionStep estimate_in_window(Device& device, std::span<const Hypothesis> letters,
                                   const Recording& trial, const PoseLattice& lattice) {
  const Hypothesis& letter = letter_of(letters, trial);
  const PlacedBody truth = truth_of(letters, trial);
  std::optional<Mode> best;
  for (const PoseLattice& window : windows_about(lattice, truth, window_reach_mm)) {
    const Mode mode = step_in(device, letter, trial, window).mode;
    if (!best || mode.log_likelihood > best->log_likelihood) {
      best = mode;
    }
  }
  // About the mode, so that no edge of a window cuts off what the refined pose is made of.
  const PlacedBody found{.body = truth.body, .symmetry = 1, .T_object_robot = best->T_object_robot};
  return step_in(device, letter, trial, windows_about(lattice, found, refined_reach_mm).front());
}

}  // namespace palpate::bench
