#include "recognition/warnings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/matrix.hpp>

#include "palpate/pose_error.hpp"

namespace palpate {

namespace {

using Place = std::array<double, 3>;  ///< (x_mm, y_mm, theta_rad) of a lattice

constexpr double degrees_per_rad = 180.0 / std::numbers::pi;

std::array<const Axis*, 3> axes_of(const PoseLattice& lattice) {
  return {&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad};
}

/// A refined pose on the lattice. Theta has the turn that is nearest to the region's middle.
Place place_of(const RefinedPose& refined, const PoseLattice& lattice) {
  const glm::dvec2 xy_mm = refined.T_object_robot * lattice.pivot_mm;
  const double middle_rad = (lattice.theta_rad.lower + lattice.theta_rad.upper) / 2.0;
  return {xy_mm.x, xy_mm.y,
          middle_rad +
              wrap_angle(refined.T_object_robot.theta_rad - middle_rad, 2.0 * std::numbers::pi)};
}

/// Variances of the place. The covariance is of T_object_robot, whose translation is
/// (x, y) - R(theta) pivot.
Place variances_of(const RefinedPose& refined, const PoseLattice& lattice) {
  const glm::dvec2 slope =
      rotate(refined.T_object_robot.theta_rad + std::numbers::pi / 2.0, lattice.pivot_mm);
  const std::array<double, 9>& c = refined.covariance;
  const auto variance = [&](int i) {
    return c[4 * i] + 2.0 * slope[i] * c[3 * i + 2] + slope[i] * slope[i] * c[8];
  };
  return {variance(0), variance(1), c[8]};
}

/// Whether enough elements were in contact to tell one place from another. After fewer, the best
/// pose lies anywhere in the region, its edges included.
bool felt_enough(std::span<const TouchEvidence> touches) {
  constexpr std::size_t enough = 24;  // two to three touches of a letter by the 6 x 6 array
  std::size_t contacts = 0;
  for (const TouchEvidence& touch : touches) {
    contacts += touch.contacts;
  }
  return contacts >= enough;
}

/// The refined pose's standard deviations are those of a bin, since the bins are too wide for the
/// refinement.
std::optional<std::string> coarse_bins(const RecognitionTask& task, const PoseLattice& lattice,
                                       const RecognitionStep& step) {
  // docs/refinement.md: the refinement needs 20 bins within 2.5 mm, and steps up to about 1.5 mm.
  constexpr double widest_bin_mm3 = 4.0 / 3.0 * std::numbers::pi * 2.5 * 2.5 * 2.5 / 20.0;
  constexpr double widest_step_mm = 1.5;
  constexpr double own_share = 1.1;  // the belief adds less than a tenth to the bin's variance
  const std::optional<Body>& body = task.bodies[step.mode.object];
  if (!step.refined || !body) {
    return {};
  }
  const Place variances = variances_of(*step.refined, lattice);
  // How far the object moves, root mean square, where the pose moves by 1 mm or 1 rad.
  const Place lever_mm{1.0, 1.0, std::sqrt(body->inertia_mm2)};
  constexpr std::array names{"x", "y", "theta"};
  std::vector<std::string> coarse;
  std::array<int, 3> counts{};
  double bin_mm3 = 1.0;
  for (int i = 0; i < 3; ++i) {
    const Axis& axis = *axes_of(lattice)[i];
    const double step_mm = axis.step() * lever_mm[i];
    counts[i] = axis.count;
    if (axis.count == 1) {
      continue;
    }
    bin_mm3 *= step_mm;
    const double bins_own = axis.step() * axis.step() / 12.0;
    if (step_mm > widest_step_mm && variances[i] < own_share * bins_own) {
      coarse.push_back(i < 2 ? fmt::format("{} in bins of {:.3g} mm", names[i], axis.step())
                             : fmt::format("{} in bins of {:.3g} degrees, which turn the object by "
                                           "{:.2g} mm",
                                           names[i], axis.step() * degrees_per_rad, step_mm));
      counts[i] = static_cast<int>(std::ceil(axis.count * step_mm / 1.0));
    }
  }
  if (coarse.empty() || bin_mm3 < widest_bin_mm3) {
    return {};
  }
  return fmt::format(
      "the pose's standard deviation is only the width of a bin: {}; give `bins {}x{}x{}` or more, "
      "or `bins auto`",
      fmt::join(coarse, ", "), counts[0], counts[1], counts[2]);
}

/// The best pose lies at an end of an axis.
std::optional<std::string> at_the_edge(std::span<const TouchEvidence> touches,
                                       const RecognitionTask& task, const PoseLattice& lattice,
                                       const RecognitionStep& step) {
  if (!step.refined || !step.mode.bin) {
    return {};
  }
  const std::int64_t in_plane = *step.mode.bin % lattice.plane();
  const std::array<std::int64_t, 3> index{in_plane % lattice.x_mm.count,
                                          in_plane / lattice.x_mm.count,
                                          *step.mode.bin / lattice.plane()};
  const Place place = place_of(*step.refined, lattice);
  const Place variances = variances_of(*step.refined, lattice);
  constexpr std::array names{"x", "y", "theta"};
  constexpr std::array options{"x-mm", "y-mm", "theta-deg"};
  for (int i = 0; i < 3; ++i) {
    const Axis& axis = *axes_of(lattice)[i];
    if (axis.count < 3 || (i == 2 && lattice.full_circle())) {
      continue;
    }
    const bool first = index[i] == 0;
    if (!first && index[i] != axis.count - 1) {
      continue;
    }
    // Between the bins the pose may lie well inside, as that of an object within the region does.
    const double inside = first ? place[i] - axis.lower : axis.upper - place[i];
    if (inside > std::max(axis.step(), std::sqrt(variances[i])) || !felt_enough(touches)) {
      continue;
    }
    const double unit = i < 2 ? 1.0 : degrees_per_rad;
    const double more = (axis.upper - axis.lower) / 2.0;
    const std::string remedy =
        task.auto_pivot
            ? "the region surrounds the first touch in contact; begin with a touch of the object"
            : fmt::format("widen the region, such as with `{}={:.4g}:{:.4g}`", options[i],
                          (axis.lower - (first ? more : 0.0)) * unit,
                          (axis.upper + (first ? 0.0 : more)) * unit);
    return fmt::format(
        "the best pose lies at the edge of the region, {} = {:.4g} {} of {:.4g} to {:.4g}: the "
        "object may lie outside; {}",
        names[i], place[i] * unit, i < 2 ? "mm" : "degrees", axis.lower * unit, axis.upper * unit,
        remedy);
  }
  return {};
}

/// The belief has no peak about the pose.
std::optional<std::string> pose_untold(std::span<const TouchEvidence> touches,
                                       const RecognitionStep& step) {
  if (step.places.peak) {
    return {};
  }
  return std::ranges::any_of(touches, &TouchEvidence::in_contact)
             ? "the touches do not tell the pose: the belief has no peak about it"
             : "the touches do not tell the pose: no touch has an element In Contact";
}

/// Share of an object's belief at angles that are nearer to another of its n likenesses than to
/// its own, where all angles look alike (n = 0) at those more than 1/16 of a turn away.
/// @param shares [theta]
double share_at_other_turns(const Axis& theta, std::span<const double> shares, double own_rad,
                            int n) {
  const double own_half_rad = std::numbers::pi / (n == 0 ? 8 : n);
  double all = 0.0;
  double other = 0.0;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    const double theta_rad = theta.centre(static_cast<int>(k));
    all += shares[k];
    if (std::abs(wrap_angle(theta_rad - own_rad, 2.0 * std::numbers::pi)) > own_half_rad) {
      other += shares[k];
    }
  }
  return all > 0.0 ? other / all : 0.0;
}

/// Whether the map looks the same after turns that it does not call equal.
bool may_look_alike(const OccupancyGrid& map) {
  return map.symmetry == 1 && map.suggested_symmetry.value_or(1) != 1;
}

}  // namespace

