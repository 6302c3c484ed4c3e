#include "recognition/misfit.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

double stranger_density(const Fit& fit, std::size_t touches, double stranger_sd) {
  // Fits of learned objects on their scale: one in ten has a wider spread.
  constexpr double odd_share = 0.1;
  constexpr double odd_sd = 5.0;
  constexpr double farthest = 30.0;  // no density is 0
  const double z = std::clamp(fit.z, -farthest, farthest);
  const double further = stranger_sd * (static_cast<double>(touches) - 1.0);
  const auto normal = [&](double own_sd) {
    const double sd = std::hypot(own_sd, further);
    return std::exp(-0.5 * z * z / (sd * sd)) / sd;
  };
  return (1.0 - odd_share) * normal(1.0) + odd_share * normal(odd_sd);
}

double misfit_nats(const Fit& fit, std::size_t touches, double stranger_sd) {
  return std::log(stranger_density(fit, touches, stranger_sd) /
                  stranger_density(fit, touches, 0.0));
}

}  // namespace palpate
