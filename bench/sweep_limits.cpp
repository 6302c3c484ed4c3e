#include "sweep_limits.hpp"

#include <tuple>

#include <fmt/format.h>

#include "trials.hpp"

namespace palpate::bench {

namespace {

/// What is otherwise. `sensor` holds for training and trials alike.
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

std::vector<Variant> variants_of(const LimitPlan& plan) {
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

Limit measure(Device& device, std::span<const Hypothesis> letters,
              std::span<const Recording> trials, const PoseLattice& lattice) {
  Limit limit{
      .name = {}, .count = lattice.bins(), .elements = trials.front().elements(), .errors = {}};
  for (const Recording& trial : trials) {
    limit.errors.push_back(errors_of(estimate_in_window(device, letters, trial, lattice)));
  }
  return limit;
}

}  // namespace

std::vector<Limit> measure_limits(Device& device, const LimitPlan& plan) {
  std::vector<Limit> limits;
  for (Variant& variant : variants_of(plan)) {
    const std::vector<Hypothesis> letters = letter_maps(
        device, training_recordings(variant.sensor, variant.training_poses), variant.map);
    variant.trials.sensor = variant.sensor;
    const std::vector<Recording> trials =
        make_trials(vowels, plan.trials_each, plan.touches, plan.seed, variant.trials);
    const std::size_t first = limits.size();
    for (const BinCounts& bins : plan.lattices) {
      const bool is_first = limits.size() == first;
      if (!is_first && !variant.all_lattices) {
        break;
      }
      limits.push_back(measure(device, letters, trials, lattice_with(bins)));
      limits.back().name = variant.name;
      if (!is_first || first > 0) {
        limits.back().against = is_first ? 0 : first;
      }
    }
  }
  return limits;
}

}  // namespace palpate::bench
