#include "familiarity_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

void require_sound(const FamiliarityScores& scores) {
  const auto finite = [](double x) { return std::isfinite(x); };
  if (scores.known.empty() || scores.unknown.empty() ||
      !std::ranges::all_of(scores.known, finite) || !std::ranges::all_of(scores.unknown, finite)) {
    throw Error(
        Fault::input,
        fmt::format("familiarity: {} scores of known and {} of unknown presses; give finite "
                    "scores of both, from presses of two objects or more",
                    scores.known.size(), scores.unknown.size()));
  }
}

/// A score and the probability with which it counts as known.
struct Target {
  double score;
  double known;
};

/// log(1 + exp(x))
double softplus(double x) { return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x))); }

double loss(const std::vector<Target>& targets, double offset, double slope) {
  double sum = 0.0;
  for (const Target& target : targets) {
    const double x = offset + slope * target.score;
    sum += softplus(x) - target.known * x;
  }
  return sum;
}

}  // namespace

double familiar_probability(const Familiarity& familiarity, double score) {
  return 1.0 / (1.0 + std::exp(-(familiarity.offset + familiarity.slope * score)));
}

Familiarity fit_familiarity(const FamiliarityScores& scores) {
  require_sound(scores);
  const auto known = static_cast<double>(scores.known.size());
  const auto unknown = static_cast<double>(scores.unknown.size());
  // Standardised scores keep Newton's steps well-conditioned.
  double mean = 0.0;
  double squares = 0.0;
  for (const auto& part : {scores.known, scores.unknown}) {
    for (const double score : part) {
      mean += score / (known + unknown);
    }
  }
  for (const auto& part : {scores.known, scores.unknown}) {
    for (const double score : part) {
      squares += (score - mean) * (score - mean) / (known + unknown);
    }
  }
  const double sd = std::sqrt(squares);
  const double log_odds = std::log((known + 1.0) / (unknown + 1.0));
  if (!(sd > 1e-12 * std::max(1.0, std::abs(mean)))) {
    return {log_odds, 0.0};
  }
  std::vector<Target> targets;
  for (const double score : scores.known) {
    targets.push_back({(score - mean) / sd, (known + 1.0) / (known + 2.0)});
  }
  for (const double score : scores.unknown) {
    targets.push_back({(score - mean) / sd, 1.0 / (unknown + 2.0)});
  }
  double offset = 0.0;
  double slope = 0.0;
  double least = loss(targets, offset, slope);
  constexpr int most_steps = 100;
  for (int step = 0; step < most_steps; ++step) {
    double g0 = 0.0;
    double g1 = 0.0;
    double h00 = 1e-9;
    double h01 = 0.0;
    double h11 = 1e-9;
    for (const Target& target : targets) {
      const double p = 1.0 / (1.0 + std::exp(-(offset + slope * target.score)));
      const double w = p * (1.0 - p);
      g0 += p - target.known;
      g1 += (p - target.known) * target.score;
      h00 += w;
      h01 += w * target.score;
      h11 += w * target.score * target.score;
    }
    const double determinant = h00 * h11 - h01 * h01;
    const double d0 = (h11 * g0 - h01 * g1) / determinant;
    const double d1 = (h00 * g1 - h01 * g0) / determinant;
    double length = 1.0;
    double next = loss(targets, offset - d0, slope - d1);
    while (next > least && length > 1e-6) {
      length /= 2.0;
      next = loss(targets, offset - length * d0, slope - length * d1);
    }
    if (!(next < least)) {
      break;
    }
    offset -= length * d0;
    slope -= length * d1;
    least = next;
  }
  if (slope < 0.0) {
    return {log_odds, 0.0};
  }
  return {offset - slope * mean / sd, slope / sd};
}

double area_under_curve(const FamiliarityScores& scores) {
  require_sound(scores);
  std::vector<double> unknown(scores.unknown.begin(), scores.unknown.end());
  std::ranges::sort(unknown);
  double pairs = 0.0;
  for (const double score : scores.known) {
    const auto [first, last] = std::equal_range(unknown.begin(), unknown.end(), score);
    pairs += static_cast<double>(first - unknown.begin()) + 0.5 * static_cast<double>(last - first);
  }
  return pairs / (static_cast<double>(scores.known.size()) * static_cast<double>(unknown.size()));
}

}  // namespace palpate
