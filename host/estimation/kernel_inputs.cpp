#include "estimation/kernel_inputs.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "estimation/kernel_sizes.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

// Cells that are told apart, and what stands for those beyond. Clamped to the same bound, an
// element and a bin that are both beyond would meet on the map. So they never do: these differ from
// each other, and from what is told apart, by some 2^28 cells, the side of no map that a device
// holds.
constexpr int farthest_cell = 1 << 29;
constexpr int element_beyond = (1 << 30) - 1;
constexpr int axis_beyond = 3 << 28;

shaders::Split split(double coordinate_cells, int beyond) {
  if (!(std::abs(coordinate_cells) < farthest_cell)) {
    return {std::signbit(coordinate_cells) ? -beyond : beyond, 0.0F};
  }
  const double cell = std::floor(coordinate_cells);
  return {static_cast<int>(cell), static_cast<float>(coordinate_cells - cell)};
}

std::uint64_t cell_bytes(gpu::Access access) {
  return access == gpu::Access::table ? sizeof(shaders::Corners) : sizeof(float);
}

/// The nodes of with_border(), each with the three above and to its right: a kernel interpolates
/// from one. Beyond the border lies the prior.
std::vector<shaders::Corners> corners_with_border(const OccupancyGrid& map, double prior) {
  const std::vector<float> nodes = with_border(map, prior);
  const std::size_t width = static_cast<std::size_t>(map.nx) + 2 * shaders::MAP_BORDER;
  // The border's last row and column are the prior, as is what lies beyond them.
  const auto node = [&](std::size_t i) { return nodes[std::min(i, nodes.size() - 1)]; };
  std::vector<shaders::Corners> corners;
  corners.reserve(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    corners.push_back({nodes[i], node(i + 1), node(i + width), node(i + width + 1)});
  }
  return corners;
}

// Eight factors of at least this multiply to 1e-24, and the kernel's clamp of the odds at 2^-30
// changes them by less than one part in 1e6.
constexpr double least_product_floor = 1e-3;

std::uint32_t bits(double value) { return std::bit_cast<std::uint32_t>(static_cast<float>(value)); }

}  // namespace

std::vector<float> with_border(const OccupancyGrid& map, double prior) {
  constexpr int border = shaders::MAP_BORDER;
  const int width = map.nx + 2 * border;
  std::vector<float> cells(static_cast<std::size_t>(width) * (map.ny + 2 * border),
                           static_cast<float>(log_odds_from_probability(prior)));
  for (int j = 0; j < map.ny; ++j) {
    const auto row = map.log_odds.begin() + static_cast<std::ptrdiff_t>(j) * map.nx;
    std::copy(row, row + map.nx,
              cells.begin() + static_cast<std::ptrdiff_t>(j + border) * width + border);
  }
  return cells;
}

std::uint64_t bordered_cells(const OccupancyGrid& map) {
  constexpr std::uint64_t border = 2 * shaders::MAP_BORDER;
  return (map.nx + border) * (map.ny + border);
}

std::uint64_t most_map_cells(const gpu::Limits& limits, gpu::Access access) {
  const std::uint64_t limit = std::min(limits.allocation, limits.memory);
  return access == gpu::Access::table
             ? std::min<std::uint64_t>(limits.table_texels, limit / cell_bytes(access))
             : std::min(limits.storage_range, limit) / cell_bytes(access);
}

std::uint64_t most_map_cells(const gpu::Limits& limits) {
  return std::max(most_map_cells(limits, gpu::Access::table),
                  most_map_cells(limits, gpu::Access::storage));
}

std::optional<gpu::Access> map_access(const gpu::Limits& limits, std::uint64_t cells) {
  for (const gpu::Access access : {gpu::Access::table, gpu::Access::storage}) {
    if (cells <= most_map_cells(limits, access)) {
      return access;
    }
  }
  return {};
}

BorderedMaps::BorderedMaps(gpu::Context& context, gpu::Access access, std::uint64_t cells,
                           std::string_view purpose)
    : nodes_(context, cells * cell_bytes(access), gpu::Memory::device, purpose,
             access == gpu::Access::table ? VK_FORMAT_R32G32B32A32_SFLOAT : VK_FORMAT_UNDEFINED) {}

