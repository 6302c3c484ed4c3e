#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "reference/reference.hpp"

namespace palpate::reference {

namespace {

/// What the map predicts for an element at one place.
struct Prediction {
  std::vector<double> log_likelihood;  ///< [level] of the readings but Unknown, in nats
  std::vector<double> probability;     ///< [level] q
  double mean = 0.0;                   ///< M, of the log-likelihood, in nats
  double variance = 0.0;               ///< V
};

/// The model with a prior: the map's where it has none.
ContactModel with_prior(const ContactModel& model, const OccupancyGrid& map) {
  ContactModel resolved = model;
  resolved.prior = model.prior.value_or(map.prior);
  return resolved;
}

std::size_t levels_of(const ContactModel& model) {
  return model.table ? model.table->level_edges.size() + 2 : 2;
}

/// @param model with a prior
Prediction predict(const OccupancyGrid& map, const glm::dvec2& p_object_mm,
                   const ContactModel& model, std::size_t object) {
  const MapSample sample{interpolate(map, model.prior.value(), p_object_mm)};
  Prediction prediction;
  for (std::size_t level = 0; level < levels_of(model); ++level) {
    prediction.log_likelihood.push_back(
        log_likelihood(static_cast<Reading>(level), sample, model, object));
  }
  // A log-sum-exp: the likelihoods themselves may all be too small for a double.
  const std::vector<double>& logs = prediction.log_likelihood;
  const double largest = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double l : logs) {
    sum += std::exp(l - largest);
  }
  for (const double l : logs) {
    prediction.probability.push_back(std::exp(l - largest) / sum);
    prediction.mean += prediction.probability.back() * l;
  }
  for (std::size_t level = 0; level < logs.size(); ++level) {
    prediction.variance +=
        prediction.probability[level] * std::pow(logs[level] - prediction.mean, 2.0);
  }
  return prediction;
}

/// The product over elements, [element][level], for every combination of levels, the first
/// element's fastest.
std::vector<double> products(const std::vector<std::vector<double>>& factors) {
  std::vector<double> all{1.0};
  for (const std::vector<double>& element : factors) {
    std::vector<double> longer;
    for (const double level : element) {
      for (const double shorter : all) {
        longer.push_back(shorter * level);
      }
    }
    all = longer;
  }
  return all;
}

/// Adds `weight` times every number of `more`.
void add(std::vector<double>& sums, double weight, const std::vector<double>& more) {
  sums.resize(more.size());
  for (std::size_t i = 0; i < more.size(); ++i) {
    sums[i] += weight * more[i];
  }
}

std::optional<Fit> verdict_on(bool any_known, double deviation, double variance) {
  if (!any_known) {
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
std::vector<std::pair<Pose, double>> displacements_by(const DisplacementSd& sd) {
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
  const ContactModel model = with_prior(contact, map);
  double deviation = 0.0;
  double variance = 0.0;
  bool any_known = false;
  for (const Touch& touch : touches) {
    const std::vector<Reading> readings = classify(touch, model);
    for (std::size_t k = 0; k < readings.size(); ++k) {
      if (readings[k] != Reading::unknown) {
        const glm::dvec2 p_object =
            transform(T_object_robot, transform(touch.T_robot_sensor, touch.elements_mm[k]));
        const Prediction prediction = predict(map, p_object, model, object);
        deviation +=
            prediction.log_likelihood[static_cast<std::size_t>(readings[k])] - prediction.mean;
        variance += prediction.variance;
        any_known = true;
      }
    }
  }
  return verdict_on(any_known, deviation, variance);
}

std::optional<Fit> fit_of(std::span<const Touch> touches, const Pose& T_object_robot,
                          const OccupancyGrid& map, const ContactModel& contact,
                          const DisplacementSd& touch_sd, std::size_t object) {
  const ContactModel model = with_prior(contact, map);
  double deviation = 0.0;
  double variance = 0.0;
  bool any_known = false;
  for (const Touch& touch : touches) {
    std::vector<std::size_t> elements;
    std::size_t read = 0;  // the readings as a number, the first element's lowest
    std::size_t all = 1;   // number of ways in which the elements could have read
    const std::vector<Reading> readings = classify(touch, model);
    for (std::size_t k = 0; k < readings.size(); ++k) {
      if (readings[k] != Reading::unknown) {
        elements.push_back(k);
        read += all * static_cast<std::size_t>(readings[k]);
        all *= levels_of(model);
      }
    }
    any_known = any_known || !elements.empty();
    std::vector<double> likelihood;   // E_delta prod P, [readings]
    std::vector<double> probability;  // E_delta prod q
    for (const auto& [displacement, weight] : displacements_by(touch_sd)) {
      std::vector<std::vector<double>> p;  // [element][level]
      std::vector<std::vector<double>> q;
      for (const std::size_t k : elements) {
        const glm::dvec2 p_sensor = transform(displacement, touch.elements_mm[k]);
        const glm::dvec2 p_object =
            transform(T_object_robot, transform(touch.T_robot_sensor, p_sensor));
        const Prediction prediction = predict(map, p_object, model, object);
        q.push_back(prediction.probability);
        p.emplace_back();
        for (const double l : prediction.log_likelihood) {
          p.back().push_back(std::exp(l));
        }
      }
      add(likelihood, weight, products(p));
      add(probability, weight, products(q));
    }
    double mean = 0.0;
    for (std::size_t i = 0; i < all; ++i) {
      mean += probability[i] * std::log(likelihood[i]);
    }
    for (std::size_t i = 0; i < all; ++i) {
      variance += probability[i] * std::pow(std::log(likelihood[i]) - mean, 2.0);
    }
    deviation += std::log(likelihood[read]) - mean;
  }
  return verdict_on(any_known, deviation, variance);
}

Gain expected_gain(std::span<const BeliefSample> samples, std::span<const OccupancyGrid> maps,
                   const Pose& T_robot_sensor, std::span<const glm::dvec2> elements_mm,
                   const ContactModel& contact, std::span<const Pose> displacements) {
  std::vector<std::vector<double>> f;                     // f(z | i), [sample][readings]
  std::map<std::size_t, std::vector<double>> with_label;  // sum of w f
  std::map<std::size_t, double> label_probability;
  std::vector<double> all;
  for (const BeliefSample& sample : samples) {
    const ContactModel model = with_prior(contact, maps[sample.object]);
    std::vector<double> mean;
    for (const Pose& displacement : displacements) {
      std::vector<std::vector<double>> q;  // [element][level]
      for (const glm::dvec2& element : elements_mm) {
        const glm::dvec2 p_robot = transform(T_robot_sensor, transform(displacement, element));
        const glm::dvec2 p_object = transform(sample.T_object_robot, p_robot);
        q.push_back(predict(maps[sample.object], p_object, model, sample.object).probability);
      }
      add(mean, 1.0 / static_cast<double>(displacements.size()), products(q));
    }
    label_probability[sample.label] += sample.probability;
    add(all, sample.probability, mean);
    add(with_label[sample.label], sample.probability, mean);
    f.push_back(mean);
  }
  Gain gain;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t z = 0; z < all.size(); ++z) {
      gain.both += samples[i].probability * f[i][z] * std::log(f[i][z] / all[z]);
    }
  }
  for (const auto& [label, of_label] : with_label) {
    for (std::size_t z = 0; z < all.size(); ++z) {
      gain.identity += of_label[z] * std::log(of_label[z] / label_probability[label] / all[z]);
    }
  }
  return gain;
}

}  // namespace palpate::reference
