#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "press_readings.hpp"
#include "reading_gains.hpp"

namespace palpate {

/// A press with the sides on which it may lie.
struct SearchedPress {
  std::vector<PressReadings> sides;  ///< as it is and, where asked for, mirrored
};

/// The best place of a press on a map.
struct PressPlace {
  Pose T_object_sensor;  ///< after the press is mirrored, where it is
  bool mirrored = false;
  /// Log-likelihood of the press's readings here minus that far beyond the map, in nats.
  double gain = 0.0;
  /// Posterior probability, with tempered likelihoods, of the places at which the press's contact
  /// lies within two steps (root mean square) of this one.
  double certainty = 0.0;
  double log_places = 0.0;  ///< log of the number of places that were compared
};

/// A map as presses are compared with it.
struct SearchedMap {
  const OccupancyGrid& map;       ///< its occupied cells say where to search
  const OccupancyGrid& compared;  ///< what ReadingGains is over; see Hypothesis::compared()
};

/// Finds the best pose of presses on a map, by the sum of their readings' gains. Compares all poses
/// of a lattice: angles over the full circle, and translations in steps along the turned array's
/// axes that bring the middle of the press's contact onto the box around the map's occupied cells,
/// or beside it by up to a quarter of the contact's extent. Then climbs from the best of them.
///
/// At each angle the map is read at the lattice's nodes alone, and sums along rows of nodes give
/// every run of elements that read alike in two look-ups.
class PressSearch {
 public:
  /// @param step_mm of the lattice; that of PressReadings
  /// @param temperature by which log-likelihoods are divided for PressPlace::certainty:
  /// neighbouring elements are not independent
  PressSearch(ReadingGains gains, double step_mm, int angles, double temperature);

  /// The best place of each press, [press]. Uses all cores; the result does not depend on their
  /// number. A press without contact, and any press on a map without a cell that is occupied, has a
  /// gain of 0 at no place.
  std::vector<PressPlace> best_places(std::span<const SearchedPress* const> presses,
                                      const SearchedMap& map) const;
  PressPlace best_place(const SearchedPress& press, const SearchedMap& map) const {
    const SearchedPress* one = &press;
    return best_places(std::span(&one, 1), map).front();
  }

  enum class Elements { all, in_contact };
  /// The gain of a press at any pose, or the share of its elements In Contact in it, in nats.
  double gain(const PressReadings& press, const OccupancyGrid& compared,
              const Pose& T_object_sensor, Elements of = Elements::all) const;

 private:
  struct Scores;
  struct Found;
  std::vector<Scores> scores_at(int angle, std::span<const SearchedPress* const> presses,
                                const SearchedMap& map) const;
  PressPlace best_of(const SearchedPress& press, std::span<const Scores> scores,
                     const SearchedMap& map) const;
  Found climb(const PressReadings& press, const OccupancyGrid& compared, Found from) const;
  double theta(int angle) const;

  ReadingGains gains_;
  double step_mm_;
  int angles_;
  double temperature_;
};

}  // namespace palpate
