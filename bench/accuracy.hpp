#pragma once

#include <functional>
#include <span>
#include <vector>

#include "measurement.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/touch.hpp"

namespace palpate::bench {

/// Difference in nats between the log-likelihoods of some bins of every object, drawn with a fixed
/// seed, and the float64 reference of the touches. `log_likelihood` gives all bins of an object.
ErrorStatistics likelihood_errors(
    std::span<const Hypothesis> objects, const ContactModel& model, const PoseLattice& lattice,
    std::span<const Touch> touches, int bins_per_object,
    const std::function<std::vector<double>(int object)>& log_likelihood);

}  // namespace palpate::bench
