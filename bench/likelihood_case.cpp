#include <algorithm>
#include <functional>
#include <thread>

#include "cases.hpp"
#include "cpu_loop.hpp"
#include "letters.hpp"
#include "measurement.hpp"
#include "one_bin_kernel.hpp"

namespace palpate::bench {

namespace {

constexpr double goal_bytes_per_bin = 10.0;
constexpr double goal_nats_per_touch = 1e-4;
// Bins per object that the baselines need about a second for.
constexpr std::int64_t baseline_bins = 80000;

/// The lattice with its x and y bins, and as many thetas of the full circle as the baselines have
/// time for.
PoseLattice part_of(PoseLattice lattice) {
  lattice.theta_rad.count = static_cast<int>(
      std::clamp<std::int64_t>(baseline_bins / lattice.plane(), 1, lattice.theta_rad.count));
  return lattice;
}

}  // namespace

Case likelihood_case(const Inputs& inputs, PoseHistogram& histogram, double goal_ns) {
  const std::vector<Touch> touches = all_touches(inputs.unknowns.front());
  const std::size_t elements = inputs.unknowns.front().elements();
  const std::size_t objects = inputs.letters.size();
  const PoseLattice& lattice = histogram.lattice();
  const PoseLattice part = part_of(lattice);
  const auto ns_per_ber = [&](const PoseLattice& l, double seconds) {
    return 1e9 * seconds /
           (static_cast<double>(l.bins()) *
            static_cast<double>(objects * elements * touches.size()));
  };
  const auto errors_of = [&](const PoseLattice& l, auto& engine) {
    return likelihood_errors(inputs.letters, inputs.model, l, touches, inputs.quick ? 100 : 500,
                             [&](int object) { return engine.log_likelihood(object); });
  };

  // The first touches warm up, and show the error and the memory.
  histogram.update(touches);
  const auto peak = static_cast<double>(peak_resident_bytes());
  const ErrorStatistics errors = errors_of(lattice, histogram);
  OneBinKernel one_bin(inputs.device, inputs.letters, part, inputs.model);
  one_bin.update(touches);
  const ErrorStatistics one_bin_errors = errors_of(part, one_bin);
  CpuLoop cpu_loop(inputs.letters, part, inputs.model);
  cpu_loop.update(touches);
  const ErrorStatistics cpu_errors = errors_of(part, cpu_loop);

  const auto bins = static_cast<double>(objects) * static_cast<double>(lattice.bins());
  const int repeats = inputs.quick ? 3 : bins > 1e7 ? 3 : bins > 1e6 ? 7 : 25;
  const std::function<void()> contenders[] = {[&] { histogram.update(touches); },
                                              [&] { one_bin.update(touches); },
                                              [&] { cpu_loop.update(touches); }};
  const std::vector<std::vector<double>> seconds = interleave(contenders, repeats);
  const double ns = ns_per_ber(lattice, median(seconds[0]));
  const double one_bin_ns = ns_per_ber(part, median(seconds[1]));
  const double cpu_ns = ns_per_ber(part, median(seconds[2]));
  const auto per_touch = static_cast<double>(touches.size());
  return {.name = "likelihood " + size_of(lattice),
          .facts = {{"objects", objects},
                    {"touches", touches.size()},
                    {"elements", elements},
                    {"path", histogram.paths()},
                    {"repeats", repeats},
                    {"baselines' thetas", part.theta_rad.count},
                    {"CPU loop's threads", std::thread::hardware_concurrency()}},
          .measurements = {
              {"median", median(seconds[0]), "s"},
              {"per bin, element and touch", ns, "ns", at_most(goal_ns)},
              {"one-bin kernel, per bin, element and touch", one_bin_ns, "ns"},
              {"CPU loop, per bin, element and touch", cpu_ns, "ns"},
              {"one-bin kernel's time over this", one_bin_ns / ns, "times"},
              {"CPU loop's time over this", cpu_ns / ns, "times"},
              {"largest error", errors.largest() / per_touch, "nats per touch",
               at_most(goal_nats_per_touch)},
              {"RMS error", errors.rms() / per_touch, "nats per touch"},
              {"one-bin kernel's largest error", one_bin_errors.largest() / per_touch,
               "nats per touch"},
              {"CPU loop's largest error", cpu_errors.largest() / per_touch, "nats per touch"},
              {"device memory", static_cast<double>(histogram.device_bytes()) / bins, "B per bin",
               bins > 1e7 ? std::optional(at_most(goal_bytes_per_bin)) : std::nullopt},
              {"process peak memory", peak / (1 << 20), "MiB"}}};
}

}  // namespace palpate::bench
