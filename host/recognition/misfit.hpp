#pragma once

#include <cstddef>

#include "palpate/fit.hpp"

namespace palpate {

/// FitScale::stranger_sd where it was not learned.
inline constexpr double usual_stranger_sd = 4.0;

/// The density, but for a factor, of Fit::z of touches of a stranger, an object that was never
/// learned, at the best pose of the best object that was. One touch fits as stranger_alone says;
/// further ones have to share its pose, and each spreads z by stranger_sd more. No density is 0.
/// @param fit on the scale
/// @param touches with an element In Contact
/// @param scale that was learned
double stranger_density(const Fit& fit, std::size_t touches, const FitScale& scale);

/// What the fit of the best object says for none_label: the log of how likely a stranger fits so,
/// over how likely a learned object does. Parameters as above.
double misfit_nats(const Fit& fit, std::size_t touches, const FitScale& scale);

}  // namespace palpate
