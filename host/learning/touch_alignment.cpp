#include "learning/touch_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include "learning/local_search.hpp"
#include "learning/progress.hpp"
#include "model/bounding_box.hpp"

namespace palpate {

namespace {

/// x and y in mm and an angle in rad.
Pose pose_of(const glm::dvec3& at) { return {{at.x, at.y}, at.z}; }

/// The mean and variance of a displacement under prior times likelihood, over a grid about a
/// centre.
/// @param half of the grid's edges; 0: one point along this axis
/// @param steps to either side
template <typename LogLikelihood>
Moments moments(const glm::dvec3& centre, const glm::dvec3& half, int steps,
                const DisplacementSd& sd, const LogLikelihood& log_likelihood) {
  const glm::dvec3 prior_sd{sd.mm, sd.mm, sd.rad};
  std::vector<std::pair<glm::dvec3, double>> points;
  visit_grid(steps * glm::ivec3(glm::greaterThan(half, glm::dvec3(0.0))),
             [&](const glm::dvec3& index) {
               const glm::dvec3 at = centre + half * index / (1.0 * steps);
               double nats = 0.0;
               for (int k = 0; k < 3; ++k) {
                 nats -= prior_sd[k] > 0.0 ? 0.5 * std::pow(at[k] / prior_sd[k], 2.0) : 0.0;
               }
               points.emplace_back(at, nats + log_likelihood(pose_of(at)));
             });
  return Moments(points);
}

/// The posterior of a displacement: over the prior's width, then about what is found there.
template <typename LogLikelihood>
Moments posterior(const DisplacementSd& sd, const LogLikelihood& log_likelihood) {
  constexpr double reach = 2.4;  // in standard deviations
  constexpr int steps = 4;
  constexpr int near_steps = 3;
  constexpr double least_step = 0.2;  // of the wide grid's: it tells no smaller deviation
  const glm::dvec3 half = reach * glm::dvec3(sd.mm, sd.mm, sd.rad);
  const Moments rough = moments({}, half, steps, sd, log_likelihood);
  const glm::dvec3 near_half =
      glm::max(2.0 * glm::sqrt(rough.variance), near_steps * least_step * half / (1.0 * steps));
  return moments(rough.mean, near_half, near_steps, sd, log_likelihood);
}

/// Moves all poses by the one rigid motion that brings them nearest to the reported ones, weighed
/// by the standard deviations.
void keep_together(std::vector<Pose>& poses, std::span<const Pose> reported,
                   const DisplacementSd& sd) {
  const auto count = static_cast<double>(poses.size());
  glm::dvec2 middle{0.0};
  glm::dvec2 shift{0.0};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    middle += poses[i].translation_mm / count;
    shift += (reported[i].translation_mm - poses[i].translation_mm) / count;
  }
  double turn = 0.0;
  double weight = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const glm::dvec2 arm = poses[i].translation_mm - middle;
    const glm::dvec2 d = reported[i].translation_mm - poses[i].translation_mm;
    turn += sd.rad * sd.rad * (arm.x * d.y - arm.y * d.x) +
            sd.mm * sd.mm * (reported[i].theta_rad - poses[i].theta_rad);
    weight += sd.rad * sd.rad * glm::dot(arm, arm) + sd.mm * sd.mm;
  }
  // What has no deviation stays, which holds the frame.
  turn = sd.mm > 0.0 && sd.rad > 0.0 ? turn / weight : 0.0;
  shift = sd.mm > 0.0 ? shift : glm::dvec2(0.0);
  for (Pose& pose : poses) {
    pose.translation_mm +=
        shift + rotate(turn, pose.translation_mm - middle) - (pose.translation_mm - middle);
    pose.theta_rad += turn;
  }
}

