#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "accuracy.hpp"
#include "cpu_loop.hpp"
#include "letters.hpp"
#include "one_bin_kernel.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "sweep_document.hpp"
#include "sweep_measurements.hpp"

namespace palpate::bench {

namespace {

constexpr std::size_t timed_touches = 3;
constexpr int repeats = 3;

std::ptrdiff_t no_contacts(const Touch& touch) {
  const std::vector<Reading> readings = ContactClassifier{}.classify(touch);
  return std::count(readings.begin(), readings.end(), Reading::no_contact);
}

/// A touch as an array at rest often has it: most elements meet nothing.
Touch resting_touch(const Recording& unknown) {
  const std::vector<Touch> touches = all_touches(unknown);
  const auto resting = std::find_if(touches.begin(), touches.end(), [](const Touch& touch) {
    return 2 * static_cast<std::size_t>(no_contacts(touch)) >= touch.pressure.size();
  });
  if (resting == touches.end()) {
    throw Error(Fault::input, fmt::format("none of {} touches has half its elements in No Contact",
                                          touches.size()));
  }
  return *resting;
}

/// One of the ways.
struct Way {
  std::string path;
  ContactModel model;
  std::vector<Touch> touches;  ///< timed together; the first alone is held against float64
  std::function<void(std::span<const Touch>)> update;
  std::function<std::vector<double>(int object)> log_likelihood;
};

}  // namespace

Json compare_paths(Device& device, std::span<const Hypothesis> letters, const Recording& unknown,
                   const PoseLattice& lattice) {
  const ContactModel product{.prior = letters.front().map.prior};
  const ContactModel logs{.gamma = 0.0, .prior = product.prior};
  const std::vector<Touch> moving = unknown.touches(0, timed_touches);
  const std::vector<Touch> resting(timed_touches, resting_touch(unknown));
  PoseHistogram histogram(device, letters, {.lattice = lattice});
  PoseHistogram in_logs(device, letters, {.lattice = lattice, .contact = logs});
  PoseHistogram at_rest(device, letters, {.lattice = lattice, .still_array = true});
  OneBinKernel one_bin(device, letters, lattice, product);
  CpuLoop cpu_loop(letters, lattice, product);
  const auto way = [](const std::string& path, const ContactModel& model,
                      const std::vector<Touch>& touches, auto& engine) {
    return Way{.path = path,
               .model = model,
               .touches = touches,
               .update = [&engine](std::span<const Touch> some) { engine.update(some); },
               .log_likelihood = [&engine](int object) { return engine.log_likelihood(object); }};
  };
  const Way ways[] = {
      way(plain_text(histogram.paths()), product, moving, histogram),
      way("in logs: " + plain_text(in_logs.paths()), logs, moving, in_logs),
      way(fmt::format("array at rest, {} of {} elements in No Contact: {}",
                      no_contacts(resting.front()), unknown.elements(),
                      plain_text(at_rest.paths())),
          product, resting, at_rest),
      way("one-bin kernel", product, moving, one_bin),
      way("CPU loop", product, moving, cpu_loop),
  };
  Json compared = Json::array();
  std::vector<std::function<void()>> contenders;
  for (const Way& one : ways) {
    const auto first = std::span(one.touches).first(1);
    one.update(first);
    const ErrorStatistics deviation =
        likelihood_errors(letters, one.model, lattice, first, sampled_bins, one.log_likelihood);
    compared.push_back({{"path", one.path},
                        {"count", lattice.bins()},
                        {"nanoseconds", nullptr},
                        {"deviation_nats", record_of(deviation)}});
    contenders.emplace_back([&one] { one.update(one.touches); });
    contenders.back()();  // warms up
  }
  const std::vector<std::vector<double>> seconds = interleave(contenders, repeats);
  const double evaluations = static_cast<double>(lattice.bins()) *
                             static_cast<double>(letters.size() * unknown.elements()) *
                             timed_touches;
  for (std::size_t i = 0; i < compared.size(); ++i) {
    compared[i]["nanoseconds"] = 1e9 * median(seconds[i]) / evaluations;
  }
  return compared;
}

}  // namespace palpate::bench
