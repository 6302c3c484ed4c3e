#include "learning/spread_choice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <vector>

#include <tbb/parallel_for.h>
#include <glm/geometric.hpp>

#include "learning/predictive_map.hpp"

namespace palpate {

namespace {

/// What the map of the others says of a left-out touch.
using Score = double (*)(const PredictiveMap& map, std::size_t touch, const Pose& T_robot_sensor);

double likelihood(const PredictiveMap& map, std::size_t touch, const Pose& T_robot_sensor) {
  return map.log_likelihood(touch, T_robot_sensor);
}

/// Minus the distance in mm from the touch's place to the mean of where it seems to be, among
/// places around its own.
double place(const PredictiveMap& map, std::size_t touch, const Pose& T_robot_sensor) {
  constexpr int steps = 4;  // to either side
  constexpr double step_mm = 0.3;
  constexpr double step_rad = 0.1;
  constexpr double farthest = 600.0;  // nats; exp() is finite
  const double own = map.log_likelihood(touch, T_robot_sensor);
  double sum = 0.0;
  glm::dvec2 mean_mm{0.0};
  for (int a = -2; a <= 2; ++a) {
    for (int y = -steps; y <= steps; ++y) {
      for (int x = -steps; x <= steps; ++x) {
        const Pose beside{{step_mm * x, step_mm * y}, step_rad * a};
        const double nats = map.log_likelihood(touch, T_robot_sensor * beside) - own;
        const double weight = std::exp(std::min(nats, farthest));
        sum += weight;
        mean_mm += weight * beside.translation_mm;
      }
    }
  }
  return -glm::length(mean_mm) / sum;
}

/// The touches at one's place, itself among them: turned there, an array has elements where it had
/// others, which a map of the narrowest spread would predict.
std::vector<std::size_t> at_place_of(std::size_t touch, std::span<const Touch> touches) {
  constexpr double near_mm = 1.0;
  const auto middle = [&](std::size_t i) {
    return touches[i].T_robot_sensor * array_centre_mm(touches[i].elements_mm);
  };
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (glm::distance(middle(i), middle(touch)) < near_mm) {
      found.push_back(i);
    }
  }
  return found;
}

/// A score of every touch, object by object.
std::vector<double> left_out(std::span<const ObjectTouches> objects, const MapOptions& options,
                             Score score) {
  std::vector<std::vector<double>> of_object(objects.size());
  tbb::parallel_for(std::size_t{0}, objects.size(), [&](std::size_t k) {
    const std::vector<Touch>& touches = objects[k].touches;
    PredictiveMap map(touches, options);
    for (std::size_t i = 0; i < touches.size(); ++i) {
      const std::vector<std::size_t> out = at_place_of(i, touches);
      for (const std::size_t touch : out) {
        map.take_out(touch);
      }
      of_object[k].push_back(score(map, i, touches[i].T_robot_sensor));
      for (const std::size_t touch : out) {
        map.put_in(touch, touches[touch].T_robot_sensor);
      }
    }
  });
  std::vector<double> all;
  for (const std::vector<double>& own : of_object) {
    all.insert(all.end(), own.begin(), own.end());
  }
  return all;
}

/// The mean gain of a score over another's; none where chance may explain it.
std::optional<double> gain_of(std::span<const double> scores, std::span<const double> before) {
  constexpr double standard_errors = 3.0;
  const auto count = static_cast<double>(scores.size());
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const double gain = scores[i] - before[i];
    sum += gain;
    squares += gain * gain;
  }
  const double gain = sum / count;
  const double error = std::sqrt((squares / count - gain * gain) / count);
  return gain > standard_errors * error ? std::optional(gain) : std::nullopt;
}

}  // namespace

SpreadChoice choose_spread(std::span<const ObjectTouches> objects, const MapOptions& options) {
  constexpr int most_steps = 6;  // to eight times the default, and to an eighth
  constexpr double least_share = 0.1;
  const auto distance_mm = [](std::span<const double> places) {
    return -std::accumulate(places.begin(), places.end(), 0.0) / static_cast<double>(places.size());
  };
  SpreadChoice choice{.spread_mm = options.sensor.spread_mm};
  const std::size_t touches = std::accumulate(
      objects.begin(), objects.end(), std::size_t{0},
      [](std::size_t sum, const ObjectTouches& object) { return sum + object.touches.size(); });
  if (touches < least_spread_touches) {
    return choice;
  }
  const std::vector<double> likelihoods = left_out(objects, options, likelihood);
  for (const double factor : {1.0 / std::numbers::sqrt2, std::numbers::sqrt2}) {
    MapOptions now = options;
    std::vector<double> best = likelihoods;
    std::vector<double> best_places;  // while they are empty, no other spread was more likely
    for (int step = 0; step < most_steps; ++step) {
      MapOptions next = now;
      next.sensor.spread_mm *= factor;
      const std::vector<double> nats = left_out(objects, next, likelihood);
      const std::optional<double> more_likely = gain_of(nats, best);
      if (!more_likely) {
        break;
      }
      if (best_places.empty()) {
        best_places = left_out(objects, now, place);
      }
      const std::vector<double> places = left_out(objects, next, place);
      const std::optional<double> better_placed = gain_of(places, best_places);
      if (!better_placed || *better_placed < least_share * distance_mm(best_places)) {
        break;
      }
      choice.spread_mm = next.sensor.spread_mm;
      choice.likelihood_gain += *more_likely;
      choice.place_gain_mm += *better_placed;
      now = next;
      best = nats;
      best_places = places;
    }
    if (choice.likelihood_gain > 0.0) {
      break;
    }
  }
  return choice;
}

}  // namespace palpate
