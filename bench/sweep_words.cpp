#include "sweep_words.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace palpate::bench {

namespace {

std::string bins_text(std::int64_t count) { return count_text(static_cast<double>(count)); }

std::string knee_text(const std::optional<std::int64_t>& knee) {
  return knee ? fmt::format("suffice from {} bins on", bins_text(*knee))
              : "still gain at the finest lattice";
}

/// "0.316 to 0.238 mm by the mode (-25 %, -0.078 +- 0.012 mm)".
std::string step_text(const SweepPoint& from, const SweepPoint& to, PoseKind kind) {
  const PairedErrors paired = paired_errors(from.errors, to.errors, kind);
  const double more_mm = paired.second_mm - paired.first_mm;
  return fmt::format("{:.3f} to {:.3f} mm {} ({:+.0f} %, {:+.3f} ± {:.3f} mm)", paired.first_mm,
                     paired.second_mm, kind == PoseKind::mode ? "by the mode" : "refined",
                     paired.first_mm > 0.0 ? 100.0 * more_mm / paired.first_mm : 0.0, more_mm,
                     paired.standard_error_mm);
}

std::string step_text(const SweepPoint& from, const SweepPoint& to) {
  const int trials = paired_errors(from.errors, to.errors, PoseKind::mode).trials;
  return fmt::format("From {} to {} bins: {}, {}, {} trials.", bins_text(from.count),
                     bins_text(to.count), step_text(from, to, PoseKind::mode),
                     step_text(from, to, PoseKind::refined), trials);
}

}  // namespace

std::string count_text(double count) {
  return count >= 0.9995e6   ? fmt::format("{:.3g} M", count / 1e6)
         : count >= 0.9995e3 ? fmt::format("{:.3g} k", count / 1e3)
                             : fmt::format("{:.3g}", count);
}

std::string seconds_text(double seconds) {
  return seconds >= 0.9995      ? fmt::format("{:.3g} s", seconds)
         : seconds >= 0.9995e-3 ? fmt::format("{:.3g} ms", 1e3 * seconds)
                                : fmt::format("{:.3g} us", 1e6 * seconds);
}

std::string mean_text(const std::optional<ErrorsOverTrials>& errors) {
  return errors ? fmt::format("{:.3f} ± {:.3f}", errors->mean_mm, errors->standard_error_mm) : "–";
}

std::string knee_sentence(const CellFinding& finding, const std::vector<SweepPoint>& runs) {
  std::string text = fmt::format("Cells of {} mm: modes {}, refined poses {}.", finding.cell_mm,
                                 knee_text(finding.mode_knee), knee_text(finding.refined_knee));
  if (finding.floor) {
    text += fmt::format(" On the finest lattice the refined pose errs by {} mm, {} trials.",
                        mean_text(finding.floor), finding.floor->trials);
  }
  text += fmt::format(" --bins auto takes {} x {} x {} = {}", finding.balanced_bins[0],
                      finding.balanced_bins[1], finding.balanced_bins[2],
                      bins_text(finding.balanced_count));
  // The run nearest to what auto takes, as a factor, and those next to a decade away.
  const auto distance = [&](const SweepPoint& run, double factor) {
    return std::abs(std::log(static_cast<double>(run.count) /
                             (factor * static_cast<double>(finding.balanced_count))));
  };
  const auto nearest = [&](double factor) {
    return std::min_element(runs.begin(), runs.end(), [&](const auto& a, const auto& b) {
      return distance(a, factor) < distance(b, factor);
    });
  };
  const auto balanced = nearest(1.0);
  constexpr double close = 0.7;  // a factor of two
  if (distance(*balanced, 1.0) > close) {
    return text + ", which is beyond this sweep.";
  }
  text += ".";
  if (const auto before = nearest(0.1); before != balanced) {
    text += " " + step_text(*before, *balanced);
  }
  if (const auto after = nearest(10.0); after != balanced) {
    text += " " + step_text(*balanced, *after);
  }
  return text;
}

std::string window_sentence(const SweepResult& result) {
  WindowCheck all;
  int full_trials = 0;
  double recognised = 0.0;
  double least_confidence = 1.0;
  for (const SweepPoint& point : result.points) {
    if (point.window) {
      all.trials += point.window->trials;
      all.mode_mm = std::max(all.mode_mm, point.window->mode_mm);
      all.refined_mm = std::max(all.refined_mm, point.window->refined_mm);
      full_trials += point.full_trials;
      recognised += point.accuracy * point.full_trials;
      least_confidence = std::min(least_confidence, point.least_confidence);
    }
  }
  if (full_trials == 0) {
    return {};
  }
  return fmt::format(
      "Windows: of {} trials with the full posterior on the same lattices, {:.0f} are recognised; "
      "what is most probable has a probability of {:.6f} or more. Their modes are those of the "
      "windows within {:.1e} mm, their refined poses within {:.1e} mm ({} trials).",
      full_trials, recognised, least_confidence, all.mode_mm, all.refined_mm, all.trials);
}

std::string difference_text(const SweepResult& result, const Limit& limit, PoseKind kind) {
  if (!limit.against) {
    return "–";
  }
  const PairedErrors paired =
      paired_errors(limit.errors, result.limits[*limit.against].errors, kind);
  return fmt::format("{:+.3f} ± {:.3f}", paired.first_mm - paired.second_mm,
                     paired.standard_error_mm);
}

std::string against_text(const SweepResult& result, const Limit& limit) {
  if (!limit.against) {
    return "–";
  }
  const Limit& other = result.limits[*limit.against];
  return other.name == limit.name ? bins_text(other.count) + " bins" : other.name;
}

}  // namespace palpate::bench
