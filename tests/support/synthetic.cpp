#include "support/synthetic.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

namespace palpate {

double Uniform::operator()(double lower, double upper) {
  // SplitMix64 (Steele, Lea and Flood 2014).
  state_ += 0x9E3779B97F4A7C15;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  z ^= z >> 31;
  return lower + (upper - lower) * (static_cast<double>(z >> 11) * 0x1p-53);
}

Recording random_recording(std::size_t touches, std::size_t elements, std::uint64_t seed) {
  Uniform random(seed);
  Recording recording;
  for (std::size_t k = 0; k < elements; ++k) {
    recording.elements_mm.emplace_back(random(-6.0, 6.0), random(-6.0, 6.0));
  }
  for (std::size_t i = 0; i < touches; ++i) {
    recording.T_robot_sensor.push_back(
        {{random(-8.0, 8.0), random(-8.0, 8.0)}, random(-std::numbers::pi, std::numbers::pi)});
    for (std::size_t k = 0; k < elements; ++k) {
      // The ratio test asks for at least 0.3 * 20 = 6 kPa, the threshold for 2.
      const double kind = k == 0 ? 0.0 : random(0.0, 3.0);
      recording.pressure.push_back(kind < 1.0   ? random(6.1, 20.0)
                                   : kind < 2.0 ? random(0.0, 1.8)
                                                : 2.0);
    }
  }
  return recording;
}

OccupancyGrid random_map(int nx, int ny, double cell_mm, double steepness, std::uint64_t seed) {
  Uniform random(seed);
  OccupancyGrid map{.label = "made up",
                    .cell_mm = cell_mm,
                    .origin_mm = -cell_mm * glm::dvec2(nx / 2, ny / 2),
                    .nx = nx,
                    .ny = ny};
  for (int cell = 0; cell < nx * ny; ++cell) {
    map.log_odds.push_back(static_cast<float>(random(-steepness, steepness)));
  }
  return map;
}

std::vector<Hypothesis> two_objects(double steepness, std::uint64_t seed) {
  return {{random_map(31, 27, 0.5, steepness, seed), 1.0},
          {random_map(27, 33, 0.5, steepness, seed + 1), 1.0}};
}

std::vector<Touch> all_touches(const Recording& recording) {
  return recording.touches(0, recording.size());
}

Recording moved(Recording recording, const Pose& T_moved_robot) {
  for (Pose& pose : recording.T_robot_sensor) {
    pose = T_moved_robot * pose;
  }
  return recording;
}

double sum(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

double largest_difference(std::span<const double> a, std::span<const double> b) {
  if (a.size() != b.size()) {
    return std::numeric_limits<double>::infinity();
  }
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double difference = std::abs(a[i] - b[i]);
    // A difference that is not a number must not pass for a small one.
    most = difference <= most ? most : difference;
  }
  return most;
}

double log_sum(std::span<const double> logs) {
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double l : logs) {
    sum += std::exp(l - most);
  }
  return most + std::log(sum);
}

reference::Posterior reference_posterior(std::span<const Hypothesis> hypotheses,
                                         const HistogramOptions& options,
                                         std::span<const Touch> touches) {
  reference::Posterior posterior{.lattice = options.lattice, .log_likelihood = {}, .weight = {}};
  for (std::size_t object = 0; object < hypotheses.size(); ++object) {
    const Hypothesis& hypothesis = hypotheses[object];
    const auto of_touches = [&](std::span<const Touch> some) {
      return reference::log_likelihoods(some, options.lattice, hypothesis.compared(),
                                        options.contact, object);
    };
    std::vector<double>& logs = posterior.log_likelihood.emplace_back();
    if (options.touch_sd.none() && options.slip_sd.none()) {
      logs = of_touches(touches);
    } else {
      logs.resize(static_cast<std::size_t>(options.lattice.bins()));
      const glm::dvec2 centroid_mm = reference::body_of(hypothesis.map).centroid_mm;
      for (std::size_t i = 0; i < touches.size(); ++i) {
        if (i > 0 && !options.slip_sd.none()) {
          logs = reference::slipped(logs, options.lattice, options.slip_sd, centroid_mm);
        }
        const std::vector<double> mean =
            reference::displaced_touch(of_touches(touches.subspan(i, 1)), options.lattice,
                                       options.touch_sd, touches[i].T_robot_sensor);
        std::ranges::transform(logs, mean, logs.begin(), std::plus());
      }
    }
    posterior.weight.push_back(hypothesis.weight);
  }
  return posterior;
}

double likelihood_error(const PoseHistogram& histogram, const reference::Posterior& expected) {
  double most = 0.0;
  for (std::size_t object = 0; object < expected.weight.size(); ++object) {
    most = std::max(most, largest_difference(histogram.log_likelihood(static_cast<int>(object)),
                                             expected.log_likelihood[object]));
  }
  return most;
}

double map_error(const OccupancyGrid& map, std::span<const Touch> touches,
                 const MapOptions& options) {
  constexpr int around = 5;
  OccupancyGrid wider;
  wider.cell_mm = map.cell_mm;
  wider.origin_mm = map.origin_mm - map.cell_mm * glm::dvec2(around);
  wider.nx = map.nx + 2 * around;
  wider.ny = map.ny + 2 * around;
  std::vector<double> product;
  for (int j = -around; j < map.ny + around; ++j) {
    for (int i = -around; i < map.nx + around; ++i) {
      const bool inside = i >= 0 && i < map.nx && j >= 0 && j < map.ny;
      product.push_back(inside ? map.at(i, j) : map.prior_log_odds());
    }
  }
  return largest_difference(
      product, reference::log_odds_map(touches, wider, options.classifier, options.sensor));
}

}  // namespace palpate
