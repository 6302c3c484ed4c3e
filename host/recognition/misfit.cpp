#include "recognition/misfit.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// That of z, of which one in ten spreads wider, where something else widens all of them.
double density(const Fit& fit, double mean, double widened_sd) {
  constexpr double odd_share = 0.1;
  constexpr double odd_sd = 5.0;
  constexpr double farthest = 30.0;  // no density is 0
  const double from_mean = std::clamp(fit.z, -farthest, farthest) - mean;
  const auto normal = [&](double own_sd) {
    const double sd = std::hypot(own_sd, widened_sd);
    return std::exp(-0.5 * from_mean * from_mean / (sd * sd)) / sd;
  };
  return (1.0 - odd_share) * normal(1.0) + odd_share * normal(odd_sd);
}

}  // namespace

double stranger_density(const Fit& fit, std::size_t touches, const FitScale& scale) {
  if (touches == 1 && scale.stranger_alone) {
    const auto [mean, sd] = *scale.stranger_alone;
    return density(fit, mean, std::sqrt(std::max(sd * sd - 1.0, 0.0)));
  }
  const double each_sd = scale.stranger_sd.value_or(usual_stranger_sd);
  return density(fit, 0.0, each_sd * (static_cast<double>(touches) - 1.0));
}

double misfit_nats(const Fit& fit, std::size_t touches, const FitScale& scale) {
  // The scale is of the touches that were learned from. Of 160 single presses by a sensor whose
  // elements have other gains, one in ten has z below -3.9 and one in twenty below -5.4: the lower
  // half of a standard deviation of 3.
  constexpr double alone_sd = 3.0;
  const bool alone = touches == 1 && scale.stranger_alone;
  const double learned = density(fit, 0.0, alone ? std::sqrt(alone_sd * alone_sd - 1.0) : 0.0);
  return std::log(stranger_density(fit, touches, scale) / learned);
}

}  // namespace palpate
