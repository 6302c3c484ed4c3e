#include "estimation/particles/parzen_mode.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include <glm/vec4.hpp>

#include "palpate/pose.hpp"
#include "shaders/sum_cones.hpp"

namespace palpate {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr double step_mm = 0.5;
constexpr double step_rad = 0.04 * std::numbers::pi;
constexpr int sectors = 50 / shaders::PARZEN_THETAS;  // tiles around the circle
constexpr int edge = shaders::PARZEN_EDGE;
constexpr int points = edge * edge * shaders::PARZEN_THETAS;
// A grid point's cone reaches this many cells down, and one less up, in x and y.
constexpr int reach_cells = 2;
// Particles that one unit takes at most, so that no loop is long.
constexpr std::uint32_t unit_particles = 8192;
static_assert(unit_particles < gpu::most_iterations / 2);
constexpr std::size_t units_per_run = 1 << 14;
constexpr std::size_t first_tiles = 16;

/// A cell of the grid, or a tile of cells; they are sorted in this order.
struct Key {
  std::uint32_t object = 0;
  int sector = 0;  ///< of theta
  int y = 0;
  int x = 0;

  bool operator==(const Key&) const = default;
  bool operator<(const Key& other) const {
    return std::tie(object, sector, y, x) < std::tie(other.object, other.sector, other.y, other.x);
  }
};

int cell_of(float mm) {
  constexpr double far = 1 << 28;
  return static_cast<int>(std::floor(std::clamp(mm / step_mm, -far, far)));
}

int tile_of(int cell) { return static_cast<int>(std::floor(static_cast<double>(cell) / edge)); }

int sector_of(float theta_rad) {
  const int sector = static_cast<int>(std::floor(theta_rad / (two_pi / sectors)));
  return (sector % sectors + sectors) % sectors;
}

using Range = std::array<std::uint32_t, 2>;

/// The particles that count, in the order of their cells.
struct SortedParticles {
  std::vector<Key> cell;
  std::vector<glm::vec4> particle;  ///< x_mm, y_mm, theta_rad, weight over the largest
  std::vector<double> mass_before;  ///< sum of the weights of all before, and of all
  double largest = 0.0;             ///< weight

  double mass(const Range& range) const { return mass_before[range[1]] - mass_before[range[0]]; }
};

SortedParticles sort(std::span<const shaders::Particle> particles,
                     std::span<const double> weights) {
  SortedParticles sorted;
  sorted.largest = *std::max_element(weights.begin(), weights.end());
  // All that are left out together change the maximum, at least half the largest weight, by 1e-9.
  const double least = sorted.largest * 1e-10 / static_cast<double>(particles.size());
  std::vector<std::pair<Key, std::uint32_t>> order;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const auto& [object, x_mm, y_mm, theta_rad] = particles[i];
    if (weights[i] > least) {
      order.push_back({{object, sector_of(theta_rad), cell_of(y_mm), cell_of(x_mm)},
                       static_cast<std::uint32_t>(i)});
    }
  }
  std::ranges::stable_sort(order, std::less(), [](const auto& of) { return of.first; });
  double mass = 0.0;
  for (const auto& [cell, i] : order) {
    const double weight = weights[i] / sorted.largest;
    sorted.cell.push_back(cell);
    sorted.particle.emplace_back(particles[i].x_mm, particles[i].y_mm, particles[i].theta_rad,
                                 static_cast<float>(weight));
    sorted.mass_before.push_back(mass);
    mass += weight;
  }
  sorted.mass_before.push_back(mass);
  return sorted;
}

/// A tile of grid points, edge x edge in x and y and a sector of theta.
struct Tile {
  Key key;
  std::vector<Range> ranges;  ///< of the particles that may reach it
  double mass = 0.0;          ///< of those, which bounds the density
};

