#include "touch_by_touch_data.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

const std::vector<Hypothesis>& two_maps() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 12.0, 71), 2.0},
                                           {random_map(23, 29, 0.5, 12.0, 72), 1.0}};
  return two;
}

PoseLattice small_lattice() {
  return {.x_mm = {-5.0, 6.0, 11},
          .y_mm = {-4.0, 5.0, 13},
          .theta_rad = {0, two_pi, 16},
          .pivot_mm = {3.0, -2.0}};
}

std::vector<std::vector<Logs>> reference_touches(const HistogramOptions& options,
                                                 std::span<const Touch> touches) {
  std::vector<std::vector<Logs>> logs;
  for (const Touch& touch : touches) {
    logs.emplace_back();
    for (std::size_t object = 0; object < two_maps().size(); ++object) {
      logs.back().push_back(reference::displaced_touch(
          reference::log_likelihoods(std::span(&touch, 1), options.lattice, two_maps()[object].map,
                                     options.contact, object),
          options.lattice, options.touch_sd, touch.T_robot_sensor));
    }
  }
  return logs;
}

reference::Posterior expected_posterior(const HistogramOptions& options,
                                        std::span<const std::vector<Logs>> logs) {
  reference::Posterior posterior{.lattice = options.lattice, .log_likelihood = {}, .weight = {}};
  for (std::size_t object = 0; object < two_maps().size(); ++object) {
    Logs belief(static_cast<std::size_t>(options.lattice.bins()), 0.0);
    for (std::size_t i = 0; i < logs.size(); ++i) {
      if (i > 0 && !options.slip_sd.none()) {
        belief = reference::slipped(belief, options.lattice, options.slip_sd,
                                    reference::body_of(two_maps()[object].map).centroid_mm);
      }
      for (std::size_t bin = 0; bin < belief.size(); ++bin) {
        belief[bin] += logs[i][object][bin];
      }
    }
    posterior.log_likelihood.push_back(belief);
    posterior.weight.push_back(two_maps()[object].weight);
  }
  return posterior;
}

reference::Posterior expected_posterior(const HistogramOptions& options,
                                        std::span<const Touch> touches) {
  return expected_posterior(options, reference_touches(options, touches));
}

double expected_log_odds_of_none(const HistogramOptions& options, std::span<const Touch> touches,
                                 const std::vector<std::vector<Logs>>& by_touch) {
  HistogramOptions as_if_exact = options;
  as_if_exact.touch_sd = {};
  const reference::Posterior posterior =
      expected_posterior(options, std::span(by_touch).first(touches.size()));
  std::vector<double> evidence;
  for (std::size_t i = 0; i < two_maps().size(); ++i) {
    const Logs& logs = posterior.log_likelihood[i];
    const double most = *std::max_element(logs.begin(), logs.end());
    double sum = 0.0;
    for (const double l : logs) {
      sum += std::exp(l - most);
    }
    evidence.push_back(std::log(two_maps()[i].weight / static_cast<double>(logs.size())) + most +
                       std::log(sum));
  }
  const double most = *std::max_element(evidence.begin(), evidence.end());
  double sum = 0.0;
  for (const double e : evidence) {
    sum += std::exp(e - most);
  }
  return std::log(*options.none_weight) +
         reference::none_log_evidence(touches, options.lattice, two_maps(),
                                      reference_touches(as_if_exact, touches)) -
         most - std::log(sum);
}

double log_odds_of_none(const PoseHistogram& histogram) {
  const double none = histogram.estimate().none;
  return std::log(none / (1.0 - none));
}

}  // namespace palpate
