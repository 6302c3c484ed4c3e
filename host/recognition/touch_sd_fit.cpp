#include "touch_sd_fit.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <thread>

namespace palpate {

namespace {

/// Calls work(i) for every i < count on all of the machine's cores.
void in_parallel(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      work(i);
    }
  };
  std::vector<std::jthread> others;
  for (unsigned thread = 1; thread < std::thread::hardware_concurrency(); ++thread) {
    others.emplace_back(run);
  }
  run();
}

SdScore move_all(std::vector<DisplacementPopulation>& unknowns, const DisplacementSd& sd,
                 int sweeps) {
  std::vector<SdScore> scores(unknowns.size());
  in_parallel(unknowns.size(), [&](std::size_t i) { scores[i] = unknowns[i].move(sd, sweeps); });
  SdScore sum;
  for (const SdScore& score : scores) {
    for (std::size_t k = 0; k < 2; ++k) {
      sum.mean[k] += score.mean[k];
      sum.complete[k] += score.complete[k];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      sum.covariance[k] += score.covariance[k];
    }
  }
  return sum;
}

double reweigh_all(std::vector<DisplacementPopulation>& unknowns, const DisplacementSd& from,
                   const DisplacementSd& to) {
  double gain = 0.0;
  for (DisplacementPopulation& unknown : unknowns) {
    gain += unknown.reweigh(from, to);
  }
  return gain;
}

}  // namespace

TouchSdFit fit_touch_sd(std::vector<DisplacementPopulation>& unknowns,
                        ReadingModel& readings, const TouchSdFitOptions& options,
                        const std::function<void(double)>& progress) {
  TouchSdFit fit;
  fit.unknowns = unknowns.size();
  for (const DisplacementPopulation& unknown : unknowns) {
    fit.touches += unknown.touches();
  }
  const double each = static_cast<double>(fit.touches) / static_cast<double>(fit.unknowns);
  const double cap = std::clamp(1.0 / (2.0 * std::sqrt(each)), 0.03, 0.3);
  DisplacementSd sd = options.start;
  move_all(unknowns, sd, 100);
  double at = 0.0;
  for (int step = 0; step < 60; ++step) {
    const SdScore score = move_all(unknowns, sd, options.sweeps);
    const double a = score.complete[0] - score.covariance[0];
    const double b = -score.covariance[1];
    const double c = score.complete[1] - score.covariance[2];
    const double determinant = a * c - b * b;
    double mm, rad;
    if (a > 0 && c > 0 && determinant > 0.2 * a * c) {
      mm = (c * score.mean[0] - b * score.mean[1]) / determinant;
      rad = (a * score.mean[1] - b * score.mean[0]) / determinant;
    } else {
      mm = score.mean[0] / score.complete[0];
      rad = score.mean[1] / score.complete[1];
      mm *= 3;
      rad *= 3;
    }
    mm = std::clamp(mm, -cap, cap);
    rad = std::clamp(rad, -cap, cap);
    if (getenv("SDTRACE"))
      std::printf("%2d sd %.3f mm %.4f rad  score %.1f %.1f  info %.1f %.1f %.1f  of %.1f %.1f  step %.3f %.3f Z %.2f\n", step, sd.mm,
                sd.rad, score.mean[0], score.mean[1], a, b, c, score.complete[0], score.complete[1], mm, rad, at);
    const DisplacementSd to{sd.mm * std::exp(mm), sd.rad * std::exp(rad)};
    at += reweigh_all(unknowns, sd, to);
    sd = to;
    if (!getenv("NOLEARN")) {
    auto counts = readings.no_counts();
    for (auto& u : unknowns) u.count(counts);
    readings.learn(counts);
    for (auto& u : unknowns) u.refresh();
    }
    fit.standard_error = {sd.mm * std::sqrt(c / determinant), sd.rad * std::sqrt(a / determinant)};
    if (to.mm < 0.05 ) break;
    if (step > 12 && std::abs(mm) < 0.01 && std::abs(rad) < 0.01 ) break;
  }
  fit.sd = sd;
  if (progress) progress(1.0);
  return fit;
}

}  // namespace palpate
