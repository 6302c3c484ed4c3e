#include "cases.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "letters.hpp"
#include "measurement.hpp"

namespace palpate::bench {

namespace {

constexpr double goal_ms = 8.0;

/// The steps of PoseHistogram's update and estimate apart, each as often as asked.
class Steps {
 public:
  Steps(const Inputs& inputs, const PoseLattice& lattice)
      : lattice_(lattice),
        cell_mm_(inputs.letters.front().map.cell_mm),
        stream_(inputs.device.context()),
        belief_(inputs.device.context(), stream_, lattice, inputs.letters.size()),
        likelihood_(inputs.device.context(), stream_, belief_, inputs.letters, lattice,
                    inputs.model) {
    belief_.summarise();
  }

  /// Seconds that the host classifies the touch and rotates its elements.
  double prepare(const Touch& touch) {
    return seconds_of([&] {
      evidence_ = gather_evidence(std::span(&touch, 1), ContactModel{}, lattice_.pivot_mm,
                                  likelihood_.segment_elements());
      rotate_evidence(evidence_.from_pivot_mm, lattice_.theta_rad, cell_mm_);
    });
  }
  /// Seconds that the device works on what prepare() left.
  double run_on_device() {
    likelihood_.accumulate(evidence_, belief_, {});
    const double accumulating = stream_.device_seconds();
    belief_.summarise();
    return accumulating + stream_.device_seconds();
  }

 private:
  PoseLattice lattice_;
  double cell_mm_;
  gpu::CommandStream stream_;
  DenseBelief belief_;
  DenseLikelihood likelihood_;
  ContactEvidence evidence_;
};

}  // namespace

Case latency_case(const Inputs& inputs) {
  const PoseLattice lattice = lattice_of(25, 25, 16);
  const int repeats = inputs.quick ? 50 : 500;
  PoseHistogram histogram = letter_histogram(inputs, lattice);
  Steps steps(inputs, lattice);
  std::vector<double> all;
  std::vector<double> host;
  std::vector<double> device;
  for (int i = 0; i <= repeats; ++i) {
    const Recording& recording = inputs.unknowns[i % inputs.unknowns.size()];
    const Touch touch = recording.touch(i % recording.size());
    const double seconds = seconds_of([&] {
      histogram.update(touch);
      histogram.estimate();
    });
    const double host_seconds = steps.prepare(touch);
    const double device_seconds = steps.run_on_device();
    if (i > 0) {  // the first warms up
      all.push_back(1e3 * seconds);
      host.push_back(1e3 * host_seconds);
      device.push_back(1e3 * device_seconds);
    }
  }
  return {.name = "latency 25x25x16",
          .facts = {{"objects", inputs.letters.size()},
                    {"touches", 1},
                    {"elements", inputs.unknowns.front().elements()},
                    {"path", histogram.paths()},
                    {"repeats", repeats}},
          .measurements = {{"touch to estimate, median", median(all), "ms", at_most(goal_ms)},
                           {"touch to estimate, 95th percentile", quantile(all, 0.95), "ms"},
                           {"host: classes and rotated elements", median(host), "ms"},
                           {"device, by its clock", median(device), "ms"},
                           {"the rest: recording, submission, copies",
                            median(all) - median(host) - median(device), "ms"}}};
}

}  // namespace palpate::bench
