#include "learning/cross_validation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "model/bounding_box.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr double additions_per_minute = 1e11;  ///< of one core
/// What a press costs at a bin besides its readings, in readings.
constexpr double readings_per_press = 16.0;
/// A press is tried alone and in groups.
constexpr double times_tried = 1.0 + groups_of_press;
/// A calibration that tries for longer would look broken.
constexpr double most_minutes = 20.0;
/// A core needs 12 B for each bin.
constexpr double most_bins = 5e7;

double bins_of(const PoseLattice& lattice) {
  return 1.0 * lattice.x_mm.count * lattice.y_mm.count * lattice.theta_rad.count;
}

/// Additions to try all presses on a bin.
double additions_per_bin(const LearnedPresses& learned, std::size_t maps) {
  const ContactModel classifier{.classifier = learned.readings.classifier};
  double readings = 0.0;
  for (const Press& press : learned.presses) {
    readings += readings_per_press;
    for (const TouchEvidence& touch : evidence_of(press.touches, classifier)) {
      // All elements are added for No Contact everywhere, and all that read otherwise once more.
      readings += 2.0 * static_cast<double>(touch.readings.size()) -
                  static_cast<double>(std::ranges::count(touch.readings, Reading::no_contact));
    }
  }
  return times_tried * readings * static_cast<double>(maps);
}

void shuffle(std::span<const Press*> presses, Random& random) {
  for (std::size_t i = presses.size(); i > 1; --i) {
    const auto place = static_cast<std::size_t>(random.uniform() * static_cast<double>(i));
    std::swap(presses[i - 1], presses[place]);
  }
}

/// Groups of presses of one object.
std::vector<Press> groups_of(std::span<const Press*> presses, Random& random) {
  std::vector<Press> groups;
  const std::size_t times = presses.size() < 2 * presses_in_group ? 1 : groups_of_press;
  for (std::size_t time = 0; time < times; ++time) {
    shuffle(presses, random);
    for (std::size_t i = 0; i + presses_in_group <= presses.size(); i += presses_in_group) {
      groups.push_back(together(presses.subspan(i, presses_in_group)));
    }
  }
  return groups;
}

}  // namespace

Press as_unknown(const Press& press, const RecognitionBins& bins, Random& random) {
  const PoseLattice& lattice = bins.lattice;
  const auto drawn = [&](const Axis& axis, double here_mm) {
    return bins.auto_pivot ? here_mm + random.uniform(-0.5, 0.5) * axis.step()
                           : random.uniform(axis.lower, axis.upper);
  };
  // One draw per statement: within a statement the compiler chooses the order of evaluation.
  const double x_mm = drawn(lattice.x_mm, press.T_object_robot->translation_mm.x);
  const double y_mm = drawn(lattice.y_mm, press.T_object_robot->translation_mm.y);
  const double theta_rad = random.uniform(lattice.theta_rad.lower, lattice.theta_rad.upper);

  Press unknown = press;
  unknown.T_object_robot = lattice.T_object_robot(x_mm, y_mm, theta_rad);
  const Pose T_drawn_robot = inverse(*unknown.T_object_robot) * *press.T_object_robot;
  for (Touch& touch : unknown.touches) {
    touch.T_robot_sensor = T_drawn_robot * touch.T_robot_sensor;
  }
  return unknown;
}

Press together(std::span<const Press* const> presses) {
  Press all = *presses.front();
  const Pose T_robot_object = inverse(*all.T_object_robot);
  for (const Press* press : presses.subspan(1)) {
    const Pose T_robot_own = T_robot_object * *press->T_object_robot;
    for (Touch touch : press->touches) {
      touch.T_robot_sensor = T_robot_own * touch.T_robot_sensor;
      all.touches.push_back(touch);
    }
  }
  return all;
}

