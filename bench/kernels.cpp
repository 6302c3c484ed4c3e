#include "kernels.hpp"

#include <chrono>
#include <memory>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "atomic_file.hpp"
#include "cases.hpp"
#include "letters.hpp"
#include "measurement.hpp"

namespace palpate::bench {

namespace {

Inputs make_inputs(Device& device, const KernelOptions& options) {
  Inputs inputs{
      .device = device,
      .device_name = options.device,
      .quick = options.quick,
      .training = training_recordings(),
      .unknowns = unknown_recordings(options.quick ? 50 : 1000, touches_per_unknown, 100)};
  inputs.letters = letter_maps(device, inputs.training, MapOptions{.cell_mm = 0.5});
  inputs.model.prior = inputs.letters.front().map.prior;
  return inputs;
}

void measure_all(const Inputs& inputs, Report& report) {
  const bool quick = inputs.quick;
  {
    restart_peak_memory();
    PoseHistogram histogram = letter_histogram(inputs, lattice_of(200, 200, quick ? 4 : 250));
    report.add(likelihood_case(inputs, histogram, 0.8));
    report.add(reduction_case(inputs, histogram));
  }
  {
    restart_peak_memory();
    PoseHistogram histogram = letter_histogram(inputs, lattice_of(100, 100, quick ? 4 : 100));
    report.add(likelihood_case(inputs, histogram, 1.2));
  }
  {
    restart_peak_memory();
    PoseHistogram histogram = letter_histogram(inputs, lattice_of(25, 25, 16));
    report.add(likelihood_case(inputs, histogram, 4.0));
  }
  report.add(accuracy_case(inputs, lattice_of(100, 100, 1)));
  report.add(accuracy_case(inputs, lattice_of(25, 25, quick ? 2 : 16)));
  report.add(fine_map_case(inputs));
  report.add(map_stream_case(inputs, true));
  report.add(map_stream_case(inputs, false));
  report.add(many_unknowns_case(inputs));
  report.add(latency_case(inputs));
}

}  // namespace

PoseHistogram letter_histogram(const Inputs& inputs, const PoseLattice& lattice) {
  return {inputs.device, inputs.letters, HistogramOptions{.lattice = lattice}};
}

void measure_kernels(const KernelOptions& options, std::span<char* const> command_line) {
  // Before the minutes of work, so that a wrong name is known at once.
  std::unique_ptr<AtomicFile> file;
  if (!options.json.empty()) {
    file = std::make_unique<AtomicFile>(options.json);
  }
  Device device = Device::open(options.device);
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  Report report({{"device", device.name()},
                 {"host threads", std::thread::hardware_concurrency()},
                 {"compiler", PALPATE_COMPILER},
                 {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", now)},
                 {"command line", fmt::format("{}", fmt::join(command_line, " "))}});
  measure_all(make_inputs(device, options), report);
  if (file) {
    file->write(report.document().dump(2) + "\n");
    file->commit();
  }
}

}  // namespace palpate::bench
