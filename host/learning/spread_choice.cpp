#include "learning/spread_choice.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <vector>

#include <tbb/parallel_for.h>

#include "learning/predictive_map.hpp"

namespace palpate {

namespace {

/// Of every touch on the map of the others, object by object.
std::vector<double> left_out_nats(std::span<const ObjectTouches> objects,
                                  const MapOptions& options) {
  std::vector<std::vector<double>> of_object(objects.size());
  tbb::parallel_for(std::size_t{0}, objects.size(), [&](std::size_t k) {
    const std::vector<Touch>& touches = objects[k].touches;
    PredictiveMap map(touches, options);
    for (std::size_t i = 0; i < touches.size(); ++i) {
      map.take_out(i);
      of_object[k].push_back(map.log_likelihood(i, touches[i].T_robot_sensor));
      map.put_in(i, touches[i].T_robot_sensor);
    }
  });
  std::vector<double> all;
  for (const std::vector<double>& own : of_object) {
    all.insert(all.end(), own.begin(), own.end());
  }
  return all;
}

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Whether the touches are more likely beyond chance, and by enough to matter.
bool clearly_better(std::span<const double> nats, std::span<const double> before) {
  constexpr double standard_errors = 3.0;
  constexpr double share = 0.1;
  const double gain = mean(nats) - mean(before);
  double squares = 0.0;
  for (std::size_t i = 0; i < nats.size(); ++i) {
    squares += std::pow(nats[i] - before[i] - gain, 2.0);
  }
  const double error = std::sqrt(squares) / static_cast<double>(nats.size());
  return gain > standard_errors * error && gain > share * std::abs(mean(before));
}

}  // namespace

SpreadChoice choose_spread(std::span<const ObjectTouches> objects, const MapOptions& options) {
  constexpr int most_steps = 6;  // to an eighth and to eight times the default
  const auto spread = [&](int step) {
    return options.sensor.spread_mm * std::pow(std::numbers::sqrt2, step);
  };
  std::map<int, std::vector<double>> tried;
  const auto nats_at = [&](int step) -> const std::vector<double>& {
    const auto [place, is_new] = tried.try_emplace(step);
    if (is_new) {
      MapOptions other = options;
      other.sensor.spread_mm = spread(step);
      place->second = left_out_nats(objects, other);
    }
    return place->second;
  };
  int best = 0;
  for (const int direction : {-1, 1}) {
    while (std::abs(best + direction) <= most_steps && !nats_at(best).empty() &&
           mean(nats_at(best + direction)) > mean(nats_at(best))) {
      best += direction;
    }
  }
  SpreadChoice choice{options.sensor.spread_mm, 0.0, spread(tried.begin()->first),
                      spread(tried.rbegin()->first)};
  if (clearly_better(nats_at(best), nats_at(0))) {
    choice.spread_mm = spread(best);
    choice.gain_nats = mean(nats_at(best)) - mean(nats_at(0));
  }
  return choice;
}

}  // namespace palpate
