#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "model/touch_evidence.hpp"

namespace palpate {

/// How much touches of one unknown tell beside each other. Readings of one place share what the map
/// lacks there, and do not multiply as those of different places do. So each touch has a weight,
///   w_i = max(0, 1 - sum over earlier j of w_j k(d_ij) min(1, 2 c_j / c_i)),
///   k(d) = max(0, 1 - (d / s)^2),
/// with d the elements' root mean square distance between the two touches, s the elements' spacing
/// and c the number of elements In Contact: a press after a mere brush tells its own. About any
/// place the weights sum to about one, and touches further apart than s keep theirs. The first
/// touch of a place counts whole, whatever comes later, so that beliefs need no second look at it.
class TouchPlaces {
 public:
  void clear() { *this = {}; }
  /// The touch with as many of its known elements as its weight says, spread over the array; the
  /// others are Unknown. So all filters, "(none)" and the fit give it that weight.
  TouchEvidence weighed(const TouchEvidence& touch) const;
  /// weighed() of a touch that belongs to those before from now on.
  TouchEvidence add(const TouchEvidence& touch);
  /// What to say where touches are written twice, or lie so close together that they count as half
  /// as many at most; else "".
  std::string words() const;

 private:
  struct Place {
    glm::dvec2 middle_mm{0.0};  ///< mean of the elements in the robot frame
    double theta_rad = 0.0;
    double square_mm2 = 0.0;  ///< elements' mean squared distance from the middle
    double contacts = 0.0;
    double force = 0.0;  ///< TouchEvidence::force
    double weight = 1.0;
  };

  static Place place_of(const TouchEvidence& touch);
  double weight_of(const Place& place, const TouchEvidence& touch) const;
  TouchEvidence thinned(const TouchEvidence& touch, double weight) const;

  std::vector<Place> places_;  ///< of touches with a weight above 0
  std::size_t touches_ = 0;    ///< In Contact
  std::size_t repeated_ = 0;   ///< of these, equal to an earlier one to the digit
  double counted_ = 0.0;       ///< sum of their weights
};

}  // namespace palpate
