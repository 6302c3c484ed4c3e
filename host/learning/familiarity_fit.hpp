#pragma once

#include <span>

#include "palpate/learned_sensor.hpp"

namespace palpate {

struct FamiliarityScores {
  std::span<const FamiliarityScore> known;    ///< of presses whose object has maps
  std::span<const FamiliarityScore> unknown;  ///< of presses whose object's maps were left out
};

/// Logistic regression of known against unknown scores. As in Platt (1999) a known press counts as
/// known with probability (n + 1) / (n + 2), n of them, and likewise an unknown one, so that scores
/// that do not overlap give finite numbers. The slopes are at least 0: where unknown presses score
/// higher, the score says nothing.
/// @throws Error where there is no known or no unknown score, or one that is not finite
Familiarity fit_familiarity(const FamiliarityScores& scores);

/// Area under the curve: the share of pairs of a known and an unknown press in which the known one
/// is more probably known; ties count half.
/// @throws Error as fit_familiarity()
double area_under_curve(const FamiliarityScores& scores, const Familiarity& familiarity);

}  // namespace palpate
