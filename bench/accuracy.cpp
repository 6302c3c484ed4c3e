#include <random>

#include <fmt/format.h>

#include "cases.hpp"
#include "letters.hpp"
#include "reference/reference.hpp"

namespace palpate::bench {

ErrorStatistics likelihood_errors(
    std::span<const Hypothesis> objects, const ContactModel& model, const PoseLattice& lattice,
    std::span<const Touch> touches, int bins_per_object,
    const std::function<std::vector<double>(int object)>& log_likelihood) {
  std::mt19937_64 random(7);
  ErrorStatistics errors;
  for (int object = 0; object < static_cast<int>(objects.size()); ++object) {
    const std::vector<double> measured = log_likelihood(object);
    for (int sample = 0; sample < bins_per_object; ++sample) {
      const std::size_t bin = random() % measured.size();
      const Pose T_object_robot = reference::bin_pose(lattice, static_cast<std::int64_t>(bin));
      double expected = 0.0;
      for (const Touch& touch : touches) {
        expected += reference::log_likelihood(touch, T_object_robot, objects[object].map, model);
      }
      errors.add(measured[bin] - expected);
    }
  }
  return errors;
}

Case accuracy_case(const Inputs& inputs, const PoseLattice& lattice) {
  struct Stage {
    std::size_t touches;
    double goal;
  };
  constexpr Stage stages[] = {{1, 1e-4}, {50, 1e-3}, {1000, 1e-2}};
  const int bins_per_object = inputs.quick ? 10 : 100;
  const Recording recording =
      unknown_recordings(1, static_cast<int>(std::end(stages)[-1].touches), 300).front();
  PoseHistogram histogram = letter_histogram(inputs, lattice);
  Case result{.name = "accuracy " + size_of(lattice),
              .facts = {{"path", histogram.paths()}, {"sampled bins", 5 * bins_per_object}}};
  std::size_t done = 0;
  for (const auto& [touches, goal] : stages) {
    // One touch at a time, as a robot would.
    for (; done < touches; ++done) {
      histogram.update(recording.touch(done));
    }
    const ErrorStatistics errors = likelihood_errors(
        inputs.letters, inputs.model, lattice, recording.touches(0, touches), bins_per_object,
        [&](int object) { return histogram.log_likelihood(object); });
    result.measurements.push_back({fmt::format("largest error at touch {}", touches),
                                   errors.largest(), "nats", at_most(goal)});
    result.measurements.push_back(
        {fmt::format("RMS error at touch {}", touches), errors.rms(), "nats"});
  }
  return result;
}

}  // namespace palpate::bench
