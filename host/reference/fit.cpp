#include "reference.hpp"

#include <algorithm>
#include <cmath>

namespace palpate::reference {

namespace {

/// What the map predicts for the element at one place.
struct Prediction {
  std::vector<double> log_likelihood;  ///< [level] of the readings but Unknown, in nats
  double mean = 0.0;                   ///< of the log-likelihood, in nats
  double variance = 0.0;
};

Prediction predict(const MapSample& map, const ContactModel& model, std::size_t object) {
  Prediction prediction;
  const std::size_t levels = model.table ? model.table->level_edges.size() + 2 : 2;
  for (std::size_t level = 0; level < levels; ++level) {
    prediction.log_likelihood.push_back(
        log_likelihood(static_cast<Reading>(level), map, model, object));
  }
  // A log-sum-exp: the likelihoods themselves may all be too small for a double.
  const std::vector<double>& logs = prediction.log_likelihood;
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double l : logs) {
    sum += std::exp(l - most);
  }
  for (const double l : logs) {
    prediction.mean += std::exp(l - most) / sum * l;
  }
  for (const double l : logs) {
    prediction.variance += std::exp(l - most) / sum * std::pow(l - prediction.mean, 2.0);
  }
  return prediction;
}

}  // namespace

std::optional<Fit> fit_of(std::span<const Touch> touches, const Pose& T_object_robot,
                          const OccupancyGrid& map, const ContactModel& contact,
                          std::size_t object) {
  ContactModel model = contact;
  model.prior = contact.prior.value_or(map.prior);
  double deviation = 0.0;
  double variance = 0.0;
  int known = 0;
  for (const Touch& touch : touches) {
    const std::vector<Reading> readings = classify(touch, model);
    for (std::size_t k = 0; k < readings.size(); ++k) {
      if (readings[k] == Reading::unknown) {
        continue;
      }
      const glm::dvec2 p_object =
          transform(T_object_robot, transform(touch.T_robot_sensor, touch.elements_mm[k]));
      const Prediction prediction =
          predict({interpolate(map, *model.prior, p_object)}, model, object);
      deviation +=
          prediction.log_likelihood[static_cast<std::size_t>(readings[k])] - prediction.mean;
      variance += prediction.variance;
      ++known;
    }
  }
  if (known == 0) {
    return {};
  }
  double z = 0.0;
  if (deviation != 0.0) {
    z = std::clamp(deviation / std::sqrt(variance), -largest_fit_z, largest_fit_z);
  }
  const Verdict verdict = z >= fits_from_z       ? Verdict::fits
                          : z >= doubtful_from_z ? Verdict::doubtful
                                                 : Verdict::does_not_fit;
  return Fit{z, verdict};
}

}  // namespace palpate::reference
