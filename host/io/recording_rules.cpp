#include "io/recording_rules.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "model/printable.hpp"
#include "model/stream_time.hpp"

namespace palpate {

namespace {

void require_one_of(const std::filesystem::path& path, const char* attribute,
                    const std::string& value, const char* first, const char* second) {
  require_text(path, fmt::format("attribute '{}'", attribute), value);
  if (value != first && value != second) {
    refuse(path, "attribute '{}' = '{}'; make it '{}' or '{}'", attribute, value, first, second);
  }
}

void require_pressures(const std::filesystem::path& path, const Recording& head,
                       std::size_t elements, std::size_t first_row,
                       std::span<const double> pressure) {
  for (std::size_t i = 0; i < pressure.size(); ++i) {
    const std::size_t k = first_row * elements + i;
    const bool alive =
        head.valid.empty() || head.valid[head.valid.size() == elements ? k % elements : k] != 0;
    const bool unknown = head.rows == "frames" && std::isnan(pressure[i]);
    if (!std::isfinite(pressure[i]) && alive && !unknown) {
      refuse(path,
             "dataset 'pressure'[{}, {}] = {}; store finite numbers, and 0 in 'valid' for a dead "
             "element",
             k / elements, k % elements, pressure[i]);
    }
  }
}

void require_poses(const std::filesystem::path& path, bool may_be_unknown, std::size_t first_row,
                   std::span<const Pose> T_robot_sensor) {
  for (std::size_t i = 0; i < T_robot_sensor.size(); ++i) {
    const Pose& pose = T_robot_sensor[i];
    const bool unknown = std::isnan(pose.translation_mm.x) && std::isnan(pose.translation_mm.y) &&
                         std::isnan(pose.theta_rad);
    if (!is_finite(pose) && !(unknown && may_be_unknown)) {
      refuse(path, "dataset 'sensor_pose'[{}] = [{}, {}, {}]; store finite numbers", first_row + i,
             pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad);
    }
  }
}

}  // namespace

void require_rows_of_touches(const Recording& recording) {
  if (recording.rows == "frames") {
    refuse(recording.path,
           "rows = frames, a raw stream; find its touches first, with palpate touches");
  }
}

void require_text(const std::filesystem::path& path, std::string_view field,
                  std::string_view text) {
  if (!is_printable(text)) {
    refuse(path, "{} is not printable UTF-8 text; store it as such", field);
  }
}

void require_head(const std::filesystem::path& path, const Recording& head, std::size_t elements) {
  require_text(path, "attribute 'object'", head.object);
  require_text(path, "attribute 'sensor'", head.sensor);
  require_text(path, "attribute 'serial'", head.serial);
  require_one_of(path, "pressure_unit", head.pressure_unit, "kPa", "raw");
  require_one_of(path, "rows", head.rows, "touches", "frames");
  if (head.truth) {
    require_text(path, "attribute 'true_object'", head.truth->object);
    const Pose& T = head.truth->T_object_robot;
    if (!is_finite(T)) {
      refuse(path, "attribute 'true_T_object_robot' = [{}, {}, {}]; store finite numbers",
             T.translation_mm.x, T.translation_mm.y, T.theta_rad);
    }
  }
  for (std::size_t i = 0; i < head.baseline.size(); ++i) {
    if ((head.valid.size() != elements || head.valid[i] != 0) && !std::isfinite(head.baseline[i])) {
      refuse(path, "dataset 'baseline'[{}] = {}; store finite numbers", i, head.baseline[i]);
    }
  }
}

void require_elements(const std::filesystem::path& path, std::size_t first,
                      std::span<const glm::dvec2> elements_mm) {
  for (std::size_t i = 0; i < elements_mm.size(); ++i) {
    const glm::dvec2& element = elements_mm[i];
    if (!std::isfinite(element.x) || !std::isfinite(element.y)) {
      refuse(path, "dataset 'elements', position {} = [{}, {}]; store finite numbers", first + i,
             element.x, element.y);
    }
  }
}

void require_rows(const std::filesystem::path& path, const Recording& head, std::size_t elements,
                  const Recording& rows, std::size_t first_row) {
  require_pressures(path, head, elements, first_row, rows.pressure);
  require_poses(path, head.rows == "frames", first_row, rows.T_robot_sensor);
  require_elements(path, first_row * elements, rows.elements_mm);
  const auto require = [&](const char* name, const auto& list, const auto& is_sound,
                           const std::string& remedy) {
    const auto found = std::ranges::find_if_not(list, is_sound);
    if (found != list.end()) {
      refuse(path, "dataset '{}'[{}] = {}; {}", name,
             first_row + static_cast<std::size_t>(found - list.begin()), *found, remedy);
    }
  };
  require(
      "time", rows.time_s, [](double time_s) { return std::isfinite(time_s); },
      "store seconds since the Unix epoch");
  require(
      "device_time", rows.device_time_s, [](double time_s) { return !std::isinf(time_s); },
      "store seconds, or NaN where they are unknown");
  require(
      "lost_before", rows.lost_before, [](std::uint64_t lost) { return lost <= largest_count; },
      fmt::format("store counts up to {}", largest_count));
}

}  // namespace palpate
