#include <tuple>

#include <fmt/format.h>

#include "pose_window.hpp"
#include "sweep_document.hpp"
#include "sweep_measurements.hpp"
#include "trials.hpp"

namespace palpate::bench {

namespace {

/// What is changed. `sensor` holds for training and trials alike.
struct Variant {
  std::string name;
  TouchingSensor sensor = {};
  MapOptions map = {};
  std::vector<Pose> training_poses = training_grid();
  TrialTouches trials = {};
  bool all_lattices = false;
};

/// A square array of n x n elements.
std::vector<glm::dvec2> square_array(int n, double pitch_mm) {
  std::vector<glm::dvec2> elements_mm;
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      elements_mm.push_back(pitch_mm * (glm::dvec2(column, row) - (n - 1) / 2.0));
    }
  }
  return elements_mm;
}

std::vector<Variant> variants_of(const SweepPlan& plan) {
  std::vector<Variant> variants;
  const auto add = [&variants](const std::string& name) -> Variant& {
    variants.emplace_back().name = name;
    return variants.back();
  };
  add("as it is").all_lattices = true;
  add("a sensor without noise").sensor.model.noise_kpa = 0.0;
  if (plan.quick) {
    return variants;
  }
  SensorModel& equal = add("equal gains and press forces").sensor.model;
  equal.force_spread = 0.0;
  equal.gain_spread = 0.0;

  constexpr double sharp_mm = 0.25;
  const std::string sharp = fmt::format("a point spread of {} mm", sharp_mm);
  add(sharp).sensor.model.psf_mm = sharp_mm;
  Variant& sharp_maps = add(sharp + ", and maps of that spread and cells");
  sharp_maps.sensor.model.psf_mm = sharp_mm;
  sharp_maps.map.cell_mm = sharp_mm;
  sharp_maps.map.sensor.spread_mm = sharp_mm / 2.0;

  constexpr double fine_mm = 0.25;
  add(fmt::format("maps of {} mm cells", fine_mm)).map.cell_mm = fine_mm;

  constexpr int times = 8;
  constexpr std::uint64_t training_seed = 12;
  std::vector<Pose>& poses =
      add(fmt::format("{} times the training touches", times)).training_poses;
  const std::vector<Pose> others =
      random_poses((times - 1) * static_cast<int>(poses.size()), training_seed);
  poses.insert(poses.end(), others.begin(), others.end());

  add("touches at random poses").trials.at_random_poses = true;
  const SensorPoseNoise noise{.translation_mm = 1.0, .rotation_rad = 0.05};
  add(fmt::format("touches displaced by {} mm and {} rad", noise.translation_mm,
                  noise.rotation_rad))
      .trials.pose_noise = noise;

  constexpr double pitch_mm = 1.9;  // the DigiTacts'
  for (const auto& [name, edge, spacing_mm] :
       {std::tuple{"an array of 16 x 16", 16, pitch_mm},
        std::tuple{"a sparse array of 3 x 3, twice the pitch", 3, 2.0 * pitch_mm}}) {
    Variant& array = add(name);
    array.sensor.elements_mm = square_array(edge, spacing_mm);
    array.all_lattices = true;
  }
  return variants;
}

PoseErrors errors_of_trials(Device& device, std::span<const Hypothesis> letters,
                            std::span<const Recording> trials, const BinCounts& bins) {
  PoseErrors errors;
  for (const Recording& trial : trials) {
    errors.add(estimate_in_window(device, letters, trial, lattice_with(bins)));
  }
  return errors;
}

/// What a run is compared with.
struct Compared {
  std::string name;  ///< empty for nothing
  PoseErrors errors;
};

Json record_of(const Variant& variant, const BinCounts& bins, const PoseErrors& errors,
               const Compared& with) {
  const auto difference = [&](TrialErrors PoseErrors::*kind) {
    return with.name.empty() ? Json(nullptr)
                             : difference_of(paired_errors(errors.*kind, with.errors.*kind));
  };
  return {{"name", variant.name},
          {"count", product(bins)},
          {"elements", variant.sensor.elements_mm.size()},
          {"error_mm", record_of(errors_over(errors.mode_mm))},
          {"refined_error_mm", record_of(errors_over(errors.refined_mm))},
          {"against", with.name.empty() ? Json(nullptr) : Json(with.name)},
          {"difference_mm", difference(&PoseErrors::mode_mm)},
          {"refined_difference_mm", difference(&PoseErrors::refined_mm)}};
}

}  // namespace

Json measure_limits(Device& device, const SweepPlan& plan) {
  Json limits = Json::array();
  Compared unchanged;
  for (Variant& variant : variants_of(plan)) {
    const std::vector<Hypothesis> letters = letter_maps(
        device, training_recordings(variant.sensor, variant.training_poses), variant.map);
    variant.trials.sensor = variant.sensor;
    const std::vector<Recording> trials =
        make_trials(vowels, plan.limit_trials_each, touches_per_trial, trial_seed, variant.trials);
    Compared with = unchanged;
    for (const BinCounts& bins :
         std::span(plan.limits).first(variant.all_lattices ? plan.limits.size() : 1)) {
      PoseErrors errors = errors_of_trials(device, letters, trials, bins);
      limits.push_back(record_of(variant, bins, errors, with));
      if (unchanged.name.empty()) {
        unchanged = {variant.name, errors};
      }
      if (bins == plan.limits.front()) {
        with = {count_text(static_cast<double>(product(bins))) + " bins", std::move(errors)};
      }
    }
  }
  return limits;
}

}  // namespace palpate::bench