/// All tiles that a particle reaches and some of their neighbours.
std::vector<Key> reached_tiles(const SortedParticles& sorted) {
  std::vector<Key> occupied;
  for (const Key& cell : sorted.cell) {
    const Key tile{cell.object, cell.sector, tile_of(cell.y), tile_of(cell.x)};
    if (occupied.empty() || occupied.back() != tile) {
      occupied.push_back(tile);
    }
  }
  const auto make_unique = [](std::vector<Key>& keys) {
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  };
  make_unique(occupied);
  std::vector<Key> reached;
  for (const Key& tile : occupied) {
    for (const int turn : {sectors - 1, 0, 1}) {
      for (const int dy : {-1, 0, 1}) {
        for (const int dx : {-1, 0, 1}) {
          reached.push_back(
              {tile.object, (tile.sector + turn) % sectors, tile.y + dy, tile.x + dx});
        }
      }
    }
  }
  make_unique(reached);
  return reached;
}

Tile gather(const SortedParticles& sorted, const Key& key) {
  const auto first_of = [&sorted](const Key& cell) {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(sorted.cell, cell, std::less()) -
                                      sorted.cell.begin());
  };
  Tile tile{.key = key, .ranges = {}};
  for (const int turn : {sectors - 1, 0, 1}) {
    const int sector = (key.sector + turn) % sectors;
    for (int y = key.y * edge - reach_cells; y < key.y * edge + edge - 1 + reach_cells; ++y) {
      const int x = key.x * edge;
      const Range range{first_of({key.object, sector, y, x - reach_cells}),
                        first_of({key.object, sector, y, x + edge - 1 + reach_cells})};
      if (range[0] < range[1]) {
        tile.ranges.push_back(range);
        tile.mass += sorted.mass(range);
      }
    }
  }
  return tile;
}

/// The tiles that a particle reaches, the heaviest first.
std::vector<Tile> tiles_of(const SortedParticles& sorted) {
  std::vector<Tile> tiles;
  for (const Key& key : reached_tiles(sorted)) {
    if (Tile tile = gather(sorted, key); !tile.ranges.empty()) {
      tiles.push_back(std::move(tile));
    }
  }
  std::ranges::stable_sort(tiles, std::ranges::greater(), &Tile::mass);
  return tiles;
}

/// What the device sums at once.
struct Batch {
  std::vector<shaders::ConeUnit> units;
  std::vector<Range> ranges;
  std::vector<std::size_t> unit_end;  ///< of every tile

  /// Cuts the tile's ranges into units.
  void add(const Tile& tile) {
    const Key& key = tile.key;
    std::uint32_t room = 0;
    for (const Range& range : tile.ranges) {
      for (std::uint32_t begin = range[0]; begin < range[1];) {
        if (room == 0) {
          const auto first = static_cast<shaders::uint>(ranges.size());
          units.push_back({.x = key.x * edge,
                           .y = key.y * edge,
                           .theta = key.sector * shaders::PARZEN_THETAS,
                           .range_first = first,
                           .range_end = first});
          room = unit_particles;
        }
        const std::uint32_t end = std::min(range[1], begin + room);
        ranges.push_back({begin, end});
        ++units.back().range_end;
        room -= end - begin;
        begin = end;
      }
    }
    unit_end.push_back(units.size());
  }
};

/// The grid point of the largest density so far.
struct Largest {
  double density = 0.0;
  std::size_t tile = 0;
  int point = 0;

  /// @param first tile of the batch
  void take_in(const Batch& batch, std::span<const float> densities, std::size_t first) {
    std::size_t unit = 0;
    for (std::size_t i = 0; i < batch.unit_end.size(); ++i) {
      std::array<double, points> sums{};
      for (; unit < batch.unit_end[i]; ++unit) {
        for (int k = 0; k < points; ++k) {
          sums[k] += densities[unit * points + k];
        }
      }
      if (const auto highest = std::ranges::max_element(sums); *highest > density) {
        *this = {*highest, first + i, static_cast<int>(highest - sums.begin())};
      }
    }
  }
};

