#include "palpate/fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {

namespace {

/// The map's log odds, interpolated bilinearly; every cell beyond the map holds the prior's.
class LogOdds {
 public:
  LogOdds(const OccupancyGrid& map, double prior)
      : map_(map), beyond_(log_odds_from_probability(prior)) {}

  double at(const glm::dvec2& p_object_mm) const {
    const glm::dvec2 place = (p_object_mm - map_.origin_mm) / map_.cell_mm;
    const double column = std::floor(place.x);
    const double row = std::floor(place.y);
    // In doubles: the place may lie beyond what an int holds.
    if (!(column >= -1.0 && column < map_.nx && row >= -1.0 && row < map_.ny)) {
      return beyond_;
    }
    const auto i = static_cast<int>(column);
    const auto j = static_cast<int>(row);
    const double fx = place.x - column;
    return std::lerp(std::lerp(cell(i, j), cell(i + 1, j), fx),
                     std::lerp(cell(i, j + 1), cell(i + 1, j + 1), fx), place.y - row);
  }

 private:
  double cell(int i, int j) const {
    const bool inside = i >= 0 && i < map_.nx && j >= 0 && j < map_.ny;
    return inside ? static_cast<double>(map_.at(i, j)) : beyond_;
  }

  const OccupancyGrid& map_;
  double beyond_;
};

/// Sums over the known elements.
struct Sums {
  double deviation = 0.0;  ///< of the log-likelihood from its predicted mean, in nats
  double variance = 0.0;   ///< predicted

  void add(Reading reading, double log_odds, const ContactModel& model, std::size_t object) {
    const std::size_t levels = model.table ? model.table->levels() : 2;
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
  const LogOdds log_odds(map, *model.prior);
  Sums sums;
  bool any_known = false;
  for (const Touch& touch : touches) {
    const std::vector<Reading> readings = model.classify(touch);
    const Pose T_object_sensor = T_object_robot * touch.T_robot_sensor;
    for (std::size_t e = 0; e < readings.size(); ++e) {
      if (readings[e] != Reading::unknown) {
        sums.add(readings[e], log_odds.at(T_object_sensor * touch.elements_mm[e]), model, object);
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
