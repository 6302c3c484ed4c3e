#pragma once

#include "estimation/contact_evidence.hpp"
#include "palpate/contact_model.hpp"

namespace palpate {

/// Touches contradict all hypotheses where a map of nothing but the prior explains them better than
/// the best pose of any object does, by more than this many nats. exp(-700) is among the smallest
/// numbers that float64 holds at full precision.
inline constexpr double contradiction_nats = 700.0;

/// Log-likelihood in nats of a reading on a map of nothing but the prior (Eq. 7). Where a table
/// holds numbers of their own for every object, this is the log of the mean of the objects'
/// likelihoods.
double prior_log_likelihood(Reading reading, const ContactModel& model);
/// Log-likelihood in nats of all readings on a map of nothing but the prior, at whatever pose.
double prior_log_likelihood(const ReadingCounts& counts, const ContactModel& model);

}  // namespace palpate
