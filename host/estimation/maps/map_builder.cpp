#include "palpate/map_builder.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "estimation/change_in_steps.hpp"
#include "estimation/kernel_sizes.hpp"
#include "gpu/command_stream.hpp"
#include "model/bounding_box.hpp"
#include "model/cell_range.hpp"
#include "model/own_process.hpp"
#include "palpate/error.hpp"
#include "shaders/accumulate_evidence.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

// Entries of a pass: its readings times the tiles that each reading reaches.
constexpr std::size_t entries_per_pass = 1 << 20;

/// Tiles that at least one reading reaches, each with its readings.
struct TileLists {
  std::vector<shaders::Tile> tiles;
  std::vector<shaders::TileReading> readings;
};

shaders::TileReading tile_reading(const glm::dvec2& local_mm, Reading reading, double prior) {
  // Eq. 5 in log odds: log((1 + g a) / (1 - g)) for contact, a = (1 - m) / m, and log((1 - g) / (1
  // + g b)) for no contact, b = m / (1 - m). Both equal 2 atanh(t), t = g gain / (2 + g skew), a
  // form that loses no digits where g is small.
  const bool contact = is_contact(reading);
  const double gain = contact ? 1.0 / prior : -1.0 / (1.0 - prior);
  const double skew = contact ? (1.0 - prior) / prior - 1.0 : prior / (1.0 - prior) - 1.0;
  return {static_cast<float>(local_mm.x), static_cast<float>(local_mm.y), static_cast<float>(gain),
          static_cast<float>(skew)};
}

/// Returns the distance at which the increment falls to what the kernel's series represents.
double near_radius_mm(const InverseSensorModel& sensor) {
  const double reach = shaders::SERIES_REACH;
  const double p = sensor.prior;
  // g where |t| = reach, of the class that reaches further.
  const double contact = 2.0 * reach / (1.0 / p - reach * ((1.0 - p) / p - 1.0));
  const double none = 2.0 * reach / (1.0 / (1.0 - p) + reach * (p / (1.0 - p) - 1.0));
  const double g = std::min(contact, none);
  return g < sensor.peak ? sensor.spread_mm * std::sqrt(2.0 * std::log(sensor.peak / g)) : 0.0;
}

/// Sorts readings into the lists of the tiles that they reach, those near a tile's cells first.
TileLists assign_to_tiles(std::span<const ElementReading> readings, const CellRange& range,
                          double cell_mm, double radius_mm, const InverseSensorModel& sensor) {
  const double near_mm = near_radius_mm(sensor);
  const std::int64_t columns = (range.nx + shaders::TILE_CELLS - 1) / shaders::TILE_CELLS;
  const std::int64_t rows = (range.ny + shaders::TILE_CELLS - 1) / shaders::TILE_CELLS;
  const double tile_mm = (shaders::TILE_CELLS - 1) * cell_mm;
  const auto tile_of = [&](double mm, std::int64_t origin, std::int64_t cells) {
    const double cell =
        std::clamp(mm / cell_mm - static_cast<double>(origin), 0.0, static_cast<double>(cells - 1));
    return static_cast<std::int64_t>(cell) / shaders::TILE_CELLS;
  };
  struct OfTile {
    std::vector<shaders::TileReading> near;
    std::vector<shaders::TileReading> far;
  };
  std::vector<OfTile> of_tiles(static_cast<std::size_t>(columns * rows));
  for (const auto& [p, reading] : readings) {
    const std::int64_t last_row = tile_of(p.y + radius_mm, range.y, range.ny);
    const std::int64_t last_column = tile_of(p.x + radius_mm, range.x, range.nx);
    for (auto row = tile_of(p.y - radius_mm, range.y, range.ny); row <= last_row; ++row) {
      for (auto column = tile_of(p.x - radius_mm, range.x, range.nx); column <= last_column;
           ++column) {
        const glm::dvec2 corner =
            cell_mm * glm::dvec2(static_cast<double>(range.x + column * shaders::TILE_CELLS),
                                 static_cast<double>(range.y + row * shaders::TILE_CELLS));
        const glm::dvec2 local = p - corner;
        const double outside_x = std::max({0.0, -local.x, local.x - tile_mm});
        const double outside_y = std::max({0.0, -local.y, local.y - tile_mm});
        const double distance = std::hypot(outside_x, outside_y);
        if (distance <= radius_mm) {
          OfTile& tile = of_tiles[static_cast<std::size_t>(row * columns + column)];
          (distance <= near_mm ? tile.near : tile.far)
              .push_back(tile_reading(local, reading, sensor.prior));
        }
      }
    }
  }
  TileLists lists;
  for (std::size_t i = 0; i < of_tiles.size(); ++i) {
    const auto& [near, far] = of_tiles[i];
    if (near.empty() && far.empty()) {
      continue;
    }
    const auto tile = static_cast<std::int64_t>(i);
    lists.tiles.push_back(
        {.column = static_cast<shaders::uint>(tile % columns * shaders::TILE_CELLS),
         .row = static_cast<shaders::uint>(tile / columns * shaders::TILE_CELLS),
         .first = static_cast<shaders::uint>(lists.readings.size()),
         .near = static_cast<shaders::uint>(near.size()),
         .count = static_cast<shaders::uint>(near.size() + far.size())});
    lists.readings.insert(lists.readings.end(), near.begin(), near.end());
    lists.readings.insert(lists.readings.end(), far.begin(), far.end());
  }
  return lists;
}

