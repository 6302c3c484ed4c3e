#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "learning/press.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

/// How a sensor's readings are learned.
struct ReadingOptions {
  std::string pressure_unit = "kPa";
  std::optional<double> threshold;  ///< learned where there is none
  std::optional<double> ratio;      ///< learned where there is none
  double spacing_mm = 0.0;          ///< between the elements
  /// How the maps are built that readings are compared with; none: as the readings say.
  std::optional<MapOptions> maps = {};
};

/// What presses say of a sensor's readings, whatever objects they are of.
struct LearnedReadings {
  ContactClassifier classifier;
  double noise = 0.0;             ///< see noise_floor()
  std::vector<double> pressures;  ///< of all elements In Contact, ascending
  double spacing_mm = 0.0;        ///< between the elements
  MapOptions maps;                ///< the given ones, or else with cells of half a spacing

  /// Pressures that part the elements In Contact into `levels` - 1 levels of about as many elements
  /// each; fewer where pressures are the same.
  std::vector<double> level_edges(std::size_t levels) const;
};

/// The spread of maps of presses at unknown poses, which leaves no gaps between their elements.
constexpr double unposed_spread_mm(double spacing_mm) { return 0.6 * spacing_mm; }

/// Learns the classifier, then what it makes of the presses. A learned threshold is at least three
/// standard deviations of the noise. The maps' spread is usual_spread_mm() at known poses, and
/// unposed_spread_mm() at unknown ones. Where their options are given, spread and prior are theirs.
/// @throws Error as learn_classifier(), on a classifier out of range, and where no pressure is
/// above the threshold
LearnedReadings learn_readings(const std::vector<Press>& presses, const ReadingOptions& options);

/// The contact threshold T and ratio of touches, by Otsu's method (1979): the threshold parts the
/// logarithms of all pressures above 0 into two classes of the largest variance between them. The
/// ratio parts pressures relative to the largest of their touch likewise, in touches that exceed T;
/// it is the usual ratio where all of them are alike.
/// @param threshold the T to learn the ratio for, where it is known
/// @throws Error where T is to be learned and no pressure is above 0, or all are alike
ContactClassifier learn_classifier(const std::vector<Press>& presses,
                                   std::optional<double> threshold = {});

/// Standard deviation of untouched elements: of those farther than two element spacings from any
/// element In Contact of their touch. Where no pressure is negative, half of the noise is taken to
/// be cut off at 0. 0 where there are no such elements.
double noise_floor(const std::vector<Press>& presses, const ContactClassifier& classifier);

/// The share of elements In Contact among the known ones, in [0.01, 0.5]: the object's area over
/// the area that touches sensed.
double share_in_contact(std::span<const TouchEvidence> touches);

/// The features of a press of an object, after its label.
using LabelledFeatures = std::pair<std::string, PressFeatures>;

/// The distribution of each object's features. An object's covariance is drawn towards that of all
/// presses about the means of their objects, as if four presses more had varied so:
/// C = (n C_object + 4 C_pooled) / (n + 4) * (1 + 1 / n) + 0.05^2 I, where the factor is what the
/// mean of n presses misses, and the last term keeps presses that were all alike from being
/// demanded alike. Where every object has one press, all presses' covariance stands for the pooled
/// one. `any` has the mean and covariance of all presses. The weight stays 0.
/// @param presses at least one
LearnedFeatures learn_features(std::span<const LabelledFeatures> presses);
/// The distributions of presses' features, each press by its first touch.
LearnedFeatures learn_features(const std::vector<Press>& presses,
                               const ContactClassifier& classifier);

}  // namespace palpate
