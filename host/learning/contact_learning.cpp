#include "learning/contact_learning.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <fmt/format.h>
#include <glm/exponential.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "model/element_spacing.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

namespace {

/// Otsu's threshold of values in ascending order: the middle of the gap between the two classes.
double otsu_threshold(const std::vector<double>& values) {
  const double all = std::accumulate(values.begin(), values.end(), 0.0);
  const auto n = static_cast<double>(values.size());
  double below = 0.0;
  double largest = -1.0;
  double threshold = values.front();
  for (std::size_t i = 0; i + 1 < values.size(); ++i) {
    below += values[i];
    if (values[i + 1] == values[i]) {
      continue;
    }
    const double count = static_cast<double>(i) + 1.0;
    const double apart = below / count - (all - below) / (n - count);
    if (const double between = count * (n - count) * apart * apart; between > largest) {
      largest = between;
      threshold = (values[i] + values[i + 1]) / 2.0;
    }
  }
  return threshold;
}

/// The pressures above 0 of the living elements.
std::vector<double> pressures_of(const Touch& touch) {
  std::vector<double> pressures;
  for (std::size_t e = 0; e < touch.pressure.size(); ++e) {
    if (is_living(touch, e) && touch.pressure[e] > 0.0) {
      pressures.push_back(touch.pressure[e]);
    }
  }
  return pressures;
}

/// Marks the elements that lie within `near_mm` of an element In Contact.
std::vector<bool> near_contact(const TouchEvidence& touch, double near_mm) {
  std::vector<bool> near(touch.readings.size(), false);
  for (const glm::dvec2& contact_mm : touch.contact().elements_mm) {
    for (std::size_t e = 0; e < near.size(); ++e) {
      const glm::dvec2 apart = touch.elements_mm[e] - contact_mm;
      near[e] = near[e] || std::hypot(apart.x, apart.y) <= near_mm;
    }
  }
  return near;
}

/// Otsu's threshold of all pressures above 0, by their logarithms.
double learned_threshold(const std::vector<Press>& presses) {
  std::vector<double> logs;
  for (const Press& press : presses) {
    for (const Touch& touch : press.touches) {
      for (const double pressure : pressures_of(touch)) {
        logs.push_back(std::log(pressure));
      }
    }
  }
  std::ranges::sort(logs);
  if (logs.empty() || logs.front() == logs.back()) {
    throw Error(Fault::input,
                logs.empty() ? "no pressure is above 0: no touch touched anything; check the "
                               "pressure's unit and sign"
                             : fmt::format("all pressures above 0 are {:g}, which tells no contact "
                                           "threshold; give `threshold`",
                                           std::exp(logs.front())));
  }
  return std::exp(otsu_threshold(logs));
}

constexpr double least_sd = 0.05;  ///< least deviation of a logarithm, 5 % of the feature
constexpr double pseudo_presses = 4.0;
/// The largest correlation. Numbers rounded in a file still make a distribution below it.
constexpr double most_correlated = 0.999;

/// The products of the differences from a mean, summed over presses.
struct Scatter {
  double n = 0.0;
  glm::dvec3 mean{0.0};
  glm::dmat3 products{0.0};

  /// Welford's update, which keeps its digits where presses are nearly alike.
  void add(const PressFeatures& features) {
    const auto [area, force, peak] = features.values;
    const glm::dvec3 values(area, force, peak);
    const glm::dvec3 before = values - mean;
    n += 1.0;
    mean += before / n;
    products += glm::outerProduct(before, values - mean);
  }
};

FeatureDistribution distribution_of(const glm::dvec3& mean, const glm::dmat3& covariance) {
  const glm::dvec3 variance(covariance[0][0], covariance[1][1], covariance[2][2]);
  const glm::dvec3 sd = glm::sqrt(variance + least_sd * least_sd);
  const auto correlation = [&](int i, int j) {
    return most_correlated * covariance[i][j] / (sd[i] * sd[j]);
  };
  return {.mean = {mean.x, mean.y, mean.z},
          .sd = {sd.x, sd.y, sd.z},
          .correlation = {correlation(0, 1), correlation(0, 2), correlation(1, 2)}};
}

}  // namespace

std::vector<double> LearnedReadings::level_edges(std::size_t levels) const {
  std::vector<double> edges;
  for (std::size_t level = 2; level < levels && !pressures.empty(); ++level) {
    const double edge = pressures[(level - 1) * pressures.size() / (levels - 1)];
    if (edge > (edges.empty() ? pressures.front() : edges.back())) {
      edges.push_back(edge);
    }
  }
  return edges;
}

