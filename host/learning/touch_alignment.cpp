#include "learning/touch_alignment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>
#include <glm/geometric.hpp>

#include "learning/predictive_map.hpp"
#include "learning/progress.hpp"

namespace palpate {

namespace {

/// x and y in mm and an angle in rad.
using Axes = std::array<double, 3>;

Pose pose_of(const Axes& at) { return {{at[0], at[1]}, at[2]}; }

struct Moments {
  Axes mean{};
  Axes variance{};
};

/// Points about a centre, equally far apart along each axis: `steps` to either side.
struct Grid {
  Axes centre{};
  Axes half{};  ///< 0: one point along this axis
  int steps = 0;
};

/// The mean and variance of a displacement under prior times likelihood, over the points of a grid.
template <typename LogLikelihood>
Moments moments(const Grid& grid, const Axes& prior_sd, const LogLikelihood& log_likelihood) {
  std::vector<std::pair<Axes, double>> points;
  double most = -std::numeric_limits<double>::infinity();
  const auto last = [&](std::size_t axis) { return grid.half[axis] > 0.0 ? grid.steps : 0; };
  for (int a = -last(2); a <= last(2); ++a) {
    for (int y = -last(1); y <= last(1); ++y) {
      for (int x = -last(0); x <= last(0); ++x) {
        const Axes index{static_cast<double>(x), static_cast<double>(y), static_cast<double>(a)};
        Axes at = grid.centre;
        double nats = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
          at[k] += grid.half[k] * index[k] / grid.steps;
          const double z = prior_sd[k] > 0.0 ? at[k] / prior_sd[k] : 0.0;
          nats -= 0.5 * z * z;
        }
        nats += log_likelihood(pose_of(at));
        most = std::max(most, nats);
        points.emplace_back(at, nats);
      }
    }
  }
  Moments result;
  double sum = 0.0;
  for (const auto& [at, nats] : points) {
    const double weight = std::exp(nats - most);
    sum += weight;
    for (std::size_t k = 0; k < 3; ++k) {
      result.mean[k] += weight * at[k];
      result.variance[k] += weight * at[k] * at[k];
    }
  }
  for (std::size_t k = 0; k < 3; ++k) {
    result.mean[k] /= sum;
    result.variance[k] = std::max(0.0, result.variance[k] / sum - result.mean[k] * result.mean[k]);
  }
  return result;
}

/// The posterior of a displacement: over the prior's width, then about what is found there.
template <typename LogLikelihood>
Moments posterior(const DisplacementSd& sd, const LogLikelihood& log_likelihood) {
  constexpr double reach = 2.4;       // in standard deviations
  constexpr double least_step = 0.2;  // of the wide grid's: it tells no smaller deviation
  const Axes prior_sd{sd.mm, sd.mm, sd.rad};
  Grid wide{.steps = 4};
  for (std::size_t k = 0; k < 3; ++k) {
    wide.half[k] = reach * prior_sd[k];
  }
  const Moments rough = moments(wide, prior_sd, log_likelihood);
  Grid near{.centre = rough.mean, .steps = 3};
  for (std::size_t k = 0; k < 3; ++k) {
    const double step = wide.half[k] / wide.steps;
    near.half[k] = std::max(2.0 * std::sqrt(rough.variance[k]), near.steps * least_step * step);
  }
  return moments(near, prior_sd, log_likelihood);
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
