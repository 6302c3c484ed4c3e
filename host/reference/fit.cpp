#include "reference/reference.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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

Fit verdict_on(double deviation, double variance) {
  double z = 0.0;
  if (deviation != 0.0) {
    z = std::clamp(deviation / std::sqrt(variance), -largest_fit_z, largest_fit_z);
  }
  const Verdict verdict = z >= fits_from_z       ? Verdict::fits
                          : z >= doubtful_from_z ? Verdict::doubtful
                                                 : Verdict::does_not_fit;
  return {z, verdict};
}

/// A place of a normal variable in standard deviations, with its probability.
struct Node {
  double place = 0.0;
  double weight = 0.0;
};

/// A grid over +-4.5 standard deviations, or 0 alone where there is none.
std::vector<Node> nodes(double sd) {
  if (sd == 0.0) {
    return {{0.0, 1.0}};
  }
  std::vector<Node> nodes;
  double total = 0.0;
  for (double place = -4.5; place <= 4.5; place += 0.5) {
    nodes.push_back({place, std::exp(-0.5 * place * place)});
    total += nodes.back().weight;
  }
  for (Node& node : nodes) {
    node.weight /= total;
  }
  return nodes;
}

/// Displacements of the sensor with their probabilities.
std::vector<std::pair<Pose, double>> displacements(const DisplacementSd& sd) {
  std::vector<std::pair<Pose, double>> all;
  for (const Node& x : nodes(sd.mm)) {
    for (const Node& y : nodes(sd.mm)) {
      for (const Node& angle : nodes(sd.rad)) {
        all.push_back({{{sd.mm * x.place, sd.mm * y.place}, sd.rad * angle.place},
                       x.weight * y.weight * angle.weight});
      }
    }
  }
  return all;
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
  return verdict_on(deviation, variance);
}

std::optional<Fit> fit_of(std::span<const Touch> touches, const Pose& T_object_robot,
                          const OccupancyGrid& map, const ContactModel& contact,
                          const DisplacementSd& touch_sd, std::size_t object) {
  ContactModel model = contact;
  model.prior = contact.prior.value_or(map.prior);
  double deviation = 0.0;
  double variance = 0.0;
  bool any_known = false;
  for (const Touch& touch : touches) {
    std::vector<std::size_t> elements;
    std::size_t read = 0;  // the readings as a number, the first element's lowest
    std::size_t all = 1;   // number of ways in which the elements could have read
    const std::size_t levels = model.table ? model.table->level_edges.size() + 2 : 2;
    const std::vector<Reading> readings = classify(touch, model);
    for (std::size_t k = 0; k < readings.size(); ++k) {
      if (readings[k] != Reading::unknown) {
        elements.push_back(k);
        read += all * static_cast<std::size_t>(readings[k]);
        all *= levels;
      }
    }
    any_known = any_known || !elements.empty();
    std::vector<double> likelihood(all);   // E_delta prod P, [readings]
    std::vector<double> probability(all);  // E_delta prod q
    for (const auto& [displacement, weight] : displacements(touch_sd)) {
      std::vector<std::vector<double>> p_of;  // [element, level]
      std::vector<double> sum_of;             // over the levels
      for (const std::size_t k : elements) {
        const glm::dvec2 p_sensor = transform(displacement, touch.elements_mm[k]);
        const glm::dvec2 p_object =
            transform(T_object_robot, transform(touch.T_robot_sensor, p_sensor));
        p_of.emplace_back();
        sum_of.push_back(0.0);
        const MapSample sample{interpolate(map, *model.prior, p_object)};
        for (std::size_t level = 0; level < levels; ++level) {
          p_of.back().push_back(
              std::exp(log_likelihood(static_cast<Reading>(level), sample, model, object)));
          sum_of.back() += p_of.back().back();
        }
      }
      for (std::size_t one = 0; one < all; ++one) {
        double p = 1.0;
        double q = 1.0;
        std::size_t rest = one;
        for (std::size_t k = 0; k < elements.size(); ++k) {
          p *= p_of[k][rest % levels];
          q *= p_of[k][rest % levels] / sum_of[k];
          rest /= levels;
        }
        likelihood[one] += weight * p;
        probability[one] += weight * q;
      }
    }
    double mean = 0.0;
    for (std::size_t one = 0; one < all; ++one) {
      mean += probability[one] * std::log(likelihood[one]);
    }
    for (std::size_t one = 0; one < all; ++one) {
      variance += probability[one] * std::pow(std::log(likelihood[one]) - mean, 2.0);
    }
    deviation += std::log(likelihood[read]) - mean;
  }
  if (!any_known) {
    return {};
  }
  return verdict_on(deviation, variance);
}

}  // namespace palpate::reference