std::vector<std::size_t> unlike_touches(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const RecognitionStep& step) {
  constexpr double unlike_z = -8.0;
  constexpr double others_from_z = -5.0;
  // A stranger's few touches may agree by chance.
  const std::size_t least_others = task.labels[step.best] == none_label ? 7 : 3;
  std::vector<std::size_t> unlike;
  std::size_t others = 0;
  for (std::size_t i = 0; i < step.touch_fit.size(); ++i) {
    const std::optional<double>& z = step.touch_fit[i];
    if (z && *z < unlike_z) {
      unlike.push_back(i);
    } else if (z && *z < others_from_z) {
      return {};  // where many fit badly, none stands out
    } else if (z && touches[i].in_contact()) {
      ++others;
    }
  }
  return others < std::max(least_others, 2 * unlike.size()) ? std::vector<std::size_t>() : unlike;
}

std::string unlike_words(std::span<const std::size_t> unlike, const RecognitionTask& task,
                         const RecognitionStep& step) {
  double lowest_z = 0.0;
  std::vector<std::size_t> numbers;
  for (const std::size_t touch : unlike) {
    lowest_z = std::min(lowest_z, *step.touch_fit[touch]);
    numbers.push_back(touch + 1);
  }
  const std::string name = task.name_of(step.mode.object);
  const bool one = unlike.size() == 1;
  const bool last = unlike.front() + unlike.size() == step.touch_fit.size();
  return fmt::format(
      "touch{} {} fit{} {} {:.0f} standard deviations worse than touches of {} do, while the "
      "others "
      "fit: {}",
      one ? "" : "es", fmt::join(numbers, ", "), one ? "s" : "", name, -lowest_z, name,
      last  ? "did the object move, or does the array touch something else?"
      : one ? "leave it out, or look at its pose"
            : "leave them out, or look at their poses");
}

