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
  // Calls visit(list, place relative to the tile, reading) for every list of every reading: tile i
  // has list 2 i for its near and list 2 i + 1 for its far readings.
  const auto for_each_entry = [&](const auto& visit) {
    for (const ElementReading& r : readings) {
      const glm::dvec2& p = r.position_mm;
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
            const auto tile = static_cast<std::size_t>(row * columns + column);
            visit(2 * tile + (distance <= near_mm ? 0 : 1), local, r.reading);
          }
        }
      }
    }
  };

  // Counting sort: the sizes of all lists, then their places, then their contents.
  std::vector<std::uint32_t> next(2 * static_cast<std::size_t>(columns * rows) + 1, 0);
  for_each_entry([&](std::size_t list, const glm::dvec2&, Reading) { ++next[list + 1]; });
  TileLists lists;
  for (std::size_t list = 0; list + 1 < next.size(); list += 2) {
    const std::uint32_t near = next[list + 1];
    const std::uint32_t count = near + next[list + 2];
    if (count > 0) {
      const auto tile = static_cast<std::int64_t>(list / 2);
      lists.tiles.push_back(
          {.column = static_cast<shaders::uint>(tile % columns * shaders::TILE_CELLS),
           .row = static_cast<shaders::uint>(tile / columns * shaders::TILE_CELLS),
           .first = next[list],
           .near = near,
           .count = count});
    }
    next[list + 1] += next[list];
    next[list + 2] += next[list + 1];
  }
  lists.readings.resize(next.back());
  for_each_entry([&](std::size_t list, const glm::dvec2& local, Reading reading) {
    lists.readings[next[list]++] = tile_reading(local, reading, sensor.prior);
  });
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

/// Sums the log-odds increments of readings per cell on the device (Eq. 4-6), in two floats, so
/// that each sum is exact to float32 for any number of readings. The grid grows with the readings.
class EvidenceGrid {
 public:
  EvidenceGrid(gpu::Context& context, double cell_mm, const InverseSensorModel& sensor)
      : context_(context),
        stream_(context),
        cell_mm_(cell_mm),
        sensor_(sensor),
        kernel_(evidence_kernel(context, sensor)) {}

  /// Throws Error where the device cannot hold these cells.
  void require_room(const CellRange& range) const;
  /// Adds each reading to the cells within `radius_mm` of it and to some beyond, in passes of
  /// bounded device memory.
  void add(std::span<const ElementReading> readings, double radius_mm);
  /// Returns the sums over the cells of a range, in row-major order; 0 where nothing was added.
  std::vector<double> sums(const CellRange& range);
  /// Removes all evidence and all cells.
  void clear() {
    cells_ = {};
    needed_ = {};
    range_ = {};
  }

 private:
  bool has_room(const CellRange& range) const;
  void grow(const CellRange& needed);

  gpu::Context& context_;
  gpu::CommandStream stream_;
  double cell_mm_;
  InverseSensorModel sensor_;
  gpu::Kernel kernel_;
  CellRange needed_;   ///< cells that the readings so far need
  CellRange range_;    ///< needed_ and room to grow
  gpu::Buffer cells_;  ///< of range_, [ny, nx], two floats
};

bool EvidenceGrid::has_room(const CellRange& range) const {
  const gpu::Limits& limits = context_.limits();
  return bytes_of(range) <= std::min({limits.storage_range, limits.allocation, limits.memory});
}

void EvidenceGrid::require_room(const CellRange& range) const {
  if (!has_room(range)) {
    throw Error(
        Fault::input,
        fmt::format("the map would have {} x {} cells of {} mm, more than device '{}' binds "
                    "at once; use larger cells, or touches that lie closer together",
                    range.nx, range.ny, cell_mm_, context_.name()));
  }
}

void EvidenceGrid::grow(const CellRange& needed) {
  needed_ = united(needed_, needed);
  if (range_.contains(needed_)) {
    return;
  }
  CellRange larger = needed_;
  if (range_.nx > 0) {
    // Spare cells around, for what a moving sensor touches next, keep growing rare.
    const CellRange roomy{larger.x - larger.nx / 4, larger.y - larger.ny / 4,
                          larger.nx + larger.nx / 2, larger.ny + larger.ny / 2};
    if (has_room(roomy)) {
      larger = roomy;
    }
  }
  require_room(larger);
  gpu::Buffer cells(context_, bytes_of(larger), gpu::Memory::device, "map cells");
  std::vector<TwoFloat> old(static_cast<std::size_t>(range_.nx * range_.ny));
  if (!old.empty()) {
    stream_.download(cells_, old);
    stream_.run();
  }
  stream_.fill(cells, 0);
  // Spare cells outside the new range hold only increments beyond the radius and are dropped.
  const CellRange kept = common(range_, larger);
  for (std::int64_t y = kept.y; y < kept.y + kept.ny; ++y) {
    stream_.upload(
        cells, std::span(old).subspan(range_.index(kept.x, y), static_cast<std::size_t>(kept.nx)),
        larger.index(kept.x, y) * sizeof(TwoFloat));
  }
  stream_.run();
  cells_ = std::move(cells);
  range_ = larger;
}

