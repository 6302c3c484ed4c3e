#pragma once

#include <cstdint>
#include <vector>

#include "hard_case.hpp"
#include "support/certified.hpp"

namespace palpate {

/// 9 x 8 x 7 bins.
BoundedOptions few_bins();

/// Expects the certificate to hold after every touch, and one object's answers to be the tolerance
/// away from float64 at most.
/// @param nats what rounding may add to a log-likelihood
Certified expect_certificate(HardCase& hard, const std::vector<Hypothesis>& objects,
                             const BoundedOptions& options, const Recording& recording,
                             double nats = 1e-9);

}  // namespace palpate
