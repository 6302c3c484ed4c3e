#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "palpate/map_builder.hpp"
#include "palpate/simulation.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"
#include "support/sample_files.hpp"
#include "support/shared_device.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"
#include "support/unknown_of.hpp"

namespace palpate {

/// Maps of the letter L and of a disc of full symmetry.
inline std::vector<Hypothesis> shapes() {
  std::vector<Hypothesis> hypotheses{{.map = map_of(on_letter_l, "L")},
                                     {.map = map_of(on_disc, "disc")}};
  hypotheses[1].map.symmetry = 0;
  return hypotheses;
}

/// The shapes, and the letter L again: two labels of three maps.
inline std::vector<Hypothesis> three_maps() {
  std::vector<Hypothesis> maps = shapes();
  maps.push_back(maps[0]);
  return maps;
}

/// A histogram, particles and bounds: over a lattice on which few touches tell the shapes apart,
/// and as many particles as it has bins.
inline std::vector<FilterOptions> every_filter() {
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 20}, .y_mm = {-5.0, 5.0, 20}};
  return {HistogramOptions{.lattice = lattice}, ParticleOptions{.region = lattice},
          BoundedOptions{.lattice = lattice}};
}

/// Six touches of a shape at a pose within the lattice, with the truth.
inline Recording touched(const Silhouette& shape, const std::string& label, std::uint64_t seed) {
  Uniform random(seed);
  const Pose T_object_robot{{random(-3.0, 3.0), random(-3.0, 3.0)}, random(0.0, two_pi)};
  Recording recording = touches_of(shape, T_object_robot, 6, seed);
  recording.path = label;
  recording.truth = {.object = label, .T_object_robot = T_object_robot};
  return recording;
}
inline Recording touched_letter(std::uint64_t seed) { return touched(on_letter_l, "L", seed); }
inline Recording touched_disc(std::uint64_t seed) { return touched(on_disc, "disc", seed); }

/// What a new recogniser tells of all touches of a recording as one unknown.
inline RecognitionRecord recognised(const RecognitionTask& task, const Recording& recording,
                                    bool trace = false) {
  Recogniser recogniser(shared_device(), task);
  return recognise(recogniser, task, unknown_of(recording), trace);
}

/// Its last step.
inline RecognitionStep last_step(const RecognitionTask& task, const Recording& recording) {
  return recognised(task, recording).last();
}

/// Tests by each filter.
class ByEveryFilter : public testing::TestWithParam<int> {
 protected:
  FilterOptions filter() const { return every_filter()[GetParam()]; }
  bool bounded() const { return std::holds_alternative<BoundedOptions>(filter()); }
};

inline const auto each_filter = testing::Range(0, 3);

/// The name of the filter that a test is by.
inline std::string filter_name(const testing::TestParamInfo<int>& test) {
  constexpr std::array names{"Histogram", "Particles", "Bounds"};
  return names.at(test.param);
}

/// The map of a simulated shape as the paper learns it, of symmetry 1.
inline OccupancyGrid learned_map(const std::string& shape) {
  const Recording training =
      Simulator(make_shape(shape), {}, digitacts_array(), 1).touch(training_grid(), {});
  MapBuilder builder(shared_device(), {});
  builder.add(training.touches(0, training.size()));
  return builder.build(shape);
}

/// Maps of the letters A, E, I, O and U as the paper learns them, with their symmetries.
inline const std::vector<Hypothesis>& learned_letters() {
  static const std::vector<Hypothesis> letters = [] {
    std::vector<Hypothesis> learned;
    for (const auto& [letter, symmetry] : {std::pair{"A", 1}, std::pair{"E", 1}, std::pair{"I", 2},
                                           std::pair{"O", 0}, std::pair{"U", 1}}) {
      learned.push_back({.map = learned_map(letter)});
      learned.back().map.symmetry = symmetry;
    }
    return learned;
  }();
  return letters;
}

/// Simulated touches of a letter at a pose with |x| and |y| of at most 8 mm, with the truth.
inline Recording letter_touches(const std::string& letter, int touches, std::uint64_t seed) {
  Pose T_object_robot = random_object_pose(seed);
  T_object_robot.translation_mm *= 0.8;
  Recording recording = sample_unknown(letter, T_object_robot, touches, seed);
  recording.path = recording.object = letter;
  return recording;
}

}  // namespace palpate
