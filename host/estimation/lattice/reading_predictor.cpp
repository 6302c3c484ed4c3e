#include "estimation/lattice/reading_predictor.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimation/bordered_map.hpp"
#include "model/predicted_readings.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

// Nodes of the table over the log odds. Straight lines between them are off by at most the square
// of a step over 8 times the largest curvature, that of log(1 + exp(l)), 1/4: 3e-5 nats.
constexpr double farthest_log_odds = 16.0;
constexpr std::size_t intervals = 1024;
constexpr std::size_t nodes = intervals + 1;
constexpr double step = 2.0 * farthest_log_odds / intervals;

}  // namespace

ReadingPredictor::ReadingPredictor(std::span<const Hypothesis> hypotheses,
                                   const ContactModel& contact)
    : levels_(reading_levels(contact)), sets_(contact.table ? contact.table->sets() : 1) {
  constexpr int border = shaders::MAP_BORDER;
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.compared();
    maps_.push_back({.first_mm = map.centre_mm(-border, -border),
                     .cells_per_mm = 1.0 / map.cell_mm,
                     .width = map.nx + 2 * border,
                     .height = map.ny + 2 * border,
                     .log_odds = with_border(map, *contact.prior)});
  }
  table_.reserve(sets_ * nodes * levels_);
  for (std::size_t set = 0; set < sets_; ++set) {
    for (std::size_t node = 0; node < nodes; ++node) {
      const MapSample sample{static_cast<double>(node) * step - farthest_log_odds};
      std::array<double, most_reading_levels> logs{};
      for (std::size_t level = 0; level < levels_; ++level) {
        logs[level] = contact.log_likelihood(static_cast<Reading>(level), sample, set);
      }
      const double most = *std::max_element(logs.begin(), logs.begin() + levels_);
      double total = 0.0;
      for (std::size_t level = 0; level < levels_; ++level) {
        total += std::exp(logs[level] - most);
      }
      for (std::size_t level = 0; level < levels_; ++level) {
        table_.push_back(static_cast<float>(logs[level] - most - std::log(total)));
      }
    }
  }
}

void ReadingPredictor::predict(std::size_t object, const Pose& T_object_sensor,
                               std::span<const glm::dvec2> elements_mm, std::span<float> logs,
                               std::size_t stride) const {
  const Map& map = maps_[object];
  const float* const table = table_.data() + (sets_ == 1 ? 0 : object) * nodes * levels_;
  const double c = std::cos(T_object_sensor.theta_rad) * map.cells_per_mm;
  const double s = std::sin(T_object_sensor.theta_rad) * map.cells_per_mm;
  const glm::dvec2 origin = (T_object_sensor.translation_mm - map.first_mm) * map.cells_per_mm;
  // Places beyond the border move onto it, where the map holds the prior as everywhere beyond.
  const double last_column = map.width - 2;
  const double last_row = map.height - 2;
  float* out = logs.data();
  for (const glm::dvec2& element : elements_mm) {
    const double column = std::clamp(origin.x + c * element.x - s * element.y, 0.0, last_column);
    const double row = std::clamp(origin.y + s * element.x + c * element.y, 0.0, last_row);
    const int i = static_cast<int>(column);
    const int j = static_cast<int>(row);
    const auto fx = static_cast<float>(column - i);
    const auto fy = static_cast<float>(row - j);
    const float* const corner =
        map.log_odds.data() + static_cast<std::ptrdiff_t>(j) * map.width + i;
    const float* const above = corner + map.width;
    const float low = corner[0] + fx * (corner[1] - corner[0]);
    const float high = above[0] + fx * (above[1] - above[0]);
    const float log_odds = low + fy * (high - low);
    const float place =
        std::clamp((log_odds + static_cast<float>(farthest_log_odds)) / static_cast<float>(step),
                   0.0F, static_cast<float>(intervals));
    const std::size_t node = std::min(static_cast<std::size_t>(place), intervals - 1);
    const float share = place - static_cast<float>(node);
    const float* const nats = table + node * levels_;
    for (std::size_t level = 0; level < levels_; ++level, out += stride) {
      *out = nats[level] + share * (nats[levels_ + level] - nats[level]);
    }
  }
}

}  // namespace palpate