LearnedReadings learn_readings(const std::vector<Press>& presses, const ReadingOptions& options) {
  LearnedReadings readings{.spacing_mm = options.spacing_mm};
  if (options.threshold && options.ratio) {
    readings.classifier = {.threshold = *options.threshold, .ratio = *options.ratio};
  } else {
    readings.classifier = learn_classifier(presses, options.threshold);
    readings.classifier.ratio = options.ratio.value_or(readings.classifier.ratio);
  }
  readings.noise = noise_floor(presses, readings.classifier);
  if (!options.threshold) {
    constexpr double noise_sd = 3.0;  // noise alone shall make no contact
    readings.classifier.threshold =
        std::max(readings.classifier.threshold, noise_sd * readings.noise);
  }
  readings.classifier.validate();
  std::vector<TouchEvidence> evidence;
  for (const Press& press : presses) {
    for (const Touch& touch : press.touches) {
      evidence.emplace_back(touch, ContactModel{.classifier = readings.classifier});
      for (std::size_t e = 0; e < touch.pressure.size(); ++e) {
        if (is_contact(evidence.back().readings[e])) {
          readings.pressures.push_back(touch.pressure[e]);
        }
      }
    }
  }
  std::ranges::sort(readings.pressures);
  if (readings.pressures.empty()) {
    throw Error(Fault::input,
                fmt::format("no pressure is above the contact threshold, {:g} {}; give a lower "
                            "`threshold`",
                            readings.classifier.threshold, options.pressure_unit));
  }
  const double spread_mm = at_known_poses(presses) ? usual_spread_mm(options.spacing_mm)
                                                   : unposed_spread_mm(options.spacing_mm);
  readings.maps = options.maps.value_or(
      MapOptions{.cell_mm = 0.5 * options.spacing_mm,
                 .sensor = {.spread_mm = spread_mm, .prior = share_in_contact(evidence)},
                 .classifier = readings.classifier});
  return readings;
}

ContactClassifier learn_classifier(const std::vector<Press>& presses,
                                   std::optional<double> threshold) {
  ContactClassifier classifier{.threshold = threshold ? *threshold : learned_threshold(presses)};
  std::vector<double> shares;
  for (const Press& press : presses) {
    for (const Touch& touch : press.touches) {
      const std::vector<double> pressures = pressures_of(touch);
      const double peak = pressures.empty() ? 0.0 : *std::ranges::max_element(pressures);
      for (std::size_t i = 0; peak > classifier.threshold && i < pressures.size(); ++i) {
        shares.push_back(std::log(pressures[i] / peak));
      }
    }
  }
  std::ranges::sort(shares);
  // Where every touch has one pressure, any ratio does.
  if (!shares.empty() && shares.front() < shares.back()) {
    classifier.ratio = std::exp(otsu_threshold(shares));
  }
  return classifier;
}

double noise_floor(const std::vector<Press>& presses, const ContactClassifier& classifier) {
  constexpr double far = 2.0;  // in spacings
  const ContactModel any_contact{.classifier = {.threshold = classifier.threshold, .ratio = 0.0}};
  double squares = 0.0;
  double count = 0.0;
  bool any_negative = false;
  for (const Press& press : presses) {
    for (const Touch& touch : press.touches) {
      const auto spacing = spacing_of(touch.elements_mm);
      const TouchEvidence evidence(touch, any_contact);
      const std::vector<bool> near =
          near_contact(evidence, spacing ? far * spacing->nearest_mm.most : 0.0);
      for (std::size_t e = 0; e < near.size(); ++e) {
        if (!near[e] && evidence.lives[e] != 0) {
          squares += touch.pressure[e] * touch.pressure[e];
          count += 1.0;
          any_negative = any_negative || touch.pressure[e] < 0.0;
        }
      }
    }
  }
  const double cut = any_negative ? 1.0 : 2.0;
  return count > 0.0 ? std::sqrt(cut * squares / count) : 0.0;
}

double share_in_contact(std::span<const TouchEvidence> touches) {
  double contacts = 0.0;
  double known = 0.0;
  for (const TouchEvidence& touch : touches) {
    contacts += static_cast<double>(touch.contacts);
    known += static_cast<double>(touch.known().readings.size());
  }
  // No array, however it was pressed, says that the world is empty or full.
  constexpr double least = 0.01;
  constexpr double limit = 0.5;
  return std::clamp((contacts + 0.5) / (known + 1.0), least, limit);
}

LearnedFeatures learn_features(std::span<const LabelledFeatures> presses) {
  Scatter all;
  std::map<std::string, Scatter> objects;
  for (const auto& [label, features] : presses) {
    all.add(features);
    objects[label].add(features);
  }
  const glm::dmat3 of_all = all.products / std::max(1.0, all.n - 1.0);
  const double freedoms = all.n - static_cast<double>(objects.size());
  glm::dmat3 pooled = of_all;
  if (freedoms > 0.0) {
    pooled = glm::dmat3(0.0);
    for (const auto& [label, own] : objects) {
      pooled += own.products / freedoms;
    }
  }
  LearnedFeatures learned{.any = distribution_of(all.mean, of_all)};
  for (const auto& [label, own] : objects) {
    const double share = (1.0 + 1.0 / own.n) / (own.n + pseudo_presses);
    learned.objects[label] =
        distribution_of(own.mean, share * (own.products + pseudo_presses * pooled));
  }
  return learned;
}

LearnedFeatures learn_features(const std::vector<Press>& presses,
                               const ContactClassifier& classifier) {
  std::vector<LabelledFeatures> features;
  for (const Press& press : presses) {
    features.push_back({press.label, press_features(press.touches.front(), classifier)});
  }
  return learn_features(features);
}

}  // namespace palpate
