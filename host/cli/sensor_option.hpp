#pragma once

#include <memory>
#include <string>

#include "io/command_files.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/sensor.hpp"

namespace palpate::cli {

inline constexpr const char* sensor_help =
    "A board, by its name in 'palpate sensors' or the path of its profile; "
    "replay:FILE[,speed=F|max], which plays a recording of frames; or "
    "simulate:SHAPE[,rate=HZ][,array=COLUMNS:ROWS:PITCH_MM][,seed=N][,touches=N][,noise=KPA]"
    "[,object=random|X_MM:Y_MM:DEG][,speed=F|max], which simulates a robot that presses an array "
    "onto a shape";

inline constexpr const char* poses_help =
    "File, FIFO or - (standard input) with the poses T_robot_sensor, one line of JSON each: "
    "{\"time\": s since 1970, \"x_mm\": mm, \"y_mm\": mm, \"theta_rad\": rad}; or CSV with a "
    "header of "
    "these names";

/// A sensor; `posed` is the same sensor where --poses gives its poses, else null.
struct OpenSensor {
  std::unique_ptr<Sensor> sensor;
  const PosedSensor* posed = nullptr;
};
/// Opens a board, a replay or a simulation, with the poses of --poses unless `poses` is "". Throws
/// Error naming it, and what may be given instead.
/// @param complain see PosedSensor
OpenSensor open_sensor(const std::string& name, const std::string& poses,
                       PosedSensor::Complaint complain);

/// Adds the file that the sensor reads, if any, and the file of --poses, unless `poses` is "".
void add_sensor_files(const std::string& name, const std::string& poses, CommandFiles& files);
/// Warns on standard error of skipped lines of --poses and of clocks that were set back.
void report_refused(const OpenSensor& opened);

}  // namespace palpate::cli
