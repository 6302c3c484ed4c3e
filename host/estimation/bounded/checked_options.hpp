#pragma once

#include <span>

#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// @throws Error on a tolerance that is not between 0 and 1
void require_tolerance(double tolerance);

/// The options, with what follows from them and the hypotheses.
/// @throws Error where they are not sound, or need more memory than a search may take
BoundedOptions checked(const BoundedOptions& options, std::span<const Hypothesis> hypotheses);

}  // namespace palpate