int BorderedMaps::add(gpu::CommandStream& stream, const OccupancyGrid& map, double prior) {
  const std::uint64_t first = added_;
  if (nodes_.is_table()) {
    stream.upload(nodes_, corners_with_border(map, prior), first * sizeof(shaders::Corners));
  } else {
    stream.upload(nodes_, with_border(map, prior), first * sizeof(float));
  }
  added_ += bordered_cells(map);
  return static_cast<int>(first);
}

shaders::Split split(double coordinate_cells) { return split(coordinate_cells, element_beyond); }

shaders::Split split_axis(double coordinate_cells) { return split(coordinate_cells, axis_beyond); }

std::vector<shaders::RotatedElement> rotated_elements(std::span<const glm::dvec2> from_pivot_mm,
                                                      const Axis& theta_rad, double cell_mm,
                                                      std::vector<shaders::RotatedElement> reuse) {
  std::vector<shaders::RotatedElement> rotated = std::move(reuse);
  rotated.clear();
  rotated.reserve(from_pivot_mm.size() * static_cast<std::size_t>(theta_rad.count));
  for (int t = 0; t < theta_rad.count; ++t) {
    const double c = std::cos(theta_rad.centre(t)) / cell_mm;
    const double s = std::sin(theta_rad.centre(t)) / cell_mm;
    for (const glm::dvec2& p : from_pivot_mm) {
      rotated.push_back({split(c * p.x - s * p.y), split(s * p.x + c * p.y)});
    }
  }
  return rotated;
}

std::vector<shaders::Split> axes_in_cells(const OccupancyGrid& map, const PoseLattice& lattice) {
  std::vector<shaders::Split> places;
  const auto append = [&](const Axis& axis_mm, double origin_mm) {
    for (int i = 0; i < axis_mm.count; ++i) {
      places.push_back(
          split_axis((axis_mm.centre(i) - origin_mm) / map.cell_mm + shaders::MAP_BORDER));
    }
  };
  append(lattice.x_mm, map.origin_mm.x);
  append(lattice.y_mm, map.origin_mm.y);
  return places;
}

std::vector<std::uint32_t> contact_constants(const gpu::Limits& limits, const ContactModel& model) {
  const std::uint32_t lanes = independent_lanes(limits);
  if (const auto& table = model.table) {
    return {lanes,
            shaders::AS_TABLE,
            0,
            0,
            bits(table->first_log_odds),
            bits(nodes_per_nat(*table)),
            static_cast<std::uint32_t>(table->nodes)};
  }
  const double floor = model.gamma * model.prior.value();
  const bool as_logs = !(floor >= least_product_floor);
  // A product of two small numbers may be 0 where both logarithms are sound.
  const double log_floor =
      model.gamma > 0.0 ? std::log(model.gamma) + std::log(*model.prior) : shaders::NO_FLOOR;
  return {lanes,
          as_logs ? shaders::AS_LOGS : shaders::AS_PRODUCTS,
          bits(as_logs ? log_floor : floor),
          bits(1.0 - model.gamma),
          0,
          0,
          0};
}

ContactTable::ContactTable(gpu::Context& context, gpu::CommandStream& stream,
                           const ContactModel& model) {
  const std::uint64_t count = model.table ? model.table->log_likelihood.size() : 1;
  const std::uint64_t limit = std::min<std::uint64_t>(
      context.limits().table_texels, context.limits().allocation / sizeof(shaders::TableNode));
  if (count > limit) {
    throw Error(
        Fault::input,
        fmt::format("likelihood table: its {} nodes on the device exceed the {} that device '{}' "
                    "reads; use fewer nodes, levels or objects",
                    count, limit, context.name()));
  }
  std::vector<shaders::TableNode> nodes;
  if (const auto& table = model.table) {
    nodes_of_a_set_ = table->sets() == 1 ? 0 : table->levels() * table->nodes;
    const std::vector<double>& nats = table->log_likelihood;
    for (std::size_t i = 0; i < nats.size(); ++i) {
      const bool last = (i + 1) % table->nodes == 0;  // of its level
      nodes.push_back({.nats = static_cast<float>(nats[i]),
                       .rise = last ? 0.0F : static_cast<float>(nats[i + 1] - nats[i])});
    }
  }
  nodes.resize(count);
  nodes_ = stream.uploaded(nodes, "the likelihood table", VK_FORMAT_R32G32_SFLOAT);
}

}  // namespace palpate
