#include "bounded/certificate_trials.hpp"

#include <algorithm>

#include "support/touched_shape.hpp"

namespace palpate {

Trial make_trial(const std::array<int, 3>& bins, std::uint64_t seed) {
  Uniform random(seed);
  Trial trial;
  PoseLattice& lattice = trial.options.lattice;
  const double half_mm = one_of(random, std::array{5.0, 10.0, 25.0});
  lattice.x_mm = {-half_mm + random(-1.0, 1.0), half_mm, bins[0]};
  lattice.y_mm = {-half_mm, half_mm + random(-1.0, 1.0), bins[1]};
  lattice.theta_rad = {0.0, one_of(random, std::array{two_pi, two_pi, 2.0}), bins[2]};
  lattice.pivot_mm = {random(-5.0, 5.0), random(-5.0, 5.0)};
  trial.options.contact.gamma = one_of(random, std::array{0.1, 0.1, 0.02, 0.0});
  trial.options.tolerance = one_of(random, std::array{1e-6, 1e-6, 1e-9, 1e-3});
  const auto touches = static_cast<std::size_t>(random(1.0, 10.0));
  const auto object_seed = static_cast<std::uint64_t>(random(1.0, 1e9));
  if (random(0.0, 2.0) < 1.0) {
    trial.objects = {{map_of(on_letter_l, "L"), 1.0}, {map_of(on_disc, "disc"), 1.0}};
    const Pose T_object_robot{{random(-4.0, 4.0), random(-4.0, 4.0)}, random(0.0, 2.0)};
    trial.recording = touches_of(on_letter_l, T_object_robot, touches, object_seed);
  } else {
    const double steepness = one_of(random, std::array{1.0, 4.0, 12.0});
    trial.objects = {{random_map(31, 27, 0.5, steepness, object_seed), 1.0},
                     {random_map(17, 23, 0.8, steepness, object_seed + 1), 1.0}};
    trial.recording =
        random_recording(touches, static_cast<std::size_t>(random(1.0, 40.0)), object_seed + 2);
  }
  if (random(0.0, 2.0) < 1.0) {
    trial.objects.push_back({random_map(40, 9, 0.37, 6.0, object_seed + 3), 1.0});
    trial.objects.push_back({random_map(1, 1, 4.0, 6.0, object_seed + 4), 1.0});
  }
  for (Hypothesis& object : trial.objects) {
    object.weight = one_of(random, std::array{1.0, 1.0, 0.2, 1e-6});
  }
  return trial;
}

Trial make_displaced_trial(const std::array<int, 3>& bins, std::uint64_t seed) {
  Trial trial = make_trial(bins, seed);
  Uniform random(seed + 1);
  PoseLattice& lattice = trial.options.lattice;
  lattice.pivot_mm *= one_of(random, std::array{1.0, 1.0, 10.0});
  Axis* const fixed =
      one_of(random, std::array<Axis*, 8>{&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad});
  if (fixed != nullptr) {
    fixed->count = 1;
  }
  if (random(0.0, 4.0) < 1.0) {
    lattice.collapse_fixed();
  }
  trial.options.touch_sd = {.mm = one_of(random, std::array{0.0, 0.3, 1.0, 1.0, 2.5, 6.0}),
                            .rad = one_of(random, std::array{0.0, 0.05, 0.05, 0.3, 1.5})};
  if (trial.options.touch_sd.none()) {
    trial.options.touch_sd.mm = 1.0;
  }
  // Where a far pivot turns a bin to is known to 1e-14 of a step, which may count for as much.
  trial.options.tolerance = std::max(trial.options.tolerance, 1e-7);
  return trial;
}

}  // namespace palpate
