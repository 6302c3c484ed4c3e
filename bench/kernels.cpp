#include <algorithm>
#include <functional>
#include <random>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "baselines.hpp"
#include "cases.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "estimation/lattice/dense_likelihood.hpp"
#include "letters.hpp"
#include "reference/reference.hpp"

namespace palpate::bench {

bool same(const Estimate& a, const Estimate& b) {
  return a.identity == b.identity && a.mode.object == b.mode.object && a.mode.bin == b.mode.bin &&
         a.mode.log_likelihood == b.mode.log_likelihood;
}

PoseHistogram letter_histogram(const Inputs& inputs, const PoseLattice& lattice) {
  return {inputs.device, inputs.letters, HistogramOptions{.lattice = lattice}};
}

namespace {

Inputs make_inputs(Device& device, const RunOptions& options) {
  Inputs inputs{
      .device = device,
      .quick = options.quick,
      .training = training_recordings(),
      .unknowns = unknown_recordings(options.quick ? 20 : 1000, touches_per_unknown, 100)};
  inputs.letters = letter_maps(device, inputs.training);
  inputs.model.prior = inputs.letters.front().map.prior;
  return inputs;
}

/// Difference in nats between the log-likelihoods of some bins of every letter, drawn with a fixed
/// seed, and the float64 reference of the touches. `engine` has log_likelihood() of an object's
/// bins.
ErrorStatistics likelihood_errors(const Inputs& inputs, auto& engine, const PoseLattice& lattice,
                                  std::span<const Touch> touches, int bins_per_object) {
  std::mt19937_64 random(7);
  ErrorStatistics errors;
  for (int object = 0; object < static_cast<int>(inputs.letters.size()); ++object) {
    const std::vector<double> measured = engine.log_likelihood(object);
    for (int sample = 0; sample < bins_per_object; ++sample) {
      const std::size_t bin = random() % measured.size();
      const Pose T_object_robot = reference::bin_pose(lattice, static_cast<std::int64_t>(bin));
      double expected = 0.0;
      for (const Touch& touch : touches) {
        expected += reference::log_likelihood(touch, T_object_robot, inputs.letters[object].map,
                                              inputs.model);
      }
      errors.add(measured[bin] - expected);
    }
  }
  return errors;
}

/// The lattice with its x and y bins, and as many thetas of the full circle as the baselines have
/// time for, about a second.
PoseLattice part_of(PoseLattice lattice, bool quick) {
  const std::int64_t most_bins = quick ? 10000 : 80000;  // per object
  lattice.theta_rad.count = static_cast<int>(
      std::clamp<std::int64_t>(most_bins / lattice.plane(), 1, lattice.theta_rad.count));
  return lattice;
}

/// Times the likelihood of an unknown's touches beside two baselines, the one-bin kernel and the
/// CPU loop, with the error of each. Leaves some touches in the histogram.
Case likelihood_case(const Inputs& inputs, PoseHistogram& histogram, double goal_ns) {
  const std::vector<Touch> touches =
      inputs.unknowns.front().touches(0, inputs.quick ? 3 : touches_per_unknown);
  const std::size_t elements = inputs.unknowns.front().elements();
  const std::size_t objects = inputs.letters.size();
  const PoseLattice& lattice = histogram.lattice();
  const PoseLattice part = part_of(lattice, inputs.quick);
  const auto ns_per_ber = [&](const PoseLattice& l, double seconds) {
    return 1e9 * seconds /
           (static_cast<double>(l.bins()) *
            static_cast<double>(objects * elements * touches.size()));
  };
  const auto errors_of = [&](const PoseLattice& l, auto& engine) {
    return likelihood_errors(inputs, engine, l, touches, inputs.quick ? 100 : 500);
  };

  // The first touches warm up, and show the error and the memory.
  histogram.update(touches);
  const auto peak = static_cast<double>(peak_resident_bytes());
  OneBinKernel one_bin(inputs.device, inputs.letters, part, inputs.model);
  one_bin.update(touches);
  CpuLoop cpu_loop(inputs.letters, part, inputs.model);
  cpu_loop.update(touches);
  const ErrorStatistics errors = errors_of(lattice, histogram);
  const double one_bin_error = errors_of(part, one_bin).largest;
  const double cpu_error = errors_of(part, cpu_loop).largest;

  const auto bins = static_cast<double>(objects) * static_cast<double>(lattice.bins());
  const int repeats = inputs.quick ? 1 : bins > 1e7 ? 3 : bins > 1e6 ? 7 : 25;
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
              {"largest error", errors.largest / per_touch, "nats per touch", at_most(1e-4)},
              {"RMS error", errors.rms() / per_touch, "nats per touch"},
              {"one-bin kernel's largest error", one_bin_error / per_touch, "nats per touch"},
              {"CPU loop's largest error", cpu_error / per_touch, "nats per touch"},
              {"device memory", static_cast<double>(histogram.device_bytes()) / bins, "B per bin",
               bins > 1e7 ? std::optional(at_most(10.0)) : std::nullopt},
              {"process peak memory", peak / (1 << 20), "MiB"}}};
}

