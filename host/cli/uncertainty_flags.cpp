#include "cli/uncertainty_flags.hpp"

#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/options.hpp"
#include "estimation/displacement_check.hpp"
#include "model/number_text.hpp"

namespace palpate::cli {

namespace {

constexpr double none_given = std::numeric_limits<double>::quiet_NaN();

/// One standard deviation: its flag, its scene key, and what they give.
struct Given {
  const char* flag;
  const char* key;
  std::optional<double> by_flag;
  std::optional<double> by_key;

  bool any() const { return by_flag || by_key; }
};

/// The standard deviation; 0 where it is not given. Throws Error where it is none.
double value_of(const Given& sd) {
  if (sd.by_flag && !(*sd.by_flag >= 0.0 && std::isfinite(*sd.by_flag))) {
    refuse_flag(sd.flag, *sd.by_flag, "give a finite number from 0");
  }
  return sd.by_flag ? *sd.by_flag : sd.by_key.value_or(0.0);
}

/// Throws Error where the standard deviation is wider than the region.
/// @param widest in the flag's unit
void require_within(const Given& sd, const std::string& scene_file, double widest,
                    const char* unit) {
  const double value = value_of(sd);
  if (value > widest) {
    const std::string remedy =
        fmt::format("wider than the region, {:g} {}; give less, or widen the region", widest, unit);
    if (sd.by_flag) {
      refuse_flag(sd.flag, value, "{}", remedy);
    }
    refuse(scene_file, "{} = {}: {}", sd.key, value, remedy);
  }
}

/// Throws Error where any of these is given.
void refuse_given(std::initializer_list<Given> all, const std::string& scene_file,
                  const char* remedy) {
  for (const Given& sd : all) {
    if (sd.by_flag) {
      refuse(sd.flag, "{}", remedy);
    }
    if (sd.by_key) {
      refuse(scene_file, "{}: {}", sd.key, remedy);
    }
  }
}

Given touch_mm(const UncertaintyFlags& flags, const Scene& scene) {
  return {"--touch-sd-mm", "touch_sd mm", flags.touch_sd_mm, scene.touch_sd.mm};
}
Given touch_deg(const UncertaintyFlags& flags, const Scene& scene) {
  return {"--touch-sd-deg", "touch_sd deg", flags.touch_sd_deg, scene.touch_sd.deg};
}
Given slip_mm(const UncertaintyFlags& flags, const Scene& scene) {
  return {"--slip-sd-mm", "slip_sd mm", flags.slip_sd_mm, scene.slip_sd.mm};
}
Given slip_deg(const UncertaintyFlags& flags, const Scene& scene) {
  return {"--slip-sd-deg", "slip_sd deg", flags.slip_sd_deg, scene.slip_sd.deg};
}

/// The first of these that is above 0: its flag, or its key and the scene file.
std::string giver_of(std::initializer_list<Given> all, const std::string& scene_file) {
  for (const Given& sd : all) {
    if (value_of(sd) > 0.0) {
      return sd.by_flag ? sd.flag : fmt::format("{} in {}", sd.key, scene_file);
    }
  }
  return "";
}

std::optional<double> none_weight(const UncertaintyFlags& flags, const Scene& scene,
                                  std::span<const Hypothesis> hypotheses) {
  if (flags.none ? *flags.none == "auto" : scene.auto_none) {
    double sum = 0.0;
    for (const Hypothesis& hypothesis : hypotheses) {
      sum += hypothesis.weight;
    }
    return sum;
  }
  if (!flags.none) {
    return scene.none;
  }
  const std::optional<double> weight = number_of(*flags.none);
  if (!weight || !(*weight > 0.0)) {
    refuse_flag("--none", *flags.none,
                "give a weight above 0, or no value; recordings stand before the flags");
  }
  return weight;
}

}  // namespace

void add_uncertainty_flags(CLI::App& command, UncertaintyFlags& flags) {
  command.add_option("--touch-sd-mm", flags.touch_sd_mm,
                     "The robot's repeatability: standard deviation of the sensor's true position "
                     "about the reported one, along x and along y, mm. Independent from touch to "
                     "touch [default: the sensor model's, with the histogram; else 0, exact]");
  command.add_option("--touch-sd-deg", flags.touch_sd_deg,
                     "The same of the sensor's angle, degrees [default: as for --touch-sd-mm]");
  command.add_option("--slip-sd-mm", flags.slip_sd_mm,
                     "Standard deviation of how far the object moves between two touches, along x "
                     "and along y, mm; the motion noise of particles [default: 0, at rest; "
                     "particles: 1]");
  command.add_option("--slip-sd-deg", flags.slip_sd_deg,
                     "The same of how far the object turns about its middle, degrees [default: 0; "
                     "particles: 5.73, which is 0.1 rad]");
  command
      .add_option(
          "--none", flags.none,
          "Adds \"(none)\", an object that was never learned, with prior weight W; a map "
          "has the weight 1. Without W, (none) has the sum of the maps' weights: even odds "
          "before the first touch. (none) explains each touch by a piece of some known "
          "object; the pieces need not belong to one pose. One touch cannot tell: after it, "
          "the odds are about the prior's, unless a sensor model has learned what a touch of no "
          "known object is like [default: no (none)]")
      ->type_name("W")
      ->expected(0, 1)
      ->default_str("auto");
}

void set_uncertainty(const UncertaintyFlags& flags, const Scene& scene,
                     std::span<const Hypothesis> hypotheses, HistogramOptions& histogram) {
  const auto set = [](DisplacementSd& sd, const Given& mm, const Given& deg) {
    sd.mm = mm.any() ? value_of(mm) : sd.mm;
    sd.rad = deg.any() ? radians(value_of(deg)) : sd.rad;
  };
  set(histogram.touch_sd, touch_mm(flags, scene), touch_deg(flags, scene));
  set(histogram.slip_sd, slip_mm(flags, scene), slip_deg(flags, scene));
  histogram.none_weight = none_weight(flags, scene, hypotheses);
}

void set_uncertainty(const UncertaintyFlags& flags, const Scene& scene,
                     const std::string& scene_file, ParticleOptions& particles) {
  refuse_given({touch_mm(flags, scene), touch_deg(flags, scene)}, scene_file,
               "particles take every touch's pose to be exact; use --filter histogram, or "
               "--slip-sd-mm and --slip-sd-deg, their motion noise");
  refuse_given({{"--none", "none", flags.none ? std::optional(none_given) : std::nullopt,
                 scene.none || scene.auto_none ? std::optional(none_given) : std::nullopt}},
               scene_file,
               "particles have no mean over all poses, which (none) needs; use --filter histogram");
  if (const Given mm = slip_mm(flags, scene); mm.any()) {
    particles.motion_mm = value_of(mm);
  }
  if (const Given deg = slip_deg(flags, scene); deg.any()) {
    particles.motion_rad = radians(value_of(deg));
  }
}

std::string touch_sd_giver(const UncertaintyFlags& flags, const Scene& scene,
                           const std::string& scene_file) {
  return giver_of({touch_mm(flags, scene), touch_deg(flags, scene)}, scene_file);
}

std::string slip_sd_giver(const UncertaintyFlags& flags, const Scene& scene,
                          const std::string& scene_file) {
  return giver_of({slip_mm(flags, scene), slip_deg(flags, scene)}, scene_file);
}

void require_within_region(const UncertaintyFlags& flags, const Scene& scene,
                           const std::string& scene_file, const PoseLattice& lattice) {
  const DisplacementSd widest = widest_displacement(lattice);
  for (const Given& sd : {touch_mm(flags, scene), slip_mm(flags, scene)}) {
    require_within(sd, scene_file, widest.mm, "mm");
  }
  for (const Given& sd : {touch_deg(flags, scene), slip_deg(flags, scene)}) {
    require_within(sd, scene_file, degrees(widest.rad), "deg");
  }
}

std::string unresolved_words(const RecognitionTask& task, const PoseLattice& lattice,
                             std::span<const Pose> T_robot_sensor) {
  std::optional<std::string> fault = unresolved_by_steps(task.touch_sd(), lattice, "touch-sd");
  if (!fault) {
    fault = unresolved_by_steps(task.slip_sd(), lattice, "slip-sd");
  }
  for (const Pose& pose : T_robot_sensor) {
    if (!fault) {
      fault = unresolved_at(pose, task.touch_sd(), lattice, "touch-sd");
    }
  }
  return fault.value_or("");
}

std::string unresolved_words(const RecognitionTask& task, const PoseLattice& lattice,
                             std::span<const Touch> touches) {
  std::vector<Pose> T_robot_sensor;
  for (const Touch& touch : touches) {
    T_robot_sensor.push_back(touch.T_robot_sensor);
  }
  return unresolved_words(task, lattice, T_robot_sensor);
}

}  // namespace palpate::cli
