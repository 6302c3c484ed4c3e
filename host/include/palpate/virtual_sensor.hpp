#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "palpate/api.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// True for the names that open_virtual_sensor() takes: "replay:..." and "simulate:...".
PALPATE_API bool is_virtual_sensor(std::string_view name);

/// Returns the recording or polygon file that a virtual sensor of this name reads, if any.
/// @throws Error (Fault::input) on an unknown option
PALPATE_API std::optional<std::filesystem::path> virtual_sensor_file(const std::string& name);

/// True for a simulation without end that gives frames as fast as they are taken: a recording of it
/// needs a limit.
/// @throws Error (Fault::input) on an unknown or wrong option
PALPATE_API bool is_endless_flood(const std::string& name);

/// Opens a sensor without a board. Its frames wait for a late reader; none is ever lost.
///
/// "replay:FILE" plays a recording of frames at the speed at which it was recorded. Frames keep
/// their times, poses and losses, so that the touches found in them do not depend on the speed.
///
/// "simulate:SHAPE" is a robot that presses a DigiTacts array onto a shape (see make_shape()) at
/// random poses at which the two touch. It hovers for 1 s; each press then takes 1 s: 0.3 s to
/// travel, 0.1 s to press, 0.5 s of steady contact and 0.1 s to lift. Every reading has an offset
/// of about 3 kPa and noise of its own; T_robot_sensor is known. Without `object` the shape lies at
/// the robot's origin and the stream bears its label; with `object` the stream is of an unknown
/// with its truth.
///
/// Options follow either name, as in "simulate:A,rate=1000,seed=3,object=random,touches=20":
///   speed=F|max   F times real time, or as fast as frames are taken [1]
/// and of simulate:
///   rate=HZ       frames per second [100]
///   array=COLUMNS:ROWS:PITCH  a grid of elements, the pitch in mm [a DigiTacts array, 6 x 6]
///   seed=N        of presses and noise [1]
///   touches=N     ends after so many presses [never]
///   noise=KPA     standard deviation of each reading's noise [0.7]
///   object=random|X:Y:DEG   T_object_robot of an unknown, in mm and degrees
///
/// @throws Error (Fault::input) on an unknown option or value, or a file that is no recording of
/// frames with times and one array
PALPATE_API std::unique_ptr<Sensor> open_virtual_sensor(const std::string& name);

}  // namespace palpate