/// How far poses lie from others, root mean square of each axis.
DisplacementSd apart(std::span<const Pose> poses, std::span<const Pose> others) {
  DisplacementSd squares;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const glm::dvec2 d = poses[i].translation_mm - others[i].translation_mm;
    squares.mm += glm::dot(d, d) / 2.0;
    squares.rad += std::pow(poses[i].theta_rad - others[i].theta_rad, 2.0);
  }
  const auto count = static_cast<double>(poses.size());
  return {std::sqrt(squares.mm / count), std::sqrt(squares.rad / count)};
}

constexpr int most_rounds = 8;

/// Aligns the touches of one object.
/// @param done is called for every touch of a round
TouchAlignment align(ObjectTouches& object, const DisplacementSd& sd, const MapOptions& options,
                     const std::function<void()>& done) {
  constexpr double settled = 0.05;  // in standard deviations
  std::vector<Touch>& touches = object.touches;
  std::vector<Pose> reported;
  for (const Touch& touch : touches) {
    reported.push_back(touch.T_robot_sensor);
  }
  std::vector<Pose> poses = reported;
  const auto count = static_cast<double>(touches.size());
  TouchAlignment result;
  for (bool moving = true; moving && result.rounds < most_rounds; ++result.rounds) {
    const std::vector<Pose> before = poses;
    DisplacementSd variance;
    PredictiveMap map(touches, options);
    for (std::size_t i = 0; i < touches.size(); ++i) {
      map.take_out(i);
      const Moments found = posterior(sd, [&](const Pose& displacement) {
        return map.log_likelihood(i, reported[i] * displacement);
      });
      poses[i] = reported[i] * pose_of(found.mean);
      map.put_in(i, poses[i]);
      variance.mm += (found.variance[0] + found.variance[1]) / (2.0 * count);
      variance.rad += found.variance[2] / count;
      done();
    }
    keep_together(poses, reported, sd);
    for (std::size_t i = 0; i < touches.size(); ++i) {
      touches[i].T_robot_sensor = poses[i];
    }
    const DisplacementSd step = apart(poses, before);
    moving = step.mm > settled * sd.mm || step.rad > settled * sd.rad;
    result.moved = apart(poses, reported);
    result.displaced = {std::hypot(result.moved.mm, std::sqrt(variance.mm)),
                        std::hypot(result.moved.rad, std::sqrt(variance.rad))};
  }
  return result;
}

/// The root mean square over the touches of all objects.
DisplacementSd pooled(std::span<const ObjectTouches> objects,
                      std::span<const TouchAlignment> alignments,
                      DisplacementSd TouchAlignment::*of) {
  DisplacementSd squares;
  double count = 0.0;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    const auto touches = static_cast<double>(objects[k].touches.size());
    const DisplacementSd& own = alignments[k].*of;
    squares.mm += touches * own.mm * own.mm;
    squares.rad += touches * own.rad * own.rad;
    count += touches;
  }
  return {std::sqrt(squares.mm / count), std::sqrt(squares.rad / count)};
}

}  // namespace

PredictiveMap::PredictiveMap(std::span<const Touch> touches, const MapOptions& options)
    : options_(options) {
  contact_.prior = options.sensor.prior;
  BoundingBox box;
  for (const Touch& touch : touches) {
    Touch in_sensor_frame = touch;
    in_sensor_frame.T_robot_sensor = {};
    known_.push_back(known_readings(in_sensor_frame, options.classifier));
    for (const ElementReading& element : known_.back()) {
      box.take_in(touch.T_robot_sensor * element.position_mm);
    }
  }
  constexpr double tolerance = 1e-3;  // nats
  constexpr int nodes = 1024;         // increments between them are linear within 1e-4 nats
  radius_mm_ = options.sensor.support_radius_mm(1, tolerance);
  for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
    for (int node = 0; node <= nodes + 1; ++node) {
      increments_[is_contact(reading) ? 1 : 0].push_back(
          options.sensor.increment(reading, radius_mm_ * std::sqrt(node / double{nodes})));
    }
  }
  if (!box.empty()) {
    cells_ = cover(box.lower, box.upper, radius_mm_, options.cell_mm);
  }
  log_odds_.assign(static_cast<std::size_t>(cells_.nx * cells_.ny),
                   log_odds_from_probability(options.sensor.prior));
  T_robot_sensor_.resize(touches.size());
  for (std::size_t i = 0; i < touches.size(); ++i) {
    put_in(i, touches[i].T_robot_sensor);
  }
}

