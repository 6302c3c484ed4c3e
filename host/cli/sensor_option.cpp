#include "sensor_option.hpp"

#include "palpate/driver.hpp"
#include "palpate/virtual_sensor.hpp"

namespace palpate::cli {

std::unique_ptr<Sensor> open_sensor(const std::string& name) {
  return is_virtual_sensor(name) ? open_virtual_sensor(name) : open_board(name);
}

}  // namespace palpate::cli
