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
  return std::log(stranger_density(fit, touches, scale) / density(fit, 0.0, 0.0));
}

}  // namespace palpate
