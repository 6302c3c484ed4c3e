#include "recognition/displacement_population.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>

namespace palpate {

namespace {

/// |d|^2 / sd^2 and alpha^2 / sd^2, summed over the touches.
std::array<double, 2> squares(const std::vector<Pose>& displacements, const DisplacementSd& sd) {
  std::array<double, 2> sums{};
  for (const Pose& displacement : displacements) {
    sums[0] += glm::dot(displacement.translation_mm, displacement.translation_mm);
    sums[1] += displacement.theta_rad * displacement.theta_rad;
  }
  return {sums[0] / (sd.mm * sd.mm), sums[1] / (sd.rad * sd.rad)};
}

}  // namespace

DisplacementPopulation::DisplacementPopulation(std::span<const LivingElements> touches,
                                               std::span<const SmoothOccupancy> objects,
                                               const ReadingModel& readings,
                                               const PoseLattice& region,
                                               std::span<const PoseSample> starts,
                                               std::uint64_t seed)
    : touches_(touches),
      objects_(objects),
      readings_(readings),
      region_(region),
      random_(seed, Stream::belief) {
  const auto n = static_cast<double>(touches.size());
  for (const LivingElements& touch : touches) {
    middle_mm_ += touch.T_robot_sensor.translation_mm / n;
  }
  for (const LivingElements& touch : touches) {
    const glm::dvec2 arm = touch.T_robot_sensor.translation_mm - middle_mm_;
    spread_mm2_ += glm::dot(arm, arm);
  }
  for (const PoseSample& start : starts) {
    Sample& sample = samples_.emplace_back(Sample{.object = start.object,
                                                  .T_object_robot = start.T_object_robot,
                                                  .displacement = std::vector<Pose>(touches.size()),
                                                  .log_likelihood = {}});
    for (std::size_t i = 0; i < touches.size(); ++i) {
      sample.log_likelihood.push_back(likelihood(sample, sample.T_object_robot, i, Pose{}));
    }
  }
}

double DisplacementPopulation::likelihood(const Sample& sample, const Pose& T_object_robot,
                                          std::size_t touch, const Pose& displacement) const {
  double nats = 0.0;
  objects_[sample.object].sample(touches_[touch],
                                 T_object_robot * touches_[touch].T_robot_sensor * displacement,
                                 [&](const LivingElements::Element& element, double occupancy) {
                                   nats += readings_.log_probability(element.reading, occupancy);
                                 });
  return nats;
}

bool DisplacementPopulation::accepts(double log_ratio) {
  return log_ratio >= 0.0 || random_.uniform() < std::exp(log_ratio);
}

Pose DisplacementPopulation::moved(const Pose& T_object_robot, double scale_mm, double scale_rad) {
  const auto fixed = [](const Axis& axis) { return axis.lower == axis.upper; };
  const double turn = fixed(region_.theta_rad) ? 0.0 : scale_rad * random_.normal();
  const glm::dvec2 shift{scale_mm * random_.normal(), scale_mm * random_.normal()};
  Pose to{{}, T_object_robot.theta_rad + turn};
  to.translation_mm = T_object_robot * middle_mm_ + shift - rotate(to.theta_rad, middle_mm_);
  const glm::dvec2 pivot = to * region_.pivot_mm;
  const glm::dvec2 before = T_object_robot * region_.pivot_mm;
  if (fixed(region_.x_mm)) {
    to.translation_mm.x += before.x - pivot.x;
  }
  if (fixed(region_.y_mm)) {
    to.translation_mm.y += before.y - pivot.y;
  }
  return to;
}

bool DisplacementPopulation::in_region(const Pose& T_object_robot) const {
  const glm::dvec2 pivot = T_object_robot * region_.pivot_mm;
  // A fixed axis has no width: rounding must not lead out of it.
  const auto within = [](const Axis& axis, double value) {
    return axis.lower == axis.upper || (value >= axis.lower && value <= axis.upper);
  };
  const Axis& theta = region_.theta_rad;
  const double middle = (theta.lower + theta.upper) / 2.0;
  return within(region_.x_mm, pivot.x) && within(region_.y_mm, pivot.y) &&
         within(theta,
                middle + wrap_angle(T_object_robot.theta_rad - middle, 2.0 * std::numbers::pi));
}

void DisplacementPopulation::move_touches(Sample& sample, const DisplacementSd& sd) {
  constexpr double widest_mm = 1.0;  // about the width of a touch's likelihood
  constexpr double widest_rad = 0.15;
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    // A draw of its own from the prior reaches other peaks, a small step the width of this peak.
    for (const bool draw : {true, false}) {
      Pose to{{random_.normal(), random_.normal()}, random_.normal()};
      const Pose& from = sample.displacement[i];
      double log_ratio = 0.0;
      if (draw) {
        to = {sd.mm * to.translation_mm, sd.rad * to.theta_rad};
      } else {
        const double step = std::pow(10.0, -random_.uniform());
        to = {from.translation_mm + step * std::min(1.5 * sd.mm, widest_mm) * to.translation_mm,
              from.theta_rad + step * std::min(1.5 * sd.rad, widest_rad) * to.theta_rad};
        const auto before = squares({from}, sd);
        const auto after = squares({to}, sd);
        log_ratio = 0.5 * (before[0] - after[0] + before[1] - after[1]);
      }
      const double log_likelihood = likelihood(sample, sample.T_object_robot, i, to);
      if (accepts(log_ratio + log_likelihood - sample.log_likelihood[i])) {
        sample.displacement[i] = to;
        sample.log_likelihood[i] = log_likelihood;
      }
    }
  }
}

