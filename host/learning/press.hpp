#pragma once

#include <string>
#include <vector>

#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Touches of one object that share one unknown pose of the object: a single touch, or several at
/// poses that are known relative to each other. Views into recordings that the caller keeps alive.
struct Press {
  std::string name;   ///< for messages, such as "pen.h5, touch 3"
  std::string label;  ///< of the object
  std::vector<Touch> touches;
};

/// One touch as a press: its pose is unknown, so the robot frame is put where the middle of the
/// array's elements is the origin and theta is 0.
Press single_press(const Recording& recording, std::size_t touch);

/// A recording as one press. The robot frame is moved, not turned, so that the middle of all
/// touches' elements is the origin.
Press posed_press(const Recording& recording);

/// The map that each press makes alone, see observed_map(), in the press's robot frame. Takes all
/// host threads.
/// @throws Error, naming the press, as observed_map() does
std::vector<OccupancyGrid> press_maps(const std::vector<Press>& presses, const MapOptions& options);

}  // namespace palpate
