#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "baselines.hpp"
#include "cases.hpp"
#include "letters.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::bench {

namespace {

constexpr std::size_t timed_touches = 3;
constexpr int touches_in_all = 15;  ///< of which one is as of an array at rest
constexpr std::uint64_t seed = 1'000;
constexpr int sampled_bins = 200;  ///< of every object, held against float64

std::ptrdiff_t no_contacts(const Touch& touch) {
  const std::vector<Reading> readings = ContactClassifier{}.classify(touch);
  return std::count(readings.begin(), readings.end(), Reading::no_contact);
}

/// A touch as an array at rest often has it: most elements meet nothing.
Touch touch_at_rest(const Recording& unknown) {
  const std::vector<Touch> touches = all_touches(unknown);
  const auto at_rest = std::find_if(touches.begin(), touches.end(), [](const Touch& touch) {
    return 2 * static_cast<std::size_t>(no_contacts(touch)) >= touch.pressure.size();
  });
  if (at_rest == touches.end()) {
    throw Error(Fault::input, fmt::format("none of {} touches has half its elements in No Contact",
                                          touches.size()));
  }
  return *at_rest;
}

/// One of the ways.
struct Way {
  std::string path;
  ContactModel model;
  std::vector<Touch> touches;  ///< timed together; the first alone is held against float64
  std::function<void(std::span<const Touch>)> update;
  std::function<std::vector<double>(int object)> log_likelihood;
};

/// A record of each way to evaluate the likelihood on one lattice: the product of Eq. 7, the same
/// in logs (gamma = 0), an array at rest, the one-bin kernel, and the loop on the host's cores. The
/// ways take turns.
Json compare_ways(Device& device, std::span<const Hypothesis> letters, const Recording& unknown,
                  const PoseLattice& lattice, int repeats) {
  const ContactModel product{.prior = letters.front().map.prior};
  const ContactModel logs{.gamma = 0.0, .prior = product.prior};
  const std::vector<Touch> moving = unknown.touches(0, timed_touches);
  const std::vector<Touch> at_rest(timed_touches, touch_at_rest(unknown));
  PoseHistogram histogram(device, letters, {.lattice = lattice});
  PoseHistogram in_logs(device, letters, {.lattice = lattice, .contact = logs});
  PoseHistogram still_array(device, letters, {.lattice = lattice, .still_array = true});
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
                      no_contacts(at_rest.front()), unknown.elements(),
                      plain_text(still_array.paths())),
          product, at_rest, still_array),
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
                        {"deviation_nats",
                         {{"largest", deviation.largest()},
                          {"rms", deviation.rms()},
                          {"samples", deviation.count()}}}});
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

}  // namespace

void compare_paths(const RunOptions& options, std::span<char* const> command_line) {
  Report report(options, command_line);
  const std::vector<Hypothesis> letters = letter_maps(report.device(), training_recordings());
  const Recording unknown = unknown_recordings(1, touches_in_all, seed).front();
  std::vector<PoseLattice> lattices = {lattice_of(25, 25, 16), lattice_of(50, 50, 40),
                                       lattice_of(100, 100, 10), lattice_of(200, 200, 4)};
  if (options.quick) {
    lattices = {lattice_of(25, 25, 4), lattice_of(100, 100, 1)};
  }
  const int repeats = options.quick ? 1 : 3;
  fmt::print(
      "\n| evaluated by | bins per object | ns per pose, element and touch | largest deviation, "
      "nats | RMS |\n|:--|--:|--:|--:|--:|\n");
  Json& precisions = report.document()["precisions"] = Json::array();
  for (const PoseLattice& lattice : lattices) {
    for (const Json& way : compare_ways(report.device(), letters, unknown, lattice, repeats)) {
      const Json& deviation = way.at("deviation_nats");
      fmt::print("| {} | {} | {:.2f} | {:.1e} | {:.1e} |\n", plain_text(way.at("path")),
                 count_text(way.at("count")), way.at("nanoseconds").get<double>(),
                 deviation.at("largest").get<double>(), deviation.at("rms").get<double>());
      precisions.push_back(way);
    }
  }
  report.write();
}

}  // namespace palpate::bench
