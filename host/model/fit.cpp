#include "palpate/fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "interpolated_map.hpp"
#include "predicted_readings.hpp"

namespace palpate {

namespace {

/// Sums over the known elements.
struct Sums {
  double deviation = 0.0;  ///< of the log-likelihood from its predicted mean, in nats
  double variance = 0.0;   ///< predicted

  void add(Reading reading, double log_odds, const ContactModel& model, std::size_t object) {
    const std::size_t levels = reading_levels(model);
    std::array<double, most_reading_levels> log_p{};
    for (std::size_t level = 0; level < levels; ++level) {
      log_p[level] = model.log_likelihood(static_cast<Reading>(level), {log_odds}, object);
    }
    const double most = *std::max_element(log_p.begin(), log_p.begin() + levels);
    std::array<double, most_reading_levels> q{};
    double total = 0.0;
    for (std::size_t level = 0; level < levels; ++level) {
      total += q[level] = std::exp(log_p[level] - most);
    }
    double below_most = 0.0;  // the mean, relative to the largest: no cancellation
    for (std::size_t level = 0; level < levels; ++level) {
      q[level] /= total;
      below_most += q[level] * (log_p[level] - most);
    }
    deviation += log_p[static_cast<std::size_t>(reading)] - most - below_most;
    for (std::size_t level = 0; level < levels; ++level) {
      const double from_mean = log_p[level] - most - below_most;
      variance += q[level] * from_mean * from_mean;
    }
  }
};

Verdict verdict_on(double z) {
  return z >= fits_from_z       ? Verdict::fits
         : z >= doubtful_from_z ? Verdict::doubtful
                                : Verdict::does_not_fit;
}

}  // namespace

std::optional<Fit> fit_of(std::span<const Touch> touches, const Pose& T_object_robot,
                          const OccupancyGrid& map, const ContactModel& contact,
                          std::size_t object) {
  ContactModel model = contact;
  model.prior = contact.prior.value_or(map.prior);
  const InterpolatedMap interpolated(map, *model.prior);
  Sums sums;
  bool any_known = false;
  for (const Touch& touch : touches) {
    const std::vector<Reading> readings = model.classify(touch);
    const Pose T_object_sensor = T_object_robot * touch.T_robot_sensor;
    for (std::size_t e = 0; e < readings.size(); ++e) {
      if (readings[e] != Reading::unknown) {
        sums.add(readings[e], interpolated.log_odds(T_object_sensor * touch.elements_mm[e]), model,
                 object);
        any_known = true;
      }
    }
  }
  if (!any_known) {
    return {};
  }
  // Where nothing else is possible, readings may be as predicted with a variance of 0.
  const double z = sums.deviation == 0.0 ? 0.0
                                         : std::clamp(sums.deviation / std::sqrt(sums.variance),
                                                      -largest_fit_z, largest_fit_z);
  return Fit{.z = z, .verdict = verdict_on(z)};
}

}  // namespace palpate
