#include "belief_costs.hpp"

#include <array>
#include <functional>
#include <numbers>

#include "letters.hpp"
#include "palpate/simulation.hpp"

namespace palpate::bench {

namespace {

constexpr DisplacementSd touch_sd{1.0, 0.05};
constexpr DisplacementSd slip_sd{0.3, std::numbers::pi / 180.0};
constexpr std::uint64_t seed = 900'000'000;
constexpr double most_times = 2.5;        ///< of a plain touch's time
constexpr double most_latency_ms = 8.0;   ///< from touch to estimate
constexpr double most_plan_ms = 150.0;    ///< over 200 candidates
constexpr double most_memory_mib = 2048;  ///< of 5 x 10,000,000 bins

double mib(std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

/// One of the unknowns' touches after another, over and over.
class Touches {
 public:
  Touches() : recordings_(unknown_recordings(5, touches_per_unknown, seed)) {}

  Touch next() {
    const std::size_t i = count_++;
    const Recording& recording = recordings_[i / touches_per_unknown % recordings_.size()];
    return recording.touch(i % touches_per_unknown);
  }

 private:
  std::vector<Recording> recordings_;
  std::size_t count_ = 0;
};

}  // namespace

Case touch_cost_case(Device& device, const std::vector<Hypothesis>& letters,
                     const PoseLattice& lattice, int repeats) {
  const HistogramOptions plain{.lattice = lattice};
  HistogramOptions averaged = plain;
  averaged.touch_sd = touch_sd;
  HistogramOptions slipping = plain;
  slipping.slip_sd = slip_sd;
  HistogramOptions with_none = plain;
  with_none.none_weight = static_cast<double>(letters.size());
  std::vector<PoseHistogram> histograms;
  for (const HistogramOptions& options : {plain, averaged, slipping, with_none}) {
    histograms.emplace_back(device, letters, options);
  }
  // All contenders meet the same touches in the same order.
  std::vector<Touches> touches(histograms.size());
  std::vector<std::function<void()>> contenders;
  for (std::size_t i = 0; i < histograms.size(); ++i) {
    contenders.emplace_back(
        [&histogram = histograms[i], &of_it = touches[i]] { histogram.update(of_it.next()); });
    contenders.back()();  // the first touch warms up; the object slips before the second
  }
  const std::vector<std::vector<double>> seconds = interleave(contenders, repeats);
  const double plain_ms = 1e3 * median(seconds[0]);
  const auto times = [&](std::size_t i) { return 1e3 * median(seconds[i]) / plain_ms; };
  const auto memory = [&](std::size_t i) {
    return static_cast<double>(histograms[i].device_bytes()) /
           static_cast<double>(histograms[0].device_bytes());
  };
  return {.name = "touch " + size_of(lattice),
          .facts = {{"objects", letters.size()},
                    {"touch_sd", "1 mm, 0.05 rad"},
                    {"slip_sd", "0.3 mm, 1 degree"},
                    {"repeats", repeats}},
          .measurements = {{"plain touch, median", plain_ms, "ms"},
                           {"uncertain touch, median", 1e3 * median(seconds[1]), "ms"},
                           {"uncertain over plain", times(1), "times", at_most(most_times)},
                           {"touch after a slip over plain", times(2), "times"},
                           {"touch with none of these over plain", times(3), "times"},
                           {"memory, uncertain over plain", memory(1), "times", at_most(2.0)},
                           {"memory, slip over plain", memory(2), "times", at_most(2.0)},
                           {"memory, none of these over plain", memory(3), "times", at_most(2.0)}}};
}

Case latency_of_averaged_case(Device& device, const std::vector<Hypothesis>& letters, int repeats) {
  const PoseLattice lattice = lattice_of(25, 25, 16);
  std::array<std::vector<double>, 2> milliseconds;
  std::vector<PoseHistogram> histograms;
  histograms.emplace_back(device, letters, HistogramOptions{.lattice = lattice});
  histograms.emplace_back(device, letters,
                          HistogramOptions{.lattice = lattice, .touch_sd = touch_sd});
  Touches touches;
  for (int i = 0; i <= repeats; ++i) {
    const Touch touch = touches.next();
    for (std::size_t k = 0; k < histograms.size(); ++k) {
      const double seconds = seconds_of([&] {
        histograms[k].update(touch);
        histograms[k].estimate();
      });
      if (i > 0) {  // the first warms up
        milliseconds[k].push_back(1e3 * seconds);
      }
    }
  }
  return {
      .name = "latency " + size_of(lattice) + ", uncertain",
      .facts = {{"objects", letters.size()}, {"touch_sd", "1 mm, 0.05 rad"}, {"repeats", repeats}},
      .measurements = {
          {"touch to estimate, median", median(milliseconds[1]), "ms", at_most(most_latency_ms)},
          {"95th percentile", quantile(milliseconds[1], 0.95), "ms"},
          {"plain touch to estimate, median", median(milliseconds[0]), "ms"}}};
}

Case plan_cost_case(Device& device, const std::vector<Hypothesis>& letters, int repeats) {
  constexpr int candidates = 200;
  const PoseLattice lattice = lattice_of(25, 25, 16);
  const Recording unknown = unknown_recordings(1, touches_per_unknown, seed).front();
  // Places all over the unknown, which the robot could press next.
  std::vector<Pose> T_robot_sensor = random_poses(candidates, seed);
  for (Pose& pose : T_robot_sensor) {
    pose = inverse(unknown.truth->T_object_robot) * pose;
  }
  std::vector<double> milliseconds;
  for (const DisplacementSd& sd : {DisplacementSd{}, touch_sd}) {
    PoseHistogram histogram(device, letters, HistogramOptions{.lattice = lattice, .touch_sd = sd});
    histogram.update(unknown.touches(0, 3));
    milliseconds.push_back(
        1e3 * median_seconds([&] { histogram.expected_gain(T_robot_sensor, unknown.elements_mm); },
                             repeats));
  }
  return {.name = "plan " + size_of(lattice),
          .facts = {{"objects", letters.size()},
                    {"candidates", candidates},
                    {"samples", PlanOptions{}.samples},
                    {"repeats", repeats}},
          .measurements = {{"exact touches, median", milliseconds[0], "ms", at_most(most_plan_ms)},
                           {"uncertain touches, median", milliseconds[1], "ms"}}};
}

Case large_belief_case(Device& device, const std::vector<Hypothesis>& letters) {
  const PoseLattice lattice = lattice_of(200, 200, 250);
  PoseHistogram histogram(device, letters,
                          HistogramOptions{.lattice = lattice, .touch_sd = touch_sd});
  Touches touches;
  const double seconds = seconds_of([&] { histogram.update(touches.next()); });
  return {.name = "touch " + size_of(lattice),
          .facts = {{"objects", letters.size()}, {"touch_sd", "1 mm, 0.05 rad"}},
          .measurements = {
              {"device memory", mib(histogram.device_bytes()), "MiB", at_most(most_memory_mib)},
              {"uncertain touch", seconds, "s"}}};
}

}  // namespace palpate::bench