std::vector<std::string> warnings_about(std::span<const TouchEvidence> touches,
                                        const RecognitionTask& task, const PoseLattice& lattice,
                                        const RecognitionStep& step) {
  std::vector<std::string> warnings;
  const auto add = [&](std::optional<std::string> warning) {
    if (warning) {
      warnings.push_back(*std::move(warning));
    }
  };
  add(positions_in_metres(touches));
  add(other_scale(touches, task));
  add(nothing_felt(touches, task.classifier().threshold));
  add(out_of_reach(touches, task, lattice));
  if (warnings.empty()) {
    add(pose_untold(touches, step));
  }
  const std::optional<std::string> degrees = angles_in_degrees(touches);
  // Touches at wrong angles do not fit; where the touches fit, the estimate deserves its warnings.
  const bool fits = step.fit && step.fit->verdict == Verdict::fits;
  const bool estimate_counts = warnings.empty() && (!degrees || fits);
  add(degrees);
  // An estimate from such touches is not worth a word. On bins that are too coarse, the edge is no
  // sign of an object outside.
  if (estimate_counts) {
    const std::optional<std::string> coarse = coarse_bins(task, lattice, step);
    add(coarse ? coarse : at_the_edge(touches, task, lattice, step));
  }
  return warnings;
}

int symmetry_told(const OccupancyGrid& map, const Axis& theta, std::span<const double> shares,
                  double own_rad, double temperature) {
  constexpr double least_share = 0.05;
  if (!may_look_alike(map)) {
    return map.symmetry;
  }
  const double other = share_at_other_turns(theta, shares, own_rad, *map.suggested_symmetry);
  // Turns weigh as other poses do.
  const double odds = std::pow(other / (1.0 - other), 1.0 / temperature);
  return odds < least_share / (1.0 - least_share) ? map.symmetry : *map.suggested_symmetry;
}

int symmetry_told(const Recogniser& recogniser, const RecognitionTask& task,
                  const RecognitionStep& step) {
  const OccupancyGrid& map = task.hypotheses[step.mode.object].map;
  if (!may_look_alike(map)) {
    return map.symmetry;  // the marginals are not asked for
  }
  const Marginals marginals = recogniser.marginals(step.mode.object);
  return symmetry_told(map, marginals.grid.theta_rad, marginals.theta,
                       step.mode.T_object_robot.theta_rad,
                       task.temperature_after(recogniser.evidence()));
}

std::optional<std::string> turned_alike(const RecognitionTask& task, const RecognitionStep& step) {
  constexpr double least_error_mm = 1.0;
  const OccupancyGrid& map = task.hypotheses[step.mode.object].map;
  const int n = map.suggested_symmetry.value_or(1);
  if (map.symmetry != 1 || n == 1) {
    return {};
  }
  const std::string alike =
      fmt::format("{} looks the same after {}", map.label,
                  n == 0 ? "any turn" : fmt::format("every 1/{} of a turn", n));
  if (step.symmetry == n) {
    return fmt::format(
        "{}, and the touches do not tell such turns apart: they count as equal; build its map with "
        "`symmetry {}` where they always are, with `symmetry 1` where they never are",
        alike, n);
  }
  const std::optional<double> error_mm = step.pose_error_mm();
  if (!error_mm) {
    return {};
  }
  const double ignored_mm =
      pose_error_mm(step.body.value(), n, step.pose(), *step.truth.T_object_robot);
  return *error_mm - ignored_mm > least_error_mm
             ? std::optional(
                   fmt::format("{}, and the pose error of {:.2f} mm is {:.2f} mm where "
                               "such turns do not count; build its map with `symmetry {}`",
                               alike, *error_mm, ignored_mm, n))
             : std::nullopt;
}

}  // namespace palpate
