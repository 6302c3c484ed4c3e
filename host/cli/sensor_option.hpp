#pragma once

#include <memory>
#include <string>

#include "command_files.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/sensor.hpp"

namespace palpate::cli {

/// What --sensor takes, for its help.
inline constexpr const char* sensor_help =
    "A board, as 'palpate sensors' lists it; replay:FILE[,speed=F|max], a recording of frames; or "
    "simulate:SHAPE[,rate=HZ][,array=COLUMNS:ROWS:PITCH][,seed=N][,touches=N][,noise=KPA]"
    "[,object=random|X:Y:DEG][,speed=F|max], a robot that presses an array onto a shape";

inline constexpr const char* poses_help =
    "File, FIFO or - (standard input) with the sensor's poses, a line each: "
    "{\"time\": s since 1970, \"x_mm\": mm, \"y_mm\": mm, \"theta_rad\": rad}";

/// Opens a board or a virtual sensor. Throws Error naming it and what there is.
std::unique_ptr<Sensor> open_sensor(const std::string& name);

/// Adds what a sensor of this name reads, and the poses of --poses, "" where there are none.
void add_sensor_files(const std::string& name, const std::string& poses, CommandFiles& files);
/// Says on standard error how many lines of the poses were passed over, if any were.
void report_refused(const PosedSensor::Poses& poses);

}  // namespace palpate::cli
