#include "learning/familiarity_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include <fmt/format.h>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "palpate/error.hpp"
#include "recognition/evaluation.hpp"

namespace palpate {

namespace {

void require_sound(const FamiliarityScores& scores) {
  const auto finite = [](const FamiliarityScore& score) {
    return std::isfinite(score.explained) && std::isfinite(score.lead);
  };
  if (scores.known.empty() || scores.unknown.empty() ||
      !std::ranges::all_of(scores.known, finite) || !std::ranges::all_of(scores.unknown, finite)) {
    throw Error(
        Fault::input,
        fmt::format("familiarity: {} scores of known and {} of unknown presses; give finite "
                    "scores of both, from presses of two objects or more",
                    scores.known.size(), scores.unknown.size()));
  }
}

/// A score, standardised, after a 1, and the probability with which it counts as known.
struct Target {
  glm::dvec3 score;
  double known = 0.0;
};

/// log(1 + exp(x))
double softplus(double x) { return std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x))); }

double loss(const std::vector<Target>& targets, const glm::dvec3& weights) {
  double sum = 0.0;
  for (const Target& target : targets) {
    const double x = glm::dot(weights, target.score);
    sum += softplus(x) - target.known * x;
  }
  return sum;
}

/// The weights of least loss, by Newton's method.
/// @param used marks the scores that may have a weight
glm::dvec3 least_loss(const std::vector<Target>& targets, const std::array<bool, 3>& used) {
  glm::dvec3 weights(0.0);
  double least = loss(targets, weights);
  constexpr int most_steps = 100;
  for (int step = 0; step < most_steps; ++step) {
    glm::dvec3 gradient(0.0);
    glm::dmat3 curvature(1e-9);
    for (const Target& target : targets) {
      const double p = 1.0 / (1.0 + std::exp(-glm::dot(weights, target.score)));
      gradient += (p - target.known) * target.score;
      curvature += p * (1.0 - p) * glm::outerProduct(target.score, target.score);
    }
    for (int i = 0; i < 3; ++i) {
      if (!used.at(static_cast<std::size_t>(i))) {
        gradient[i] = 0.0;
        for (int j = 0; j < 3; ++j) {
          curvature[i][j] = curvature[j][i] = i == j ? 1.0 : 0.0;
        }
      }
    }
    const glm::dvec3 direction = glm::inverse(curvature) * gradient;
    double length = 1.0;
    double next = loss(targets, weights - direction);
    while (next > least && length > 1e-6) {
      length /= 2.0;
      next = loss(targets, weights - length * direction);
    }
    if (!(next < least)) {
      break;
    }
    weights -= length * direction;
    least = next;
  }
  return weights;
}

}  // namespace

FamiliarityScores all_of(std::span<const FamiliarityScores> folds) {
  FamiliarityScores all;
  for (const FamiliarityScores& fold : folds) {
    all.known.insert(all.known.end(), fold.known.begin(), fold.known.end());
    all.unknown.insert(all.unknown.end(), fold.unknown.begin(), fold.unknown.end());
  }
  return all;
}

Familiarity fit_familiarity(const FamiliarityScores& scores) {
  require_sound(scores);
  const auto known = static_cast<double>(scores.known.size());
  const auto unknown = static_cast<double>(scores.unknown.size());
  std::vector<Target> targets;
  for (const FamiliarityScore& score : scores.known) {
    targets.push_back({{1.0, score.explained, score.lead}, (known + 1.0) / (known + 2.0)});
  }
  for (const FamiliarityScore& score : scores.unknown) {
    targets.push_back({{1.0, score.explained, score.lead}, 1.0 / (unknown + 2.0)});
  }
  // Standardised scores keep Newton's steps well-conditioned.
  glm::dvec3 mean(0.0);
  glm::dvec3 variance(0.0);
  for (const Target& target : targets) {
    mean += target.score / (known + unknown);
  }
  for (const Target& target : targets) {
    variance += (target.score - mean) * (target.score - mean) / (known + unknown);
  }
  std::array<bool, 3> used{true, true, true};
  glm::dvec3 sd(1.0);
  for (int i = 1; i < 3; ++i) {
    sd[i] = std::sqrt(variance[i]);
    if (!(sd[i] > 1e-12 * std::max(1.0, std::abs(mean[i])))) {
      used.at(static_cast<std::size_t>(i)) = false;
      sd[i] = 1.0;
    }
  }
  mean[0] = 0.0;
  for (Target& target : targets) {
    target.score = (target.score - mean) / sd;
  }
  glm::dvec3 weights = least_loss(targets, used);
  // A score that speaks for the unknown gets no weight; the worse of two is dropped first.
  while (std::min(weights[1], weights[2]) < 0.0) {
    used.at(weights[1] < weights[2] ? 1 : 2) = false;
    weights = least_loss(targets, used);
  }
  const glm::dvec3 slopes = weights / sd;
  return {weights[0] - slopes[1] * mean[1] - slopes[2] * mean[2], slopes[1], slopes[2]};
}

double area_under_curve(const FamiliarityScores& scores, const Familiarity& familiarity) {
  require_sound(scores);
  const auto log_odds = [&](const FamiliarityScore& score) {
    return familiarity.explained_slope * score.explained + familiarity.lead_slope * score.lead;
  };
  std::vector<double> unknown;
  std::vector<double> known;
  std::ranges::transform(scores.unknown, std::back_inserter(unknown), log_odds);
  std::ranges::transform(scores.known, std::back_inserter(known), log_odds);
  return told_apart(unknown, known);
}

std::optional<double> area_under_curve(std::span<const FamiliarityScores> folds, std::size_t fold) {
  std::vector<FamiliarityScores> rest(folds.begin(), folds.end());
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(fold));
  const FamiliarityScores others = all_of(rest);
  for (const FamiliarityScores& scores : {folds[fold], others}) {
    if (scores.known.empty() || scores.unknown.empty()) {
      return {};
    }
  }
  return area_under_curve(folds[fold], fit_familiarity(others));
}

}  // namespace palpate
