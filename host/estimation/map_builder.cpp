#include "palpate/map_builder.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "accumulate_evidence.hpp"
#include "command_stream.hpp"
#include "interface.h"
#include "palpate/error.hpp"

namespace palpate {

namespace {

// Half of what the documentation allows; the rest is for float32.
constexpr double cut_tolerance = 5e-4;
constexpr std::size_t readings_per_pass = 2 << 20;

/// The grid that covers all readings and their support, without its values.
OccupancyGrid cover(std::span<const ElementReading> readings, double radius_mm, double cell_mm,
                    std::size_t most_cells) {
  glm::dvec2 lowest = readings.front().position_mm;
  glm::dvec2 highest = lowest;
  for (const ElementReading& r : readings) {
    lowest = {std::min(lowest.x, r.position_mm.x), std::min(lowest.y, r.position_mm.y)};
    highest = {std::max(highest.x, r.position_mm.x), std::max(highest.y, r.position_mm.y)};
  }
  // Origins are whole multiples of the cell, so that maps can be compared cell by cell.
  const auto first = [&](double mm) { return std::ceil((mm - radius_mm) / cell_mm); };
  const auto last = [&](double mm) { return std::floor((mm + radius_mm) / cell_mm); };
  const double nx = std::max(1.0, last(highest.x) - first(lowest.x) + 1.0);
  const double ny = std::max(1.0, last(highest.y) - first(lowest.y) + 1.0);
  if (!(nx * ny <= static_cast<double>(most_cells))) {
    throw Error(Fault::input,
                fmt::format("the map would have {:.0f} x {:.0f} cells of {} mm, the device binds "
                            "{}; use larger cells, or touches that lie closer together",
                            nx, ny, cell_mm, most_cells));
  }
  OccupancyGrid map;
  map.cell_mm = cell_mm;
  map.origin_mm = cell_mm * glm::dvec2(first(lowest.x), first(lowest.y));
  map.nx = static_cast<int>(nx);
  map.ny = static_cast<int>(ny);
  return map;
}

/// The map's tiles that some reading supports, each with its readings.
struct TileLists {
  std::vector<shaders::Tile> tiles;
  std::vector<shaders::TileReading> readings;
};

/// Tile indices along one axis, [first, last], that a reading at this coordinate reaches.
struct TileRange {
  int first;
  int last;
};

TileRange reached_tiles(double mm, double origin_mm, double radius_mm, double cell_mm, int cells) {
  const auto tile_of = [&](double at_mm) {
    const double cell = std::clamp((at_mm - origin_mm) / cell_mm, 0.0, cells - 1.0);
    return static_cast<int>(cell) / shaders::TILE_CELLS;
  };
  return {tile_of(mm - radius_mm), tile_of(mm + radius_mm)};
}

TileLists assign_to_tiles(std::span<const ElementReading> readings, const OccupancyGrid& map,
                          double radius_mm) {
  const int columns = (map.nx + shaders::TILE_CELLS - 1) / shaders::TILE_CELLS;
  const int rows = (map.ny + shaders::TILE_CELLS - 1) / shaders::TILE_CELLS;
  const auto for_each_reached = [&](const ElementReading& r, const auto& visit) {
    const TileRange x =
        reached_tiles(r.position_mm.x, map.origin_mm.x, radius_mm, map.cell_mm, map.nx);
    const TileRange y =
        reached_tiles(r.position_mm.y, map.origin_mm.y, radius_mm, map.cell_mm, map.ny);
    for (int row = y.first; row <= y.last; ++row) {
      for (int column = x.first; column <= x.last; ++column) {
        visit(row, column);
      }
    }
  };

  // Counting sort: the sizes of all lists, then their places, then their contents.
  std::vector<std::size_t> next(static_cast<std::size_t>(columns) * rows + 1, 0);
  for (const ElementReading& r : readings) {
    for_each_reached(r, [&](int row, int column) {
      ++next[static_cast<std::size_t>(row) * columns + column + 1];
    });
  }
  TileLists lists;
  for (std::size_t i = 1; i < next.size(); ++i) {
    if (next[i] > 0) {
      const std::size_t tile = i - 1;
      lists.tiles.push_back(
          {.column = static_cast<shaders::uint>(tile % columns) * shaders::TILE_CELLS,
           .row = static_cast<shaders::uint>(tile / columns) * shaders::TILE_CELLS,
           .first = static_cast<shaders::uint>(next[i - 1]),
           .count = static_cast<shaders::uint>(next[i])});
    }
    next[i] += next[i - 1];
  }
  lists.readings.resize(next.back());
  for (const ElementReading& r : readings) {
    for_each_reached(r, [&](int row, int column) {
      const glm::dvec2 corner =
          map.centre_mm(column * shaders::TILE_CELLS, row * shaders::TILE_CELLS);
      const glm::dvec2 local = r.position_mm - corner;
      lists.readings[next[static_cast<std::size_t>(row) * columns + column]++] = {
          static_cast<float>(local.x), static_cast<float>(local.y),
          static_cast<shaders::uint>(r.reading)};
    });
  }
  return lists;
}

gpu::Kernel evidence_kernel(gpu::Context& context, const InverseSensorModel& sensor) {
  const std::uint32_t constants[] = {std::bit_cast<std::uint32_t>(static_cast<float>(sensor.peak)),
                                     std::bit_cast<std::uint32_t>(static_cast<float>(sensor.prior)),
                                     std::bit_cast<std::uint32_t>(static_cast<float>(
                                         1.0 / (2.0 * sensor.spread_mm * sensor.spread_mm)))};
  return {context,
          {.name = "accumulate_evidence",
           .spirv = shaders::accumulate_evidence,
           .buffers = 3,
           .push_bytes = sizeof(shaders::EvidencePush),
           .constants = constants}};
}

}  // namespace

struct MapBuilder::Impl {
  Impl(Device& device, const MapOptions& wanted)
      : context(device.context()),
        options(wanted),
        kernel(evidence_kernel(context, options.sensor)) {}

