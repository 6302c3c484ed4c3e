#include "letters.hpp"

#include "support/sample_files.hpp"

namespace palpate {

std::vector<Hypothesis> letter_maps(Device& device) {
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

Recording unknown_letter(int touches) { return sample_unknown("E", {{3.0, -2.0}, 1.0}, touches); }

PoseLattice small_lattice() {
  return {{-10.0, 10.0, 10}, {-10.0, 10.0, 10}, {0.0, 6.283185307179586, 16}};
}

}  // namespace palpate
