#include "cases.hpp"
#include "letters.hpp"
#include "measurement.hpp"

namespace palpate::bench {

namespace {

Inputs make_inputs(Device& device, const RunOptions& options) {
  Inputs inputs{
      .device = device,
      .device_name = options.device,
      .quick = options.quick,
      .training = training_recordings(),
      .unknowns = unknown_recordings(options.quick ? 50 : 1000, touches_per_unknown, 100)};
  inputs.letters = letter_maps(device, inputs.training);
  inputs.model.prior = inputs.letters.front().map.prior;
  return inputs;
}

}  // namespace

PoseHistogram letter_histogram(const Inputs& inputs, const PoseLattice& lattice) {
  return {inputs.device, inputs.letters, HistogramOptions{.lattice = lattice}};
}

void measure_kernels(const RunOptions& options, std::span<char* const> command_line) {
  Report report(options, command_line);
  const bool quick = options.quick;
  const Inputs inputs = make_inputs(report.device(), options);
  const PoseLattice fine = lattice_of(200, 200, quick ? 4 : 250);
  const PoseLattice middle = lattice_of(100, 100, quick ? 4 : 100);
  for (const auto& [lattice, goal_ns] :
       {std::pair{fine, 0.8}, std::pair{middle, 1.2}, std::pair{lattice_of(25, 25, 16), 4.0}}) {
    restart_peak_memory();
    PoseHistogram histogram = letter_histogram(inputs, lattice);
    report.add(likelihood_case(inputs, histogram, goal_ns));
    if (lattice.x_mm.count == fine.x_mm.count) {
      report.add(reduction_case(inputs, histogram));
    }
  }
  report.add(accuracy_case(inputs, lattice_of(100, 100, 1)));
  report.add(accuracy_case(inputs, lattice_of(25, 25, quick ? 2 : 16)));
  report.add(fine_map_case(inputs));
  report.add(map_stream_case(inputs, true));
  report.add(map_stream_case(inputs, false));
  report.add(many_unknowns_case(inputs));
  report.add(latency_case(inputs));
  report.write();
}

}  // namespace palpate::bench