void DisplacementPopulation::move_object(Sample& sample, const DisplacementSd& sd) {
  constexpr double optimal =
      1.4;  // 2.4 over the root of 3 dimensions (Roberts, Gelman, Gilks 1997)
  const auto n = static_cast<double>(touches_.size());
  const double scale_mm = optimal * sd.mm / std::sqrt(n);
  const double scale_rad =
      optimal / std::sqrt(n / (sd.rad * sd.rad) + spread_mm2_ / (sd.mm * sd.mm));
  std::vector<Pose> displacement(touches_.size());
  for (int repeat = 0; repeat < 4; ++repeat) {
    const Pose to = moved(sample.T_object_robot, scale_mm, scale_rad);
    if (!in_region(to)) {
      continue;
    }
    const Pose T_to_from = inverse(to) * sample.T_object_robot;
    for (std::size_t i = 0; i < touches_.size(); ++i) {
      const Pose& T_robot_sensor = touches_[i].T_robot_sensor;
      displacement[i] =
          inverse(T_robot_sensor) * (T_to_from * (T_robot_sensor * sample.displacement[i]));
    }
    const auto before = squares(sample.displacement, sd);
    const auto after = squares(displacement, sd);
    if (accepts(0.5 * (before[0] - after[0] + before[1] - after[1]))) {
      sample.T_object_robot = to;
      sample.displacement.swap(displacement);
    }
  }
}

void DisplacementPopulation::move_robot(Sample& sample) {
  constexpr double widest_mm = 0.5;
  constexpr double arm_mm = 5.0;  // of an array: what a turn moves where all touches are in a place
  const double step_mm = widest_mm * std::pow(10.0, -random_.uniform());
  const double mean_arm_mm2 = spread_mm2_ / static_cast<double>(touches_.size());
  const Pose to =
      moved(sample.T_object_robot, step_mm, step_mm / std::sqrt(mean_arm_mm2 + arm_mm * arm_mm));
  if (!in_region(to)) {
    return;
  }
  std::vector<double> log_likelihood;
  double log_ratio = 0.0;
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    log_likelihood.push_back(likelihood(sample, to, i, sample.displacement[i]));
    log_ratio += log_likelihood[i] - sample.log_likelihood[i];
  }
  if (accepts(log_ratio)) {
    sample.T_object_robot = to;
    sample.log_likelihood.swap(log_likelihood);
  }
}

void DisplacementPopulation::count(ReadingModel::Counts& counts) const {
  const double weight = 1.0 / static_cast<double>(samples_.size());
  for (const Sample& sample : samples_) {
    for (std::size_t i = 0; i < touches_.size(); ++i) {
      objects_[sample.object].sample(
          touches_[i], sample.T_object_robot * touches_[i].T_robot_sensor * sample.displacement[i],
          [&](const LivingElements::Element& element, double occupancy) {
            readings_.count(counts, element.reading, occupancy, weight);
          });
    }
  }
}

void DisplacementPopulation::refresh() {
  for (Sample& sample : samples_) {
    for (std::size_t i = 0; i < touches_.size(); ++i) {
      sample.log_likelihood[i] =
          likelihood(sample, sample.T_object_robot, i, sample.displacement[i]);
    }
  }
}

SdScore DisplacementPopulation::move(const DisplacementSd& sd, int sweeps) {
  const auto n = static_cast<double>(touches_.size());
  std::array<double, 2> sum{};
  std::array<double, 3> sum_of_products{};
  double count = 0.0;
  for (Sample& sample : samples_) {
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      move_touches(sample, sd);
      move_object(sample, sd);
      move_robot(sample);
      if (sweep < sweeps / 2) {
        continue;
      }
      const auto square = squares(sample.displacement, sd);
      sum[0] += square[0];
      sum[1] += square[1];
      sum_of_products[0] += square[0] * square[0];
      sum_of_products[1] += square[0] * square[1];
      sum_of_products[2] += square[1] * square[1];
      count += 1.0;
    }
  }
  const std::array<double, 2> mean{sum[0] / count, sum[1] / count};
  return {.mean = {mean[0] - 2.0 * n, mean[1] - n},
          .complete = {2.0 * mean[0], 2.0 * mean[1]},
          .covariance = {sum_of_products[0] / count - mean[0] * mean[0],
                         sum_of_products[1] / count - mean[0] * mean[1],
                         sum_of_products[2] / count - mean[1] * mean[1]}};
}

double DisplacementPopulation::reweigh(const DisplacementSd& from, const DisplacementSd& to) {
  const auto n = static_cast<double>(touches_.size());
  std::vector<double> log_weight;
  for (const Sample& sample : samples_) {
    const auto before = squares(sample.displacement, from);
    const auto after = squares(sample.displacement, to);
    log_weight.push_back(0.5 * (before[0] - after[0] + before[1] - after[1]) -
                         n * (2.0 * std::log(to.mm / from.mm) + std::log(to.rad / from.rad)));
  }
  const double most = *std::max_element(log_weight.begin(), log_weight.end());
  double all = 0.0;
  for (double& weight : log_weight) {
    weight = std::exp(weight - most);
    all += weight;
  }
  // Systematic resampling (Kitagawa 1996).
  std::vector<Sample> drawn;
  const double part = all / static_cast<double>(samples_.size());
  double at = random_.uniform() * part;
  double reached = 0.0;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    reached += log_weight[i];
    for (; at < reached && drawn.size() < samples_.size(); at += part) {
      drawn.push_back(samples_[i]);
    }
  }
  while (drawn.size() < samples_.size()) {  // rounding may leave the last one out
    drawn.push_back(samples_.back());
  }
  samples_ = std::move(drawn);
  return most + std::log(part);
}

}  // namespace palpate
