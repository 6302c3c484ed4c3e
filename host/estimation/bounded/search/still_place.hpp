#pragma once

#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/known_elements.hpp"

namespace palpate {

/// Tells whether an array stays where it is from touch to touch. What all of its elements in No
/// Contact add to sums is then worth keeping: a touch adds only what its other elements change.
class StillPlace {
 public:
  enum class Seen {
    moving,   ///< the touch must be added whole
    stopped,  ///< sums of this place are worth keeping from this touch on
    still,    ///< at the place whose sums are kept
  };

  /// Looks at the next touch. Where it stopped, no sums are kept before keep().
  Seen look(const ArrayReadings& touch);
  /// The sums of the last touch's place are kept from now on.
  void keep() { kept_ = last_; }

 private:
  std::vector<glm::dvec2> last_;  ///< places of the last touch's elements
  std::vector<glm::dvec2> kept_;  ///< of those whose sums are kept
};

}  // namespace palpate
