#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact_model.hpp"
#include "palpate/fit.hpp"
#include "palpate/learned_sensor.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// What a touch says (Eq. 3), classified once. It holds copies: the touch's memory may go. Elements
/// stay in the sensor frame, since an uncertain touch is displaced with its sensor.
struct TouchEvidence {
  TouchEvidence() = default;
  /// @throws Error on a touch that is not sound, or a classifier out of range
  TouchEvidence(const Touch& touch, const ContactModel& contact) { assign(touch, contact); }
  /// As if made anew of this touch, in the same memory.
  void assign(const Touch& touch, const ContactModel& contact);

  bool in_contact() const { return contacts > 0; }
  /// Whether an element is not Unknown. A touch that tells nothing changes no belief.
  bool tells() const;
  /// Place of the array's middle in the robot frame.
  glm::dvec2 middle_mm() const { return T_robot_sensor * array_centre_mm(elements_mm); }
  /// The evidence without the elements that are Unknown.
  TouchEvidence known() const;
  /// The evidence of the elements In Contact alone.
  TouchEvidence contact() const;

  Pose T_robot_sensor;
  std::vector<glm::dvec2> elements_mm;  ///< [e] in the sensor frame
  std::vector<Reading> readings;        ///< [e]
  std::vector<std::uint8_t> lives;      ///< [e] 0: dead, or without a number for its pressure
  std::size_t contacts = 0;             ///< elements In Contact
  /// Pressures of the elements that live, in the recording's unit; where none lives, the least is
  /// above the largest.
  double least_pressure = std::numeric_limits<double>::infinity();
  double largest_pressure = -std::numeric_limits<double>::infinity();
  double force = 0.0;  ///< sum of the pressures above 0, in contact thresholds
};

/// Whether an element of a touch is alive and has a number for its pressure.
bool is_living(const Touch& touch, std::size_t element);

std::vector<TouchEvidence> evidence_of(std::span<const Touch> touches, const ContactModel& contact);
/// evidence_of() in the memory of `room` from `first` on, which grows where it is too small.
std::span<const TouchEvidence> evidence_of(std::span<const Touch> touches,
                                           const ContactModel& contact,
                                           std::vector<TouchEvidence>& room, std::size_t first = 0);

/// press_features() of a touch that is classified.
/// @param threshold of the classifier
PressFeatures features_of(const TouchEvidence& touch, double threshold);

/// What one touch adds to the sums of fit_of().
struct FitSums {
  double deviation = 0.0;  ///< of the log-likelihood from its predicted mean, in nats
  double variance = 0.0;   ///< predicted
};
/// The sums of fit_of() of each touch, which is classified by `contact`, [touch]; none of a touch
/// without a known element.
std::vector<std::optional<FitSums>> fit_sums(std::span<const TouchEvidence> touches,
                                             const Pose& T_object_robot, const OccupancyGrid& map,
                                             const ContactModel& contact,
                                             const DisplacementSd& touch_sd, std::size_t object);
/// The fit of these touches together; none where no element is known.
std::optional<Fit> combined_fit(std::span<const std::optional<FitSums>> sums);
/// fit_of() of touches that are classified by `contact`.
std::optional<Fit> evidence_fit(std::span<const TouchEvidence> touches, const Pose& T_object_robot,
                                const OccupancyGrid& map, const ContactModel& contact,
                                const DisplacementSd& touch_sd, std::size_t object);

/// ContactModel::classify() in the memory of `reuse`, for a filter that allocates nothing in an
/// update.
std::vector<Reading> classify(const Touch& touch, const ContactModel& model,
                              std::vector<Reading> reuse);

/// A table's numbers of a level for an object, [node]; those of the levels above it follow.
inline std::span<const double> numbers_of(const LikelihoodTable& table, Reading level,
                                          std::size_t object) {
  const std::size_t of_a_set = table.levels() * table.nodes;
  const std::size_t set = table.log_likelihood.size() == of_a_set ? 0 : object;
  const std::size_t first = set * of_a_set + static_cast<std::size_t>(level) * table.nodes;
  return std::span(table.log_likelihood).subspan(first, table.nodes);
}
inline double nodes_per_nat(const LikelihoodTable& table) {
  return static_cast<double>(table.nodes - 1) / (table.last_log_odds - table.first_log_odds);
}
/// @throws Error: a table of so many levels and sets of numbers has none for this reading or object
[[noreturn]] void refuse_reading(std::size_t levels, std::size_t sets, Reading reading,
                                 std::size_t object);

/// A model without a table as one with Eq. 7 in a table, which is read several times faster: within
/// 1e-4 nats of Eq. 7, unless gamma is so small that log odds beyond +-16 matter. A model with a
/// table as it is.
/// @param contact with a prior
ContactModel tabulated(ContactModel contact);

/// A model that gives every reading but Unknown its log-probability, log P(r | l) / sum over all r'
/// of P(r' | l), in a table: within 2e-4 nats of Eq. 7, log odds beyond +-16 as at +-16.
/// @param contact with a prior
ContactModel predictive(ContactModel contact);

}  // namespace palpate