VkDeviceSize bytes_of(const CellRange& range) {
  return static_cast<VkDeviceSize>(range.nx * range.ny) * sizeof(TwoFloat);
}

gpu::Kernel evidence_kernel(gpu::Context& context, const InverseSensorModel& sensor) {
  const std::uint32_t block = block_cells(context.limits());
  const std::uint32_t blocks_across = shaders::TILE_CELLS / block;
  const auto bits = [](double value) {
    return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  };
  return {context,
          {.name = "accumulate_evidence",
           .spirv = shaders::accumulate_evidence,
           .bindings = {gpu::Access::storage, gpu::Access::table, gpu::Access::storage},
           .push_bytes = sizeof(shaders::EvidencePush),
           .constants = {blocks_across, blocks_across, block, bits(sensor.peak),
                         bits(1.0 / (2.0 * sensor.spread_mm * sensor.spread_mm))}}};
}

// Most readings that wait on the host: bounds the memory that a long recording takes.
constexpr std::size_t pending_readings = 1 << 18;

/// Number and bounds of readings.
struct Seen {
  std::size_t readings = 0;
  BoundingBox box;

  void add(const glm::dvec2& place_mm) {
    ++readings;
    box.take_in(place_mm);
  }
};

}  // namespace

/// Sums the log-odds increments of readings per cell on the device (Eq. 4-6), in two floats, so
/// that each sum is exact to float32 for any number of readings. The grid grows with the readings.
struct MapBuilder::Impl {
  Impl(Device& device, const MapOptions& wanted)
      : options(wanted),
        context(device.context()),
        stream(context),
        kernel(evidence_kernel(context, wanted.sensor)) {}

  double radius_mm(const Seen& all) const {
    return support_radius_mm(options.sensor, all.readings);
  }
  /// Throws Error where the device cannot hold these cells.
  void require_room(const CellRange& needed) const {
    const gpu::Limits& limits = context.limits();
    if (bytes_of(needed) > std::min({limits.storage_range, limits.allocation, limits.memory})) {
      throw Error(
          Fault::input,
          fmt::format("the map would have {} x {} cells of {} mm, more than device '{}' binds "
                      "at once; use larger cells, or touches that lie closer together",
                      needed.nx, needed.ny, options.cell_mm, context.name()));
    }
  }
  /// Returns the cells of a map of all these readings. Throws Error where they are too many.
  CellRange range_of(const Seen& all) const {
    const CellRange needed = cover(all.box.lower, all.box.upper, radius_mm(all), options.cell_mm);
    require_room(needed);
    return needed;
  }
  void grow(const CellRange& needed) {
    if (range.contains(needed)) {
      return;
    }
    const CellRange larger = united(range, needed);
    require_room(larger);
    gpu::Buffer grown(context, bytes_of(larger), gpu::Memory::device, "map cells");
    std::vector<TwoFloat> old(static_cast<std::size_t>(range.nx * range.ny));
    if (!old.empty()) {
      stream.download(cells, old);
      stream.run();
    }
    stream.fill(grown, 0);
    const auto width = static_cast<std::size_t>(range.nx);
    for (std::int64_t y = range.y; y < range.y + range.ny; ++y) {
      stream.upload(grown, std::span(old).subspan(range.index(range.x, y), width),
                    larger.index(range.x, y) * sizeof(TwoFloat));
    }
    stream.run();
    cells = std::move(grown);
    range = larger;
  }
  /// Adds each pending reading to the cells within radius_mm() of it and to some beyond, in passes
  /// of bounded device memory.
  void flush() {
    // Once for all passes: to grow copies all cells, and a sensor that moves would grow with each.
    grow(range_of(seen));
    const double radius = radius_mm(seen);
    const double cell_mm = options.cell_mm;
    const double tiles_across = 2.0 + 2.0 * radius / (cell_mm * shaders::TILE_CELLS);
    const double most_entries = std::min(static_cast<double>(entries_per_pass),
                                         static_cast<double>(context.limits().table_texels));
    // All readings of a pass may lie on one tile.
    const auto pass =
        static_cast<std::size_t>(std::clamp(most_entries / (tiles_across * tiles_across), 1.0,
                                            static_cast<double>(gpu::most_iterations)));
    for (std::span<const ElementReading> readings = pending; !readings.empty();
         readings = readings.subspan(std::min(pass, readings.size()))) {
      const auto part = readings.first(std::min(pass, readings.size()));
      const TileLists lists = assign_to_tiles(part, range, cell_mm, radius, options.sensor);
      if (lists.tiles.empty()) {
        continue;  // every reading falls between the centres of cells larger than its support
      }
      const gpu::Buffer tiles = stream.uploaded(lists.tiles, "map tiles");
      const gpu::Buffer list =
          stream.uploaded(lists.readings, "readings per map tile", VK_FORMAT_R32G32B32A32_SFLOAT);
      const std::size_t limit = context.limits().group_count[0];
      for (std::size_t tile = 0; tile < lists.tiles.size(); tile += limit) {
        const shaders::EvidencePush push{.tile_first = static_cast<shaders::uint>(tile),
                                         .width = static_cast<shaders::uint>(range.nx),
                                         .height = static_cast<shaders::uint>(range.ny),
                                         .cell_mm = static_cast<float>(cell_mm)};
        const auto groups = static_cast<std::uint32_t>(std::min(limit, lists.tiles.size() - tile));
        stream.dispatch(kernel, {&tiles, &list, &cells}, push, {groups, 1, 1});
      }
      stream.run();
    }
    pending.clear();
  }
  /// Returns the sums over these cells, in row-major order; 0 where nothing was added.
  std::vector<double> sums(const CellRange& of) {
    std::vector<TwoFloat> read(static_cast<std::size_t>(range.nx * range.ny));
    if (!read.empty()) {
      stream.download(cells, read);
      stream.run();
    }
    std::vector<double> sums(static_cast<std::size_t>(of.nx * of.ny), 0.0);
    const CellRange summed = common(of, range);
    for (std::int64_t y = summed.y; y < summed.y + summed.ny; ++y) {
      for (std::int64_t x = summed.x; x < summed.x + summed.nx; ++x) {
        sums[of.index(x, y)] = read[range.index(x, y)].value();
      }
    }
    return sums;
  }

