#include "sensor_option.hpp"

#include "palpate/driver.hpp"
#include "palpate/virtual_sensor.hpp"

namespace palpate::cli {

std::unique_ptr<Sensor> open_sensor(const std::string& name) {
  return is_virtual_sensor(name) ? open_virtual_sensor(name) : open_board(name);
}

void add_sensor_files(const std::string& name, const std::string& poses, CommandFiles& files) {
  if (const auto file = is_virtual_sensor(name) ? virtual_sensor_file(name) : board_file(name)) {
    files.reads("--sensor", *file);
  }
  if (!poses.empty()) {
    files.reads("--poses", poses);
  }
}

}  // namespace palpate::cli