void PredictiveMap::put_in(std::size_t touch, const Pose& T_robot_sensor) {
  T_robot_sensor_[touch] = T_robot_sensor;
  add(touch, 1.0);
}

void PredictiveMap::add(std::size_t touch, double times) {
  for (const ElementReading& element : known_[touch]) {
    visit_near(cells_, options_.cell_mm, T_robot_sensor_[touch] * element.position_mm, radius_mm_,
               [&](std::size_t cell, double squared) {
                 log_odds_[cell] += times * increment(element.reading, squared);
               });
  }
}

double PredictiveMap::increment(Reading reading, double squared_mm) const {
  const std::vector<double>& of_class = increments_[is_contact(reading) ? 1 : 0];
  const double place =
      squared_mm / (radius_mm_ * radius_mm_) * static_cast<double>(of_class.size() - 2);
  const auto node = static_cast<std::size_t>(place);
  return std::lerp(of_class[node], of_class[node + 1], place - static_cast<double>(node));
}

double PredictiveMap::log_likelihood(std::size_t touch, const Pose& T_robot_sensor) const {
  // The axes of all elements; rotating each would take the sine and cosine anew.
  const glm::dvec2 x = rotate(T_robot_sensor.theta_rad, {1.0, 0.0});
  const glm::dvec2 y{-x.y, x.x};
  double sum = 0.0;
  for (const ElementReading& element : known_[touch]) {
    const glm::dvec2 p =
        T_robot_sensor.translation_mm + element.position_mm.x * x + element.position_mm.y * y;
    sum += contact_.log_likelihood(element.reading, {log_odds(p)});
  }
  return sum;
}

double PredictiveMap::log_odds(const glm::dvec2& p_robot_mm) const {
  const glm::dvec2 place = p_robot_mm / options_.cell_mm;
  const glm::dvec2 first = glm::floor(place);
  const auto i = static_cast<std::int64_t>(first.x);
  const auto j = static_cast<std::int64_t>(first.y);
  if (!cells_.contains({i, j, 2, 2})) {
    return log_odds_from_probability(options_.sensor.prior);
  }
  const double* low = &log_odds_[cells_.index(i, j)];
  const double* high = low + cells_.nx;
  const glm::dvec2 f = place - first;
  return std::lerp(std::lerp(low[0], low[1], f.x), std::lerp(high[0], high[1], f.x), f.y);
}

TouchAlignment align_touches(std::span<ObjectTouches> objects, const DisplacementSd& sd,
                             MapOptions options, const std::function<void(double)>& progress) {
  options.sensor.prior = 0.5;
  options.validate();
  std::size_t touches = 0;
  for (const ObjectTouches& object : objects) {
    touches += object.touches.size();
  }
  if (sd.none() || touches == 0) {
    return {};
  }
  Progress shown(touches * most_rounds, progress);
  std::vector<TouchAlignment> alignments(objects.size());
  tbb::parallel_for(std::size_t{0}, objects.size(), [&](std::size_t k) {
    alignments[k] = align(objects[k], sd, options, [&] { shown.add(); });
  });
  TouchAlignment result{.moved = pooled(objects, alignments, &TouchAlignment::moved),
                        .displaced = pooled(objects, alignments, &TouchAlignment::displaced)};
  for (const TouchAlignment& own : alignments) {
    result.rounds = std::max(result.rounds, own.rounds);
  }
  return result;
}

}  // namespace palpate
