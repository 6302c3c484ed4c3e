#pragma once

#include <span>
#include <vector>

#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// @throws Error on an empty list, a map that is not sound or a weight that is not positive.
void validate_hypotheses(std::span<const Hypothesis> hypotheses);

/// The contact model with the maps' prior where it has none of its own.
/// @throws Error where the model is not sound, the maps' priors differ, or a table has neither one
/// set of numbers nor one for every hypothesis
ContactModel resolve(const ContactModel& contact, std::span<const Hypothesis> hypotheses);

/// log of every prior weight over their sum.
std::vector<double> log_weights(std::span<const Hypothesis> hypotheses);

/// log of the prior weight of "none of these" times a lattice's bins, on the scale of
/// log_weights().
double none_log_weight(double none_weight, std::span<const Hypothesis> hypotheses,
                       const PoseLattice& lattice);

/// @throws Error where there is no such object of this many
void require_object(int object, std::size_t objects);

/// The lattice about another pivot.
/// @param filter name of the filter for messages; `touched` says that it has taken in a touch
/// @throws Error where the filter is touched, or on a pivot out of range
PoseLattice with_pivot(PoseLattice lattice, const glm::dvec2& pivot_mm, const char* filter,
                       bool touched);

/// exp(logs) over their sum, by a log-sum-exp: probabilities from log evidence (Eq. 14).
std::vector<double> normalised(std::vector<double> logs);

}  // namespace palpate