/// Measures the error of the log-likelihood after 1, 50 and 1,000 touches.
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
        inputs, histogram, lattice, recording.touches(0, touches), bins_per_object);
    result.add(
        {{fmt::format("largest error at touch {}", touches), errors.largest, "nats", at_most(goal)},
         {fmt::format("RMS error at touch {}", touches), errors.rms(), "nats"}});
  }
  return result;
}

/// Times identity, mode and marginals of a belief.
Case reduction_case(const Inputs& inputs, PoseHistogram& histogram) {
  const int objects = static_cast<int>(inputs.letters.size());
  const auto ask = [&](bool marginals) {
    histogram.update(std::span<const Touch>());  // forgets the sums that it has
    std::pair<Estimate, std::vector<std::vector<double>>> answers{histogram.estimate(), {}};
    for (int object = 0; marginals && object < objects; ++object) {
      Marginals of_object = histogram.marginals(object);
      answers.second.push_back(std::move(of_object.xy));
      answers.second.push_back(std::move(of_object.theta));
    }
    return answers;
  };
  const auto [first, first_marginals] = ask(true);
  const auto [second, second_marginals] = ask(true);
  const bool repeatable = same(first, second) && first_marginals == second_marginals;
  const int repeats = inputs.quick ? 3 : 15;
  const PoseLattice& lattice = histogram.lattice();
  const bool large = objects * lattice.bins() > 10'000'000;
  const auto goal = [&](double ms) { return large ? std::optional(at_most(ms)) : std::nullopt; };
  return {.name = "reductions " + size_of(lattice),
          .facts = {{"objects", objects}, {"repeats", repeats}},
          .measurements = {
              {"identity and mode", 1e3 * median_seconds([&] { ask(false); }, repeats), "ms",
               goal(80.0)},
              {"identity, mode and all marginals",
               1e3 * median_seconds([&] { ask(true); }, repeats), "ms", goal(160.0)},
              {"two runs of equal bits", repeatable ? 1.0 : 0.0, "(1 is yes)", at_least(1)}}};
}

/// Times an estimate from the moment of its touch, in all and by the steps of PoseHistogram's
/// update and estimate apart.
Case latency_case(const Inputs& inputs) {
  const PoseLattice lattice = lattice_of(25, 25, 16);
  const int repeats = inputs.quick ? 50 : 500;
  PoseHistogram histogram = letter_histogram(inputs, lattice);
  gpu::Context& context = inputs.device.context();
  gpu::CommandStream stream(context);
  DenseBelief belief(context, stream, lattice, inputs.letters.size());
  DenseLikelihood likelihood(context, stream, belief, inputs.letters, lattice, inputs.model);
  belief.summarise();
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
    KnownElements known;
    const double host_seconds = seconds_of([&] {
      known = gathered(evidence_of({&touch, 1}, ContactModel{}), lattice.pivot_mm,
                       likelihood.longest_run());
      rotated_elements(known.from_pivot_mm, lattice.theta_rad, inputs.letters.front().map.cell_mm);
    });
    likelihood.accumulate(known, belief, {});
    const double accumulating = stream.device_seconds();
    belief.summarise();
    if (i > 0) {  // the first warms up
      all.push_back(1e3 * seconds);
      host.push_back(1e3 * host_seconds);
      device.push_back(1e3 * (accumulating + stream.device_seconds()));
    }
  }
  const double rest = median(all) - median(host) - median(device);
  return {.name = "latency 25x25x16",
          .facts = {{"objects", inputs.letters.size()},
                    {"touches", 1},
                    {"elements", inputs.unknowns.front().elements()},
                    {"path", histogram.paths()},
                    {"repeats", repeats}},
          .measurements = {{"touch to estimate, median", median(all), "ms", at_most(8.0)},
                           {"touch to estimate, 95th percentile", quantile(all, 0.95), "ms"},
                           {"host: classes and rotated elements", median(host), "ms"},
                           {"device, by its clock", median(device), "ms"},
                           {"the rest: recording, submission, copies", rest, "ms"}}};
}

}  // namespace

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
