#pragma once

#include "palpate/contact.hpp"
#include "palpate/sensor_model.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Touches are contradicted where the prior alone explains them better by more nats than this: than
/// the best pose, that is, of any object. exp(-700) is among the smallest numbers that float64
/// holds at full precision.
inline constexpr double contradiction_nats = 700.0;

/// Log-likelihood in nats of a touch by a map of nothing but the prior, at whatever pose (Eq. 7).
double prior_log_likelihood(const Touch& touch, const ContactClassifier& classifier,
                            const ContactLikelihood& model);

}  // namespace palpate