std::vector<Trial> trials_of(const std::vector<Press>& presses,
                             const std::optional<RecognitionBins>& bins, std::size_t fold) {
  std::vector<Trial> trials;
  std::map<std::string, std::vector<const Press*>> of_label;
  for (const Press& press : presses) {
    trials.push_back({press});
    of_label[press.label].push_back(&press);
  }
  if (!bins) {
    return trials;
  }
  Random random(fold, Stream::unknowns);
  std::size_t half = fold % 2;
  for (auto& [label, own] : of_label) {
    // Presses that are too few for two halves are all of one.
    shuffle(own, random);
    const bool divided = own.size() >= 2 * presses_in_group;
    const std::size_t middle = divided ? own.size() / 2 : own.size();
    const std::array parts{std::span(own).first(middle), std::span(own).subspan(middle)};
    for (std::size_t k = 0; k < parts.size(); ++k) {
      for (Press& group : groups_of(parts.at(k), random)) {
        trials.push_back({std::move(group), (half + k) % 2});
      }
    }
    half = 1 - half;
  }
  for (Trial& trial : trials) {
    trial.press = as_unknown(trial.press, *bins, random);
  }
  return trials;
}

PoseLattice fine_lattice(const std::vector<Press>& presses, double spacing_mm) {
  constexpr double finer = 2.0;
  BoundingBox touched;
  for (const Press& press : presses) {
    touched.take_in(press.T_object_robot->translation_mm);
  }
  const double step_mm = spacing_mm / finer;
  const auto axis = [&](double lower, double upper) {
    const double bins = std::ceil((upper - lower) / step_mm) + 2.0;  // one more at either end
    const double half_mm = bins * step_mm / 2.0;
    const double middle_mm = (lower + upper) / 2.0;
    return Axis{middle_mm - half_mm, middle_mm + half_mm, static_cast<int>(bins)};
  };
  constexpr double circle_rad = 2.0 * std::numbers::pi;
  return {.x_mm = axis(touched.lower.x, touched.upper.x),
          .y_mm = axis(touched.lower.y, touched.upper.y),
          .theta_rad = {0.0, circle_rad,
                        static_cast<int>(std::lround(finer * circle_rad / placing_step_rad))}};
}

void require_within(const std::vector<Press>& presses, const PoseLattice& lattice) {
  const auto within = [](const Axis& axis, double place) {
    return place >= axis.lower - axis.step() && place <= axis.upper + axis.step();
  };
  for (const Press& press : presses) {
    const glm::dvec2 centre_mm = press.T_object_robot->translation_mm;
    if (!within(lattice.x_mm, centre_mm.x) || !within(lattice.y_mm, centre_mm.y)) {
      throw Error(
          Fault::input,
          fmt::format(
              "{}: the array's centre is at {:g}, {:g} mm, beyond the bins' {:g}:{:g} and "
              "{:g}:{:g} mm; with an automatic pivot, widen `x-mm` and `y-mm` to all places "
              "that are touched",
              press.name, centre_mm.x, centre_mm.y, lattice.x_mm.lower, lattice.x_mm.upper,
              lattice.y_mm.lower, lattice.y_mm.upper));
    }
  }
}

PoseLattice affordable_lattice(PoseLattice lattice, const LearnedPresses& learned, std::size_t maps,
                               double minutes) {
  const double per_bin = additions_per_bin(learned, maps);
  const double bins = std::min(most_bins, minutes * additions_per_minute / per_bin);
  const double wider = std::cbrt(bins_of(lattice) / bins);
  const auto coarsen = [&](Axis& axis, double widest) {
    const double fewest = std::ceil((axis.upper - axis.lower) / widest);
    const double count = std::max({1.0, fewest, axis.count / wider});
    axis.count = static_cast<int>(std::min<double>(axis.count, count));
  };
  coarsen(lattice.x_mm, learned.readings.spacing_mm);
  coarsen(lattice.y_mm, learned.readings.spacing_mm);
  coarsen(lattice.theta_rad, placing_step_rad);
  if (bins_of(lattice) > std::min(most_bins, most_minutes * additions_per_minute / per_bin)) {
    throw Error(
        Fault::input,
        fmt::format("to try {} touches on bins over {:g} x {:g} mm would take too long; give "
                    "`bins` with the `x-mm` and `y-mm` where an unknown may lie, or fewer "
                    "`frames`",
                    learned.presses.size(), lattice.x_mm.upper - lattice.x_mm.lower,
                    lattice.y_mm.upper - lattice.y_mm.lower));
  }
  return lattice;
}

}  // namespace palpate
