#pragma once

#include <optional>
#include <span>
#include <vector>

#include "palpate/learned_sensor.hpp"

namespace palpate {

/// Scores of known and of unknown presses. Both kinds are over equally many objects, since the best
/// of more objects fits better by chance.
struct FamiliarityScores {
  std::vector<FamiliarityScore> known;    ///< of presses whose object has maps; another has none
  std::vector<FamiliarityScore> unknown;  ///< of presses whose object's maps were left out
};
/// The scores of all folds together.
FamiliarityScores all_of(std::span<const FamiliarityScores> folds);

/// Logistic regression of known against unknown scores. As in Platt (1999) a known press counts as
/// known with probability (n + 1) / (n + 2), n of them, and an unknown one likewise, so that scores
/// that do not overlap give finite numbers. The slopes are at least 0: where unknown presses score
/// higher, the score says nothing.
/// @throws Error where there is no known or no unknown score, or one that is not finite
Familiarity fit_familiarity(const FamiliarityScores& scores);

/// Area under the curve: the share of pairs of a known and an unknown press in which the known one
/// is more probably known; ties count half.
/// @throws Error as fit_familiarity()
double area_under_curve(const FamiliarityScores& scores, const Familiarity& familiarity);

/// Area under the curve of a fold's presses by the regression of the other folds': one half on
/// average where scores say nothing.
/// @returns none where the fold or the others lack a kind of scores
/// @throws Error on a score that is not finite
std::optional<double> area_under_curve(std::span<const FamiliarityScores> folds, std::size_t fold);

}  // namespace palpate
