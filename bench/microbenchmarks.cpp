// Each kernel by itself at a typical size, by the device's own clock where the stream is at hand.

#include <benchmark/benchmark.h>

#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "estimation/maps/evidence_grid.hpp"
#include "letters.hpp"

namespace palpate::bench {
namespace {

/// One letter, nine touches of it, and the parts of a PoseHistogram.
class LetterBelief {
 public:
  explicit LetterBelief(const PoseLattice& lattice)
      : unknown_(unknown_recordings(1, touches_per_unknown, 100).front()),
        maps_(letter_maps(device_, training_recordings())),
        stream_(device_.context()),
        belief_(device_.context(), stream_, lattice, 1),
        likelihood_(device_.context(), stream_, belief_, std::span(maps_).first(1), lattice,
                    {.prior = maps_.front().map.prior}),
        evidence_(gather_evidence(all_touches(unknown_), ContactModel{}, lattice.pivot_mm,
                                  likelihood_.segment_elements())) {
    stream_.run();
    accumulate();
  }

  /// Each returns the device's seconds.
  double accumulate() {
    likelihood_.accumulate(evidence_, belief_, {});
    return stream_.device_seconds();
  }
  double reduce() {
    summary_ = belief_.summarise().front();
    return stream_.device_seconds();
  }
  double sum_marginals() {
    belief_.marginals(0, summary_.max, 1.0);
    return stream_.device_seconds();
  }

  /// Known and Unknown elements of all touches.
  std::int64_t elements() const { return static_cast<std::int64_t>(unknown_.pressure.size()); }
  std::string path() const { return likelihood_.paths().front(); }

 private:
  Device device_ = Device::open();
  Recording unknown_;
  std::vector<Hypothesis> maps_;
  gpu::CommandStream stream_;
  DenseBelief belief_;
  DenseLikelihood likelihood_;
  ContactEvidence evidence_;
  BeliefSummary summary_;
};

void likelihood(benchmark::State& state, const PoseLattice& lattice) {
  LetterBelief belief(lattice);
  for (auto _ : state) {
    state.SetIterationTime(belief.accumulate());
  }
  state.SetLabel(belief.path());
  // An item is one bin, element and touch.
  state.SetItemsProcessed(state.iterations() * lattice.bins() * belief.elements());
}

void reduce(benchmark::State& state, const PoseLattice& lattice) {
  LetterBelief belief(lattice);
  for (auto _ : state) {
    state.SetIterationTime(belief.reduce());
  }
  state.SetItemsProcessed(state.iterations() * lattice.bins());
}

void marginals(benchmark::State& state, const PoseLattice& lattice) {
  LetterBelief belief(lattice);
  belief.reduce();
  for (auto _ : state) {
    state.SetIterationTime(belief.sum_marginals());
  }
  state.SetItemsProcessed(state.iterations() * lattice.bins());
}

/// By the host's clock: sorting the readings into tiles is part of it.
void evidence(benchmark::State& state, double cell_mm) {
  const Recording recording = training_recordings().front();
  std::vector<ElementReading> readings;
  for (const Touch& touch : all_touches(recording)) {
    for (const ElementReading& reading : known_readings(touch, ContactClassifier{})) {
      readings.push_back(reading);
    }
  }
  const InverseSensorModel sensor;
  const double radius_mm = sensor.support_radius_mm(readings.size(), 5e-4);
  Device device = Device::open();
  EvidenceGrid grid(device.context(), cell_mm, sensor);
  grid.add(readings, radius_mm);
  for (auto _ : state) {
    grid.add(readings, radius_mm);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(readings.size()));
}

#define PALPATE_DEVICE_TIME UseManualTime()->Unit(benchmark::kMillisecond)
BENCHMARK_CAPTURE(likelihood, tiles_of_5x5, lattice_of(200, 200, 4))->PALPATE_DEVICE_TIME;
BENCHMARK_CAPTURE(likelihood, tiles_of_3x3, lattice_of(100, 100, 16))->PALPATE_DEVICE_TIME;
BENCHMARK_CAPTURE(likelihood, rows, lattice_of(25, 25, 16))->PALPATE_DEVICE_TIME;
BENCHMARK_CAPTURE(reduce, million_bins, lattice_of(100, 100, 100))->PALPATE_DEVICE_TIME;
BENCHMARK_CAPTURE(marginals, million_bins, lattice_of(100, 100, 100))->PALPATE_DEVICE_TIME;
BENCHMARK_CAPTURE(evidence, cells_of_half_mm, 0.5)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(evidence, cells_of_tenth_mm, 0.1)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace palpate::bench

BENCHMARK_MAIN();
