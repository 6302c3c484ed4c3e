#include "shapes.hpp"

#include <numbers>

#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"
#include "support/unknown_of.hpp"

namespace palpate {

namespace {

Recording touched(const Silhouette& shape, const std::string& label, std::uint64_t seed) {
  Uniform random(seed);
  const Pose T_object_robot{{random(-3.0, 3.0), random(-3.0, 3.0)},
                            random(0.0, 2.0 * std::numbers::pi)};
  Recording recording = touches_of(shape, T_object_robot, 6, seed);
  recording.path = label;
  recording.truth = {.object = label, .T_object_robot = T_object_robot};
  return recording;
}

}  // namespace

std::vector<Hypothesis> shapes() {
  std::vector<Hypothesis> hypotheses{{.map = map_of(on_letter_l, "L")},
                                     {.map = map_of(on_disc, "disc")}};
  hypotheses[1].map.symmetry = 0;
  return hypotheses;
}

std::vector<FilterOptions> every_filter() {
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 20}, .y_mm = {-5.0, 5.0, 20}};
  return {HistogramOptions{.lattice = lattice}, ParticleOptions{.region = lattice},
          BoundedOptions{.lattice = lattice}};
}

std::vector<Hypothesis> three_maps() {
  std::vector<Hypothesis> maps = shapes();
  maps.push_back(maps[0]);
  return maps;
}

Recording touched_letter(std::uint64_t seed) { return touched(on_letter_l, "L", seed); }
Recording touched_disc(std::uint64_t seed) { return touched(on_disc, "disc", seed); }

RecognitionRecord recognised(const RecognitionTask& task, const Recording& recording, bool trace) {
  Recogniser recogniser(shared_device(), task);
  return recognise(recogniser, task, unknown_of(recording), trace);
}

RecognitionStep last_step(const RecognitionTask& task, const Recording& recording) {
  return recognised(task, recording).last();
}

}  // namespace palpate
