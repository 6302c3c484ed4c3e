#include "learning/stranger_fit.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include "recognition/object_fit.hpp"

namespace palpate {

namespace {

using StrangerFits = std::map<std::size_t, std::vector<StrangerFit>>;

/// Finds the likeliest scale for the fits of one touch each, or of several.
class LikeliestScale {
 public:
  LikeliestScale(const StrangerFits& objects, const FitScale& scale, bool alone) {
    constexpr std::size_t enough = 5;
    for (const auto& [label, fits] : objects) {
      std::vector<StrangerFit> counted;
      for (const auto& [fit, touches] : fits) {
        if ((touches == 1) == alone) {
          counted.push_back({scale.of(fit, touches), touches});
        }
      }
      if (counted.size() >= enough) {
        fits_.push_back(std::move(counted));
      }
    }
  }

  bool tells() const {
    constexpr std::size_t least_objects = 3;
    return fits_.size() >= least_objects;
  }

  void try_scale(const FitScale& scale) {
    double sum = 0.0;
    for (const std::vector<StrangerFit>& fits : fits_) {
      double of_object = 0.0;
      for (const auto& [fit, touches] : fits) {
        of_object += std::log(stranger_density(fit, touches, scale));
      }
      sum += of_object / static_cast<double>(fits.size());
    }
    if (sum > highest_) {
      highest_ = sum;
      best_ = scale;
    }
  }

  const FitScale& best() const { return best_; }

 private:
  std::vector<std::vector<StrangerFit>> fits_;  ///< [object] on the scale
  double highest_ = -std::numeric_limits<double>::infinity();
  FitScale best_;
};

}  // namespace

FitScale with_strangers(const StrangerFits& objects, FitScale scale) {
  constexpr double least_sd = 1.0;
  constexpr double most_sd = 16.0;
  constexpr double step = 1.05;
  constexpr double least_mean = -16.0;
  constexpr double mean_step = 0.5;
  scale.stranger_sd.reset();
  scale.stranger_alone.reset();
  LikeliestScale of_several(objects, scale, false);
  LikeliestScale of_one(objects, scale, true);
  for (double sd = least_sd; sd <= most_sd; sd *= step) {
    if (of_several.tells()) {
      scale.stranger_sd = sd;
      of_several.try_scale(scale);
    }
    for (double mean = 0.0; mean >= least_mean && of_one.tells(); mean -= mean_step) {
      scale.stranger_alone = {mean, sd};
      of_one.try_scale(scale);
    }
  }
  scale.stranger_sd = of_several.best().stranger_sd;
  scale.stranger_alone = of_one.best().stranger_alone;
  return scale;
}

std::string unlearned_strangers(const LearnedSensor& sensor) {
  const bool known_poses = sensor.bins.has_value();
  if (!sensor.fit_scale || (known_poses ? sensor.fit_scale->stranger_sd.has_value()
                                        : sensor.fit_scale->stranger_alone.has_value())) {
    return "";
  }
  return known_poses ? "\"(none)\" goes by a figure of Palpate's own for how badly strangers fit; "
                       "to learn it, give 15 touches or more of each of three objects"
                     : "how badly strangers fit is not learned, so that a press does not tell "
                       "\"(none)\"; give presses of three objects or more";
}

}  // namespace palpate
