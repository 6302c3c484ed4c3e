#include "learning/stranger_fit.hpp"

#include <cmath>
#include <limits>

#include "recognition/misfit.hpp"

namespace palpate {

namespace {

/// The mean log density of an object's fits; none of too few.
std::optional<double> mean_log_density(const std::vector<StrangerFit>& fits, const FitScale& scale,
                                       double stranger_sd) {
  constexpr double enough = 5.0;
  double sum = 0.0;
  double count = 0.0;
  for (const auto& [fit, touches] : fits) {
    if (touches > 1) {
      sum += std::log(stranger_density(scale.of(fit, touches), touches, stranger_sd));
      count += 1.0;
    }
  }
  return count < enough ? std::nullopt : std::optional(sum / count);
}

}  // namespace

std::optional<double> stranger_sd_of(const std::map<std::string, std::vector<StrangerFit>>& objects,
                                     const FitScale& scale) {
  constexpr int least_objects = 3;
  constexpr double least = 1.0;
  constexpr double most = 16.0;
  constexpr double step = 1.05;
  std::optional<double> best;
  double highest = -std::numeric_limits<double>::infinity();
  for (double stranger_sd = least; stranger_sd <= most; stranger_sd *= step) {
    double sum = 0.0;
    int judged = 0;
    for (const auto& [label, fits] : objects) {
      if (const auto mean = mean_log_density(fits, scale, stranger_sd)) {
        sum += *mean;
        ++judged;
      }
    }
    if (judged < least_objects) {
      return {};
    }
    if (sum > highest) {
      highest = sum;
      best = stranger_sd;
    }
  }
  return best;
}

}  // namespace palpate
