#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Below it powers of two would have to be taken out every 33 elements or oftener.
constexpr double least_ratio = 0x1p-30;
/// Stands for log 0: below all log odds.
constexpr double log_zero = -1e38;

/// See ReadingForm::rows.
std::vector<double> rows_of(const LikelihoodTable& table) {
  std::vector<double> rows;
  rows.reserve(2 * table.log_likelihood.size());
  const auto nodes = static_cast<std::ptrdiff_t>(table.nodes);
  for (auto of = table.log_likelihood.begin(); of != table.log_likelihood.end(); of += nodes) {
    rows.insert(rows.end(), of, of + nodes);
    for (auto node = of; node + 1 != of + nodes; ++node) {
      rows.push_back(node[1] - node[0]);
    }
    rows.push_back(0.0);
  }
  return rows;
}

/// Elements whose numerators, in [ratio, 2], and denominators, in [1, 2], a product takes before it
/// could leave 2^+-1000. Each starts within [1, 2).
int interval_of(double ratio) {
  return static_cast<int>(std::min(64.0, 999.0 / std::max(1.0, -std::log2(ratio))));
}

}  // namespace

MapPatches::MapPatches(const OccupancyGrid& map, double prior)
    : width_(0), height_(0), prior_log_odds_(log_odds_from_probability(prior)) {
  // Kernels hold the index of a node in 32 bits.
  const std::int64_t width = std::int64_t{map.nx} + 2 * border;
  const std::int64_t height = std::int64_t{map.ny} + 2 * border;
  if (width * height > std::numeric_limits<std::int32_t>::max()) {
    throw Error(Fault::input, fmt::format("map \"{}\": {} x {} cells and a border are too many for "
                                          "`filter bounded`; use larger cells",
                                          map.label, map.nx, map.ny));
  }
  width_ = static_cast<int>(width);
  height_ = static_cast<int>(height);
  const auto node = [&](std::int64_t column, std::int64_t row) {
    const std::int64_t i = column - border;
    const std::int64_t j = row - border;
    return i >= 0 && i < map.nx && j >= 0 && j < map.ny
               ? map.at(static_cast<int>(i), static_cast<int>(j))
               : marker;
  };
  // A vector of 16 floats may start as far as one column and one row into the last patch.
  constexpr std::size_t beyond = side * side;
  nodes_.reserve(static_cast<std::size_t>(width * height) * side + beyond);
  for (std::int64_t y = 0; y < height; ++y) {
    for (std::int64_t x = 0; x < width; ++x) {
      for (int row = 0; row < side; ++row) {
        nodes_.push_back(node(x, y + row));
      }
    }
  }
  nodes_.resize(nodes_.size() + beyond, marker);
}

ReadingForm::ReadingForm(const ContactModel& contact) {
  if (contact.table) {
    const LikelihoodTable& from = *contact.table;
    kind = Kind::table;
    nodes = from.nodes;
    readings = from.levels();
    sets = from.sets();
    first_log_odds = from.first_log_odds;
    nodes_per_nat = static_cast<double>(nodes - 1) / (from.last_log_odds - from.first_log_odds);
    rows = rows_of(from);
    return;
  }
  const double floor = contact.gamma * contact.prior.value();
  const double scale = floor + (1.0 - contact.gamma);
  log_scale = std::log(scale);
  ratio = floor / scale;
  if (ratio >= least_ratio) {
    log_ratio = std::log(ratio);
    interval = interval_of(ratio);
    return;
  }
  kind = Kind::logs;
  log_ratio = contact.gamma > 0.0
                  ? std::log(contact.gamma) + std::log(contact.prior.value()) - log_scale
                  : log_zero;
}

TableExtent ReadingForm::table_extent(std::size_t object) const {
  TableExtent extent{.width = static_cast<double>(nodes - 1) / nodes_per_nat};
  for (std::size_t reading = 0; reading < readings; ++reading) {
    const double* of = values(object, static_cast<Reading>(reading));
    for (std::size_t i = 0; i < nodes; ++i) {
      extent.largest = std::max(extent.largest, std::abs(of[i]));
      extent.steepest = std::max(extent.steepest, std::abs(of[nodes + i]) * nodes_per_nat);
    }
  }
  return extent;
}

double ReadingForm::largest_nats(double largest_log_odds) const {
  return std::min(largest_log_odds, std::abs(log_ratio)) + 1.0 + std::abs(log_scale);
}

}  // namespace palpate