void EvidenceGrid::add(std::span<const ElementReading> readings, double radius_mm) {
  const double tiles_across = 2.0 + 2.0 * radius_mm / (cell_mm_ * shaders::TILE_CELLS);
  const double most_entries = std::min(static_cast<double>(entries_per_pass),
                                       static_cast<double>(context_.limits().table_texels));
  // All readings of a pass may lie on one tile.
  const auto pass =
      static_cast<std::size_t>(std::clamp(most_entries / (tiles_across * tiles_across), 1.0,
                                          static_cast<double>(gpu::most_iterations)));
  for (; !readings.empty(); readings = readings.subspan(std::min(pass, readings.size()))) {
    const auto part = readings.first(std::min(pass, readings.size()));
    BoundingBox box;
    for (const ElementReading& r : part) {
      box.take_in(r.position_mm);
    }
    grow(cover(box.lower, box.upper, radius_mm, cell_mm_));

    const TileLists lists = assign_to_tiles(part, range_, cell_mm_, radius_mm, sensor_);
    if (lists.tiles.empty()) {
      continue;  // every reading falls between the centres of cells larger than its support
    }
    const gpu::Buffer tiles = stream_.uploaded(lists.tiles, "map tiles");
    const gpu::Buffer list =
        stream_.uploaded(lists.readings, "readings per map tile", VK_FORMAT_R32G32B32A32_SFLOAT);
    const std::size_t limit = context_.limits().group_count[0];
    for (std::size_t tile = 0; tile < lists.tiles.size(); tile += limit) {
      const shaders::EvidencePush push{.tile_first = static_cast<shaders::uint>(tile),
                                       .width = static_cast<shaders::uint>(range_.nx),
                                       .height = static_cast<shaders::uint>(range_.ny),
                                       .cell_mm = static_cast<float>(cell_mm_)};
      const auto groups = static_cast<std::uint32_t>(std::min(limit, lists.tiles.size() - tile));
      stream_.dispatch(kernel_, {&tiles, &list, &cells_}, push, {groups, 1, 1});
    }
    stream_.run();
  }
}

std::vector<double> EvidenceGrid::sums(const CellRange& range) {
  std::vector<TwoFloat> cells(static_cast<std::size_t>(range_.nx * range_.ny));
  if (!cells.empty()) {
    stream_.download(cells_, cells);
    stream_.run();
  }
  std::vector<double> sums(static_cast<std::size_t>(range.nx * range.ny), 0.0);
  const CellRange summed = common(range, range_);
  for (std::int64_t y = summed.y; y < summed.y + summed.ny; ++y) {
    for (std::int64_t x = summed.x; x < summed.x + summed.nx; ++x) {
      sums[range.index(x, y)] = cells[range_.index(x, y)].value();
    }
  }
  return sums;
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

struct MapBuilder::Impl {
  Impl(Device& device, const MapOptions& wanted)
      : options(wanted), grid(device.context(), wanted.cell_mm, wanted.sensor) {}

  double radius_mm(const Seen& all) const {
    return support_radius_mm(options.sensor, all.readings);
  }

  /// Returns the cells of a map of all these readings. Throws Error where they are too many.
  CellRange range_of(const Seen& all) const {
    const CellRange range = cover(all.box.lower, all.box.upper, radius_mm(all), options.cell_mm);
    grid.require_room(range);
    return range;
  }

  void flush() {
    grid.add(pending, radius_mm(seen));
    pending.clear();
  }

  MapOptions options;
  EvidenceGrid grid;
  std::vector<ElementReading> pending;  ///< robot frame = object frame
  Seen seen;                            ///< all readings so far, pending ones too
  ChangeInSteps change{"map: adding touches failed half-way; clear() the builder"};
  OwnProcess process;
};

MapBuilder::MapBuilder(Device& device, const MapOptions& options) {
  options.validate();
  impl_.reset(new Impl(device, options));
}

void MapBuilder::Deleter::operator()(Impl* impl) const { delete_here(impl); }

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
  for (const double sum : all.grid.sums(range)) {
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
  map.grid.clear();
  map.change.forget();
}

}  // namespace palpate
