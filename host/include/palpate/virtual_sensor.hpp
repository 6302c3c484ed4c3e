#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "palpate/sensor.hpp"

namespace palpate {

/// True for the names that open_virtual_sensor() takes: "replay:..." and "simulate:...".
bool is_virtual_sensor(std::string_view name);

/// The file that a virtual sensor of this name reads: a recording or a polygon file, if any.
/// @throws Error (Fault::input) on an unknown option
std::optional<std::filesystem::path> virtual_sensor_file(const std::string& name);

/// True for a simulation that has no end and gives more than 10 MB of frames a second, by its rate,
/// its speed and its array: whoever keeps its frames needs an end of their own.
/// @throws Error (Fault::input) on an unknown or wrong option
bool is_endless_flood(const std::string& name);

/// A sensor without a board. Its frames wait for whoever is late; none is ever lost.
///
/// "replay:FILE" plays a recording of frames at the speed at which it was recorded. Frames keep
/// their times, poses and losses, so that what is found in them does not depend on the speed.
///
/// "simulate:SHAPE" is a robot that presses a DigiTacts array onto a shape, as make_shape() names
/// it, again and again at random poses where it touches it: it hovers for 1 s, then takes 1 s for
/// each press, 0.3 s on the way there, 0.1 s to press, 0.5 s of steady contact and 0.1 s to lift.
/// An element reads about 3 kPa when nothing touches it, every reading has noise of its own, and
/// T_robot_sensor is known. Without `object` the shape lies at the robot's origin and the stream
/// bears its label; with it the stream is one of an unknown with its truth.
///
/// Both are followed by options, such as "simulate:A,rate=1000,seed=3,object=random,touches=20":
///   speed=F|max   F times as fast, or as fast as frames are taken
/// and of simulate:
///   rate=HZ       frames per second [100]
///   array=COLUMNS:ROWS:PITCH  a grid of elements, the pitch in mm [a DigiTacts array, 6 x 6]
///   seed=N        of presses and noise [1]
///   touches=N     ends after so many presses [never]
///   noise=KPA     standard deviation of each reading's noise [0.7]
///   object=random|X:Y:DEG   T_object_robot of an unknown, in mm and degrees
///
/// @throws Error (Fault::input) on an unknown option or value, a file that is no recording of
/// frames with times, an array that changes
std::unique_ptr<Sensor> open_virtual_sensor(const std::string& name);

}  // namespace palpate