  MapOptions options;
  gpu::Context& context;
  gpu::CommandStream stream;
  gpu::Kernel kernel;
  CellRange range;                      ///< that the readings on the device need
  gpu::Buffer cells;                    ///< of `range`, [ny, nx], two floats
  std::vector<ElementReading> pending;  ///< robot frame = object frame
  Seen seen;                            ///< all readings so far, pending ones too
  ChangeInSteps change{"map: adding touches failed half-way; clear() the builder"};
  OwnProcess process;
};

MapBuilder::MapBuilder(Device& device, const MapOptions& options) {
  options.validate();
  impl_ = {new Impl(device, options), delete_here<Impl>};
}

MapBuilder::Impl& MapBuilder::impl() const { return held_here(impl_, "map builder"); }

void MapBuilder::add(std::span<const Touch> touches) {
  Impl& map = impl();
  map.change.refuse();
  // Every touch is checked before the first is added: one that cannot be mapped refuses all.
  Seen all = map.seen;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const std::vector<ElementReading> known = known_readings(touches[i], map.options.classifier);
    if (const auto fault = fault_of(known)) {
      throw Error(Fault::input, fmt::format("touch {}: {}", i, *fault));
    }
    for (const ElementReading& r : known) {
      all.add(r.position_mm);
    }
  }
  if (all.readings > 0) {
    map.range_of(all);
  }
  map.change.change([&] {
    for (const Touch& touch : touches) {
      for (const ElementReading& r : known_readings(touch, map.options.classifier)) {
        map.seen.add(r.position_mm);
        map.pending.push_back(r);
      }
      if (map.pending.size() >= pending_readings) {
        map.flush();
      }
    }
  });
}

OccupancyGrid MapBuilder::build(const std::string& label) {
  Impl& all = impl();
  all.change.refuse();
  if (all.seen.readings == 0) {
    throw Error(Fault::input,
                fmt::format("object '{}': no element of any touch is In Contact or No "
                            "Contact; check the threshold and the pressure's unit",
                            label));
  }
  all.change.change([&] { all.flush(); });
  const MapOptions& options = all.options;
  const CellRange range = all.range_of(all.seen);
  OccupancyGrid map = map_frame(options, label, range);
  const double prior = map.prior_log_odds();
  for (const double sum : all.sums(range)) {
    map.log_odds.push_back(static_cast<float>(prior + sum));
  }
  if (const auto fault = fault_of(map)) {
    throw Error(Fault::input, fmt::format("map '{}': {}", label, *fault));
  }
  return map;
}

void MapBuilder::clear() {
  Impl& map = impl();
  map.pending.clear();
  map.seen = {};
  map.range = {};
  map.cells = {};
  map.change.forget();
}

}  // namespace palpate
