#pragma once

#include <cstddef>

#include "palpate/fit.hpp"

namespace palpate {

/// FitScale::stranger_sd where it was not learned.
inline constexpr double usual_stranger_sd = 4.0;

/// The density, but for a factor, of Fit::z of touches of a stranger, an object that was never
/// learned, at the best pose of the best object that was. One touch fits as well as a learned
/// object's; the further ones have to share its pose, and each spreads z by `stranger_sd` more.
/// That of 0 is the density of a learned object's z. No density is 0.
/// @param fit on a scale that was learned
/// @param touches with an element In Contact
double stranger_density(const Fit& fit, std::size_t touches, double stranger_sd);

/// What the fit of the best object says for none_label: the log of how likely a stranger fits so,
/// over how likely a learned object does. After one touch it says nothing.
/// @param fit on a scale that was learned
/// @param touches with an element In Contact
double misfit_nats(const Fit& fit, std::size_t touches, double stranger_sd);

}  // namespace palpate
