#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Most classes of readings that a contact model tells apart, besides Unknown.
inline constexpr std::size_t most_reading_levels = 8;

/// What one element says about the surface below it (Eq. 3). The values between `in_contact` and
/// `unknown` are In Contact too, at higher levels of pressure (see LikelihoodTable).
enum class Reading : std::uint8_t {
  no_contact = 0,
  in_contact = 1,
  unknown = most_reading_levels,  ///< changes nothing, anywhere
};

/// In Contact at the given level of pressure, counted from 0, `in_contact` itself.
constexpr Reading contact_level(std::size_t level) { return static_cast<Reading>(1 + level); }

/// True for In Contact at any level.
constexpr bool is_contact(Reading reading) {
  return reading != Reading::no_contact && reading != Reading::unknown;
}

/// Eq. 3: In Contact where the pressure exceeds both the threshold and ratio times the touch's
/// largest pressure, No Contact where it is below both, else Unknown (which includes equality).
/// Dead elements, and those whose pressure is no number, are Unknown and do not take part in the
/// maximum.
struct PALPATE_API ContactClassifier {
  double threshold = 2.0;  ///< in the recording's pressure unit
  double ratio = 0.3;      ///< of the touch's largest pressure, in [0, 1)

  /// Throws Error unless the threshold is finite and at least 0 and the ratio in [0, 1). With NaN,
  /// or a ratio of 1 or more, no element could ever count as touched.
  void validate() const;
  /// The class of every element, [e]. Throws Error on a touch that is not sound, or as validate()
  /// does.
  std::vector<Reading> classify(const Touch& touch) const;
};

/// An element that is not Unknown, in the robot frame.
struct ElementReading {
  glm::dvec2 position_mm;
  Reading reading;
};

/// The elements of the touch that say something, in the array's order.
PALPATE_API std::vector<ElementReading> known_readings(const Touch& touch,
                                                       const ContactClassifier& classifier);

/// Returns why readings cannot be mapped, with the remedy, as one line of text: an element lies
/// beyond `farthest_mm` of the robot frame's origin. None where all readings can be mapped.
PALPATE_API std::optional<std::string> fault_of(std::span<const ElementReading> readings);

}  // namespace palpate
