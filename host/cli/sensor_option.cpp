#include "cli/sensor_option.hpp"

#include <utility>

#include <fmt/format.h>

#include "palpate/driver.hpp"
#include "palpate/virtual_sensor.hpp"

namespace palpate::cli {

OpenSensor open_sensor(const std::string& name, const std::string& poses,
                       PosedSensor::Complaint complain) {
  auto sensor = is_virtual_sensor(name) ? open_virtual_sensor(name) : open_board(name);
  if (poses.empty()) {
    return {std::move(sensor)};
  }
  auto posed = std::make_unique<PosedSensor>(std::move(sensor), poses, PosedSensor::usual_gap_s,
                                             std::move(complain));
  const PosedSensor* const same = posed.get();
  return {std::move(posed), same};
}

void add_sensor_files(const std::string& name, const std::string& poses, CommandFiles& files) {
  if (const auto file = is_virtual_sensor(name) ? virtual_sensor_file(name) : board_file(name)) {
    files.reads("--sensor", *file);
  }
  if (!poses.empty()) {
    files.reads("--poses", poses, CommandFiles::Dash::stream);
  }
}

void report_refused(const OpenSensor& opened) {
  if (opened.posed == nullptr) {
    return;
  }
  const PosedSensor::Poses poses = opened.posed->poses();
  if (poses.refused > 0) {
    fmt::print(stderr, "palpate: {} lines of poses were skipped; the first: {}\n", poses.refused,
               poses.first_refused);
  }
  if (poses.set_back > 0) {
    fmt::print(stderr, "palpate: the clock of the poses was set back {}\n",
               poses.set_back == 1 ? "once" : fmt::format("{} times", poses.set_back));
  }
}

}  // namespace palpate::cli
