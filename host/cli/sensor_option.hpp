#pragma once

#include <memory>
#include <string>

#include "command_files.hpp"
#include "palpate/sensor.hpp"

namespace palpate::cli {

/// What --sensor takes, for its help.
inline constexpr const char* sensor_help =
    "A board, as 'palpate sensors' lists it; replay:FILE[,speed=F|max], a recording of frames; or "
    "simulate:SHAPE[,rate=HZ][,array=COLUMNS:ROWS:PITCH][,seed=N][,touches=N][,noise=KPA]"
    "[,object=random|X:Y:DEG][,speed=F|max], a robot that presses an array onto a shape";

/// Opens a board or a virtual sensor. Throws Error naming it and what there is.
std::unique_ptr<Sensor> open_sensor(const std::string& name);

/// Adds what a sensor of this name reads, and the poses of --poses, "" where there are none.
void add_sensor_files(const std::string& name, const std::string& poses, CommandFiles& files);

}  // namespace palpate::cli
