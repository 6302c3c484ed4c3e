#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/contact.hpp"
#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/fit.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Smallest prior of a map, and smallest 1 - prior: beyond these, increments in float32 miss the
/// tolerance of MapBuilder::build().
inline constexpr double least_prior = 1e-6;

/// Smallest peak: a reading with a smaller one says nothing.
inline constexpr double least_peak = 1e-6;

/// The inverse sensor model of Eq. 4-6: how much one element's reading changes the log odds of the
/// cells around it. The printed equations contradict each other; the consistent reading is
///   G'(d) = peak * exp(-d^2 / (2 spread^2)),
///   p = m + (1 - m) G' (In Contact), m - m G' (No Contact), m (Unknown),
///   increment = log(p / (1 - p)) - log(m / (1 - m)).
struct PALPATE_API InverseSensorModel {
  double spread_mm = 0.5;  ///< half the standard deviation of the sensor's point spread
  double peak = 0.9;       ///< at most 0.9999: at 1 a single reading would make a cell certain
  double prior = 0.2;      ///< m

  /// Throws Error unless least_length_mm <= spread_mm <= most_length_mm (see OccupancyGrid),
  /// least_peak <= peak <= 0.9999 and least_prior <= prior <= 1 - least_prior.
  void validate() const;
  /// Log-odds increment of a cell whose centre is this far from the element's, in nats (Eq. 5).
  double increment(Reading reading, double distance_mm) const;
  /// Distance beyond which this many increments together stay below `tolerance` nats, in mm.
  double support_radius_mm(std::size_t readings, double tolerance) const;
};

/// Resolution, sensor model and contact classifier of a map.
struct PALPATE_API MapOptions {
  double cell_mm = 0.5;            ///< edge of a cell
  InverseSensorModel sensor = {};  ///< also holds the prior
  ContactClassifier classifier = {};

  /// Throws Error on a cell size, spread, peak, prior, threshold or ratio out of range.
  void validate() const;
};

/// Builds an object's occupancy grid from touches at known poses (Sec. II) by adding up the
/// log-odds increments of Eq. 4-6, in any order. The object frame is the robot frame of the
/// touches. Every call on a moved-from builder throws Error.
class PALPATE_API MapBuilder {
 public:
  /// @throws Error as MapOptions::validate()
  MapBuilder(Device& device, const MapOptions& options);

  /// Adds the evidence of all these touches. Memory grows with the area that they cover, not with
  /// their number.
  /// @throws Error on a touch that is not sound or lies beyond `farthest_mm`, or where the area has
  /// more cells than the device holds, and adds none of them; Error where the device fails: the
  /// touches may then be added in part, and every call but clear() throws
  void add(std::span<const Touch> touches);

  /// Returns the map of all touches so far. It covers the known elements and the sensor model's
  /// support around them. Where a cell is at most 200 spreads wide, its log odds lie within
  /// max(1e-3 nats, 1e-4 of their value) of the sum over all elements.
  /// @throws Error if no element of any touch was In Contact or No Contact, on the label
  /// `none_label`, or where the device fails
  OccupancyGrid build(const std::string& label);

  /// Forgets all touches, for the next object.
  void clear();

 private:
  struct PALPATE_LOCAL Impl;
  PALPATE_LOCAL Impl& impl() const;
  std::unique_ptr<Impl, void (*)(Impl*)> impl_{nullptr, nullptr};
};

/// The touches of one object.
struct ObjectTouches {
  std::string label;
  std::vector<Touch> touches;
};

/// What a map was built from: enough to build it again with another prior.
struct MapSource {
  /// Their poses are those of the sensor in the frame in which the object was learned, see
  /// centre_frame().
  Recording touches;
  MapOptions options;
  /// What the z of single touches is like by Eq. 7 with gamma 0.1, each at its pose on a map of the
  /// others: mean and sd alone. None where too few touches tell.
  std::optional<FitScale> left_out = {};
  /// How far the poses of some of the touches are off on a map of the others, by Eq. 7 as above.
  std::optional<PoseScale> pose_scale = {};
  /// [touch] whose it is, such as a person's or a day's: touches of a group are left out together
  /// for `left_out` and `pose_scale`. Empty: there are no groups.
  std::vector<std::string> groups = {};
};

/// Returns the map as its `source` makes it with another prior, and what its touches are like where
/// they are left out; its frame, its layers and all else stay.
/// @throws Error where it has no source, and as MapBuilder does
PALPATE_API OccupancyGrid with_prior(Device& device, const OccupancyGrid& map, double prior);

/// Estimates p(m) as estimate_prior() does, from the sources of maps and the cells of drawn ones.
/// @throws Error where a map that is not drawn has no source, and as MapBuilder does
PALPATE_API double pooled_prior(Device& device, std::span<const OccupancyGrid> maps);

/// Estimates p(m) as in the paper: occupied area over modelled area, pooled over all objects. The
/// areas are counted on maps built with a prior of 0.5: a cell is occupied where its log odds
/// exceed 1e-3 nats, and modelled where |log odds| does.
/// @throws Error as MapBuilder does
PALPATE_API double estimate_prior(Device& device, std::span<const ObjectTouches> objects,
                                  MapOptions options);

}  // namespace palpate