  gpu::Context& context;
  MapOptions options;
  gpu::Kernel kernel;
  std::vector<ElementReading> readings;  ///< robot frame = object frame
};

MapBuilder::MapBuilder(Device& device, const MapOptions& options) {
  if (!(options.cell_mm > 0.0) || !std::isfinite(options.cell_mm)) {
    throw Error(Fault::input,
                fmt::format("cell size = {} mm: give a positive length", options.cell_mm));
  }
  options.sensor.validate();
  impl_ = std::make_unique<Impl>(device, options);
}

MapBuilder::~MapBuilder() = default;
MapBuilder::MapBuilder(MapBuilder&&) noexcept = default;
MapBuilder& MapBuilder::operator=(MapBuilder&&) noexcept = default;

void MapBuilder::add(std::span<const Touch> touches) {
  for (const Touch& touch : touches) {
    const std::vector<ElementReading> known = known_readings(touch, impl_->options.classifier);
    impl_->readings.insert(impl_->readings.end(), known.begin(), known.end());
  }
}

OccupancyGrid MapBuilder::build(const std::string& label) const {
  const std::span<const ElementReading> readings = impl_->readings;
  if (readings.empty()) {
    throw Error(Fault::input,
                fmt::format("object '{}': no element of any touch is In Contact or No "
                            "Contact; check the threshold and the pressure's unit",
                            label));
  }
  const auto& [cell_mm, sensor, classifier] = impl_->options;
  const double radius_mm = sensor.support_radius_mm(readings.size(), cut_tolerance);
  OccupancyGrid map =
      cover(readings, radius_mm, cell_mm, impl_->context.limits().storage_range / sizeof(float));
  map.label = label;
  map.prior = sensor.prior;
  map.log_odds.resize(static_cast<std::size_t>(map.nx) * map.ny);

  gpu::Context& context = impl_->context;
  gpu::CommandStream stream(context);
  const gpu::Buffer cells(context, map.log_odds.size() * sizeof(float), gpu::Memory::device,
                          fmt::format("map '{}'", label));
  stream.fill(cells, std::bit_cast<std::uint32_t>(static_cast<float>(map.prior_log_odds())));

  // Readings go through in passes, so that their tile lists take bounded memory.
  const double tiles_across = 2.0 + 2.0 * radius_mm / (cell_mm * shaders::TILE_CELLS);
  const auto pass = static_cast<std::size_t>(
      std::max(1.0, static_cast<double>(readings_per_pass) / (tiles_across * tiles_across)));
  for (std::size_t first = 0; first < readings.size(); first += pass) {
    const TileLists lists = assign_to_tiles(
        readings.subspan(first, std::min(pass, readings.size() - first)), map, radius_mm);
    const gpu::Buffer tiles(context, std::span(lists.tiles).size_bytes(), gpu::Memory::device,
                            "map tiles");
    const gpu::Buffer list(context, std::span(lists.readings).size_bytes(), gpu::Memory::device,
                           "readings per map tile");
    stream.upload(tiles, std::span(lists.tiles));
    stream.upload(list, std::span(lists.readings));
    const std::size_t most = context.limits().group_count[0];
    for (std::size_t tile = 0; tile < lists.tiles.size(); tile += most) {
      const shaders::EvidencePush push{.tile_first = static_cast<shaders::uint>(tile),
                                       .width = static_cast<shaders::uint>(map.nx),
                                       .height = static_cast<shaders::uint>(map.ny),
                                       .cell_mm = static_cast<float>(cell_mm)};
      const auto groups = static_cast<std::uint32_t>(std::min(most, lists.tiles.size() - tile));
      stream.dispatch(impl_->kernel,
                      std::array{gpu::Binding{&tiles}, gpu::Binding{&list}, gpu::Binding{&cells}},
                      push, {groups, 1, 1});
    }
    stream.run();
  }
  stream.download(cells, std::span(map.log_odds));
  stream.run();
  return map;
}

double estimate_prior(Device& device, std::span<const std::vector<Touch>> touches_per_object,
                      MapOptions options) {
  options.sensor.prior = 0.5;
  // Below the map's own tolerance there is no evidence to speak of.
  constexpr double no_evidence = 2.0 * cut_tolerance;
  std::size_t occupied = 0;
  std::size_t modelled = 0;
  for (const std::vector<Touch>& touches : touches_per_object) {
    MapBuilder builder(device, options);
    builder.add(touches);
    for (const float evidence : builder.build("").log_odds) {
      occupied += evidence > no_evidence ? 1 : 0;
      modelled += std::abs(evidence) > no_evidence ? 1 : 0;
    }
  }
  // Where nothing, or everything, was in contact, half a cell keeps the logs finite.
  return (static_cast<double>(occupied) + 0.5) / (static_cast<double>(modelled) + 1.0);
}

}  // namespace palpate
