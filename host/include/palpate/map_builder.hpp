#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "palpate/contact.hpp"
#include "palpate/device.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/sensor_model.hpp"

namespace palpate {

/// What a map is made with.
struct MapOptions {
  double cell_mm = 0.5;       ///< edge of a cell
  InverseSensorModel sensor;  ///< also holds the prior
  ContactClassifier classifier;
};

/// Builds an object's occupancy grid from touches at known poses (Sec. II). The object frame is
/// the robot frame of the touches. Updates add up, so their order does not matter. A builder that
/// was moved from throws Error whatever it is asked.
class MapBuilder {
 public:
  /// @throws Error on a cell size, spread, peak, prior, threshold or ratio out of range.
  MapBuilder(Device& device, const MapOptions& options);
  ~MapBuilder();
  MapBuilder(MapBuilder&&) noexcept;
  MapBuilder& operator=(MapBuilder&&) noexcept;

  /// Adds the evidence of these touches, all of it or, where it throws, none. Memory does not grow
  /// with their number, only with the area that they cover.
  /// @throws Error on a touch that is not sound or lies beyond `farthest_mm`, where the area has
  /// more cells than the device holds, or where the device fails: the evidence may then be half
  /// added, and the builder refuses everything but clear()
  void add(std::span<const Touch> touches);

  /// The map of all touches so far. It covers the known elements and the support of the sensor
  /// model around them, no more; each cell is within 1e-3 nats, or a relative 1e-4, of the sum over
  /// all elements, as long as a cell is at most 200 times as wide as the sensor model's spread.
  /// @throws Error if no element of any touch was In Contact or No Contact, on the label
  /// `none_label`, or where the device fails
  OccupancyGrid build(const std::string& label);

  /// Forgets all touches, for the next object.
  void clear();

 private:
  struct Impl;
  Impl& impl() const;
  std::unique_ptr<Impl> impl_;
};

/// The touches of one object.
struct ObjectTouches {
  std::string label;
  std::vector<Touch> touches;
};

/// p(m) estimated as in the paper: the objects' area over the modelled area, pooled over all
/// objects. Both areas are counted on maps built with an even prior, in which a cell is occupied
/// when its evidence speaks for contact and modelled when it has evidence at all.
/// @throws Error as MapBuilder does, naming the object.
double estimate_prior(Device& device, std::span<const ObjectTouches> objects, MapOptions options);

}  // namespace palpate
