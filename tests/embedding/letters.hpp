#pragma once

#include <vector>

#include "palpate/palpate.hpp"
#include "support/sample_files.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// Maps of A, E and I from simulated touches.
inline std::vector<Hypothesis> letter_maps(Device& device) {
  std::vector<Hypothesis> hypotheses;
  for (const char* letter : {"A", "E", "I"}) {
    Simulator sensor(make_shape(letter), SensorModel{}, digitacts_array(), /*seed=*/1);
    const Recording training = sensor.touch(training_grid(), Pose{});
    MapBuilder builder(device, MapOptions{});
    builder.add(training.touches(0, training.size()));
    hypotheses.push_back({.map = builder.build(letter)});
  }
  return hypotheses;
}

/// `touches` simulated touches of a letter E that lies elsewhere, each by a differing number of
/// known elements.
inline Recording unknown_letter(int touches) {
  return sample_unknown("E", {{3.0, -2.0}, 1.0}, touches);
}

/// 10 x 10 x 16 bins: few, for tests that make many filters.
inline PoseLattice small_lattice() {
  return {{-10.0, 10.0, 10}, {-10.0, 10.0, 10}, {0.0, two_pi, 16}};
}

}  // namespace palpate