/// Eq. 11 in float64 at one point of a tile's grid.
double density_at(const SortedParticles& sorted, const Tile& tile, const ParzenMaximum& at) {
  double sum = 0.0;
  for (const Range& range : tile.ranges) {
    for (std::uint32_t i = range[0]; i < range[1]; ++i) {
      const glm::vec4& particle = sorted.particle[i];
      const double dx = particle.x - at.x_mm;
      const double dy = particle.y - at.y_mm;
      const double dtheta = wrap_angle(particle.z - at.theta_rad, two_pi);
      sum += particle.w * std::max(0.0, 1.0 - std::sqrt(dx * dx + dy * dy + dtheta * dtheta));
    }
  }
  return sum * sorted.largest;
}

}  // namespace

ParzenMode::ParzenMode(gpu::Context& context, gpu::CommandStream& stream,
                       std::size_t most_particles)
    : context_(context),
      stream_(stream),
      texel_(gpu::table_where_it_fits(context.limits(), most_particles * sizeof(glm::vec4),
                                      VK_FORMAT_R32G32B32A32_SFLOAT)),
      sum_cones_(context,
                 {.name = "sum_cones",
                  .spirv = shaders::sum_cones,
                  .bindings = {gpu::Access::table, gpu::Access::storage, gpu::Access::storage,
                               gpu::Access::storage, gpu::Access::storage},
                  .push_bytes = sizeof(shaders::ConePush),
                  .constants = {texel_ != VK_FORMAT_UNDEFINED ? 1U : 0U}}) {
  // The driver compiles the kernel at its first run, and no estimate has to wait for that.
  const shaders::Particle particle{};
  const double weight = 1.0;
  find({&particle, 1}, {&weight, 1});
}

ParzenMaximum ParzenMode::find(std::span<const shaders::Particle> particles,
                               std::span<const double> weights) {
  const SortedParticles sorted = sort(particles, weights);
  const std::vector<Tile> tiles = tiles_of(sorted);
  const gpu::Buffer sources = stream_.uploaded(sorted.particle, "particles", texel_);
  Largest best;
  for (std::size_t t = 0; t < tiles.size() && tiles[t].mass > best.density;) {
    const std::size_t first = t;
    const std::size_t end = first == 0 ? std::min(first_tiles, tiles.size()) : tiles.size();
    Batch batch;
    for (; t < end && tiles[t].mass > best.density && batch.units.size() < units_per_run; ++t) {
      batch.add(tiles[t]);
    }
    std::vector<float> densities(batch.units.size() * points);
    const gpu::Buffer sums(context_, std::span(densities).size_bytes(), gpu::Memory::device,
                           "the Parzen estimate");
    const gpu::Buffer ranges = stream_.uploaded(batch.ranges, "ranges of particles");
    const gpu::Buffer units = stream_.uploaded(batch.units, "tiles of the Parzen estimate");
    peak_bytes_ = std::max<std::uint64_t>(
        peak_bytes_, sources.bytes() + ranges.bytes() + units.bytes() + sums.bytes());
    stream_.dispatch(sum_cones_,
                     {sources.read_as(gpu::Access::table), sources.read_as(gpu::Access::storage),
                      &ranges, &units, &sums},
                     shaders::ConePush{static_cast<float>(step_mm), static_cast<float>(step_rad)},
                     {static_cast<std::uint32_t>(batch.units.size()), 1, 1});
    stream_.download(sums, densities);
    stream_.run();
    best.take_in(batch, densities, first);
  }

  const Tile& tile = tiles[best.tile];
  const Key& key = tile.key;
  const int turn = key.sector * shaders::PARZEN_THETAS + best.point / (edge * edge);
  ParzenMaximum maximum{.object = key.object,
                        .x_mm = step_mm * (key.x * edge + best.point % edge),
                        .y_mm = step_mm * (key.y * edge + best.point / edge % edge),
                        .theta_rad = wrap_angle(step_rad * turn, two_pi)};
  maximum.density = density_at(sorted, tile, maximum);
  return maximum;
}

}  // namespace palpate
