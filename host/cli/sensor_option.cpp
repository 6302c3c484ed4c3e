#include "sensor_option.hpp"

#include <fmt/format.h>

#include "palpate/driver.hpp"
#include "palpate/virtual_sensor.hpp"

namespace palpate::cli {

std::unique_ptr<Sensor> open_sensor(const std::string& name) {
  return is_virtual_sensor(name) ? open_virtual_sensor(name) : open_board(name);
}

void report_refused(const PosedSensor::Poses& poses) {
  if (poses.refused > 0) {
    fmt::print(stderr, "palpate: {} lines were no poses or out of order; the first: {}\n",
               poses.refused, poses.first_refused);
  }
}

}  // namespace palpate::cli
