#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "learning/press.hpp"
#include "palpate/contact.hpp"
#include "palpate/map_builder.hpp"

namespace palpate {

/// What a sensor's readings are learned with.
struct ReadingOptions {
  std::string pressure_unit = "kPa";
  std::optional<double> threshold;  ///< learned where there is none
  std::optional<double> ratio;      ///< the same
  double spacing_mm = 0.0;          ///< of the elements
};

/// What presses say of a sensor's readings, whatever objects they are of.
struct LearnedReadings {
  ContactClassifier classifier;
  double noise = 0.0;            ///< see noise_floor()
  double prior = 0.2;            ///< see share_in_contact()
  std::optional<double> psf_mm;  ///< where presses at known poses tell the point spread
  double spread_mm = 0.5;        ///< of maps

  /// Options of maps with cells of half a spacing.
  MapOptions maps(double spacing_mm) const;
};

/// The learned threshold is at least three standard deviations of the noise. The maps' spread is
/// half of the point spread's, or 0.6 spacings.
/// @throws Error as learn_classifier(), on a classifier out of range, and where no pressure is
/// above the threshold
LearnedReadings learn_readings(const std::vector<Press>& presses, const ReadingOptions& options);

/// Pressures that part the elements In Contact of all presses into `levels` - 1 levels of about as
/// many elements each; fewer where pressures are the same.
std::vector<double> level_edges_of(const std::vector<Press>& presses,
                                   const ContactClassifier& classifier, std::size_t levels);

}  // namespace palpate
