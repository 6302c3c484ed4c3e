#include "estimation/lattice/dense_likelihood.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <glm/vec2.hpp>

#include "estimation/kernel_sizes.hpp"
#include "model/log_message.hpp"
#include "palpate/error.hpp"
#include "shaders/accumulate_likelihood.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

using gpu::Access;

constexpr VkDeviceSize most_table_bytes = 16 << 20;
// A batch of whole products, so that it does not matter which elements share one.
constexpr std::size_t factors = shaders::FACTORS_PER_LOG;

/// Memory of an element rotated by every theta.
VkDeviceSize bytes_per_element(const PoseLattice& lattice) {
  return static_cast<VkDeviceSize>(lattice.theta_rad.count) * sizeof(shaders::RotatedElement);
}

/// How kernels read the map. Throws Error where the device has no way.
gpu::Access access_of(const gpu::Context& context, const OccupancyGrid& map) {
  const gpu::Limits& limits = context.limits();
  if (const auto access = map_access(limits, bordered_cells(map))) {
    return *access;
  }
  throw Error(
      Fault::input,
      fmt::format("map '{}': {} x {} cells exceed the {} that kernels of device '{}' read in one "
                  "buffer; build it with larger cells",
                  map.label, map.nx, map.ny, most_map_cells(limits), context.name()));
}

constexpr std::uint32_t longest_run = 8;
constexpr std::uint32_t longest_edge = 5;

/// Neighbouring bins that an invocation takes, which together span at most `cells` cells; of a run,
/// 0.
struct Tile {
  std::uint32_t cells = 0;
  std::uint32_t x = 0;
  std::uint32_t y = 0;

  std::uint32_t bins() const { return x * y; }
};

std::uint32_t bins_within(std::uint32_t cells, double step_cells, int count) {
  const double limit = 1.0 + std::floor(cells / std::max(step_cells, 1e-9) * (1.0 + 1e-12));
  return static_cast<std::uint32_t>(
      std::min({limit, static_cast<double>(count), static_cast<double>(longest_edge)}));
}

Tile tile_within(std::uint32_t cells, const glm::dvec2& step_cells, const PoseLattice& lattice,
                 std::uint32_t most_bins) {
  Tile tile{.cells = cells,
            .x = bins_within(cells, step_cells.x, lattice.x_mm.count),
            .y = bins_within(cells, step_cells.y, lattice.y_mm.count)};
  while (tile.bins() > most_bins) {
    (tile.x > tile.y ? tile.x : tile.y) -= 1;
  }
  return tile;
}

/// The run length that covers a row with the fewest bins beyond its end, the longest of equals.
std::uint32_t run_for(std::uint32_t nx, std::uint32_t longest) {
  std::uint32_t best = 1;
  for (std::uint32_t run = 1; run <= std::min(nx, longest); ++run) {
    // Sharing the element's load is worth a little waste.
    const auto cost = [nx](std::uint32_t r) { return groups_of(nx, r) * (r + 1); };
    if (cost(run) <= cost(best)) {
      best = run;
    }
  }
  return best;
}

/// Puts every hypothesis's map into a group. Throws Error where a map, or the lattice along x and
/// y, is larger than what kernels read.
std::vector<MapGroup> group_maps(const gpu::Context& context,
                                 std::span<const Hypothesis> hypotheses,
                                 const PoseLattice& lattice) {
  const gpu::Limits& limits = context.limits();
  const std::size_t most_places =
      std::min(limits.storage_range, limits.allocation) / sizeof(shaders::Split);
  const std::size_t most_objects =
      most_places / (static_cast<std::size_t>(lattice.x_mm.count) + lattice.y_mm.count);
  if (most_objects == 0) {
    const bool x = lattice.x_mm.count > lattice.y_mm.count;
    throw Error(Fault::input,
                fmt::format("bins {} = {}: device '{}' takes at most {} of x and y together; use "
                            "fewer",
                            x ? "x" : "y", (x ? lattice.x_mm : lattice.y_mm).count, context.name(),
                            most_places));
  }
  std::vector<MapGroup> groups;
  for (std::size_t object = 0; object < hypotheses.size(); ++object) {
    const OccupancyGrid& map = hypotheses[object].compared();
    const MapGroup own{map.cell_mm, access_of(context, map), bordered_cells(map), {object}};
    const std::uint64_t limit = most_map_cells(limits, own.access);
    const auto group = std::ranges::find_if(groups, [&](const MapGroup& g) {
      return g.alike(own) && g.cells + own.cells <= limit && g.objects.size() < most_objects;
    });
    if (group == groups.end()) {
      groups.push_back(own);
    } else {
      group->cells += own.cells;
      group->objects.push_back(object);
    }
  }
  return groups;
}

/// Chooses neighbouring bins in register tiles or, where too few bins lie side by side within two
/// of the map's cells, runs of bins of a row.
/// @param maps of the objects whose bins a dispatch takes together
LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, const MapGroup& maps,
                           const ContactModel& model) {
  const gpu::Limits& limits = context.limits();
  const glm::dvec2 step_cells = glm::dvec2(lattice.x_mm.step(), lattice.y_mm.step()) / maps.cell_mm;
  const std::uint32_t most_bins =
      most_bins_per_invocation(limits, lattice.bins() * std::ssize(maps.objects));
  Tile tile = tile_within(1, step_cells, lattice, most_bins);
  // Sixteen nodes in the place of nine cost a fifth more a bin, but are shared: measured, 5 x 5
  // bins over two cells take three quarters of the time of 3 x 3 over one, and as long as 4 x 4.
  if (const Tile wide = tile_within(2, step_cells, lattice, most_bins);
      wide.bins() >= 2 * tile.bins()) {
    tile = wide;
  }
  // On a CPU device a run of bins takes as long as a tile of nine over two cells, measured. A GPU
  // waits for fetches: a tile has four, a run one a bin.
  const bool tiled = tile.bins() >= (limits.cpu ? 10U : 5U);
  if (!tiled) {
    const auto nx = static_cast<std::uint32_t>(lattice.x_mm.count);
    tile = {.cells = 0, .x = run_for(nx, std::min(longest_run, most_bins)), .y = 1};
  }
  const auto step_bits = [&](double step) {
    return std::bit_cast<std::uint32_t>(tiled ? static_cast<float>(step) : 0.0F);
  };
  std::vector<std::uint32_t> constants = contact_constants(limits, model);
  constants.insert(constants.end(), {maps.access == Access::table ? 1U : 0U, tile.x, tile.y,
                                     step_bits(step_cells.x), step_bits(step_cells.y), tile.cells});
  return {
      .kernel = gpu::Kernel(context, {.name = "accumulate_likelihood",
                                      .spirv = shaders::accumulate_likelihood,
                                      .bindings = {Access::table, Access::table, Access::table,
                                                   Access::table, Access::storage, Access::storage,
                                                   Access::storage, Access::storage},
                                      .push_bytes = sizeof(shaders::LikelihoodPush),
                                      .constants = constants}),
      .bins_x = tile.x,
      .bins_y = tile.y,
      .description =
          tiled
              ? fmt::format("register tiles of {} x {} bins over {} of a side: the lattice's step "
                            "is {:.3g} x {:.3g} of a map cell",
                            tile.x, tile.y, tile.cells == 1 ? "one cell" : "two cells",
                            step_cells.x, step_cells.y)
              : fmt::format("runs of {} bins: at a lattice step of {:.3g} x {:.3g} map cells "
                            "fewer bins than a tile needs lie side by side{}",
                            tile.x, step_cells.x, step_cells.y,
                            limits.cpu ? "" : ", or tiles leave the GPU idle")};
}

}  // namespace

std::size_t DenseLikelihood::batch_for(const gpu::Context& context, const PoseLattice& lattice,
                                       std::size_t objects) {
  const gpu::Limits& limits = context.limits();
  const auto thetas = static_cast<std::size_t>(lattice.theta_rad.count);
  const std::size_t table = std::min<std::size_t>(
      limits.table_texels, limits.allocation / sizeof(shaders::RotatedElement));
  if (thetas > table) {
    throw Error(Fault::input,
                fmt::format("bins theta = {}: device '{}' takes at most {}; use fewer", thetas,
                            context.name(), table));
  }
  // What bounds a dispatch: the table, the kernel's loops (at most half of their iterations are for
  // the elements of one segment, see accumulate()), and the work. Below 16 elements reading and
  // writing the belief would begin to count.
  const std::size_t by_table = most_table_bytes / bytes_per_element(lattice);
  std::int64_t bins = 0;
  for (const SlabExtent& slab : DenseBelief::cut(context, lattice, objects)) {
    bins = std::max(bins, slab.object_count * slab.bins());
  }
  const auto by_work = static_cast<std::size_t>(work_per_run(limits) / static_cast<double>(bins));
  const std::size_t wanted = std::min(
      {by_table, std::size_t{gpu::most_iterations / 2}, std::max<std::size_t>(16, by_work)});
  const std::size_t elements = std::min(std::max(wanted, factors), table / thetas);
  return elements < factors ? elements : elements / factors * factors;
}

DenseLikelihood::DenseLikelihood(gpu::Context& context, gpu::CommandStream& stream,
                                 const DenseBelief& belief, std::span<const Hypothesis> hypotheses,
                                 const PoseLattice& lattice, const ContactModel& model)
    : context_(context),
      stream_(stream),
      lattice_(lattice),
      objects_(hypotheses.size()),
      contact_(context, stream, model),
      batch_elements_(batch_for(context, lattice, hypotheses.size())) {
  for (MapGroup& maps : group_maps(context, hypotheses, lattice)) {
    LikelihoodPath path = choose_path(context, lattice, maps, model);
    BorderedMaps nodes(context, maps.access, maps.cells,
                       fmt::format("map '{}'", hypotheses[maps.objects.front()].map.label));
    std::vector<shaders::Split> axes;
    std::vector<shaders::ObjectPlace> places;
    for (const std::size_t object : maps.objects) {
      const OccupancyGrid& map = hypotheses[object].compared();
      const auto slab =
          std::ranges::find_if(belief.slabs(), [&](const Slab& s) { return s.holds(object); });
      places.push_back({.first_node = nodes.add(stream, map, *model.prior),
                        .map_width = map.nx + 2 * shaders::MAP_BORDER,
                        .map_height = map.ny + 2 * shaders::MAP_BORDER,
                        .first_axis = static_cast<shaders::uint>(axes.size()),
                        .first_bin = static_cast<shaders::uint>(slab->first_bin(object)),
                        .first_table_node = contact_.first_node(object)});
      const std::vector<shaders::Split> own_axes = axes_in_cells(map, lattice);
      axes.insert(axes.end(), own_axes.begin(), own_axes.end());
    }
    groups_.push_back({std::move(maps), std::move(path), std::move(nodes),
                       stream.uploaded(axes, "the lattice's axes"),
                       stream.uploaded(places, "the objects' places")});
  }
  reserve(1);
  for (const Group& group : groups_) {
    for (const Slab& slab : belief.slabs()) {
      if (const Range range = within(group, slab); range.count > 0) {
        dispatch(group, range, slab, 0, 0);
        break;
      }
    }
  }
}

DenseLikelihood::Range DenseLikelihood::within(const Group& group, const Slab& slab) {
  const auto begin = group.objects.begin();
  const auto first = std::lower_bound(begin, group.objects.end(), slab.object_first);
  const auto end =
      std::lower_bound(first, group.objects.end(), slab.object_first + slab.object_count);
  return {static_cast<std::uint32_t>(first - begin), static_cast<std::uint32_t>(end - first)};
}

void DenseLikelihood::dispatch(const Group& group, const Range& range, const Slab& slab,
                               std::size_t segments, std::size_t elements) {
  const shaders::LikelihoodPush push{.nx = slab.nx,
                                     .row_first = slab.row_first,
                                     .rows = slab.row_count,
                                     .theta_first = slab.theta_first,
                                     .segments = static_cast<shaders::uint>(segments),
                                     .elements = static_cast<shaders::uint>(elements),
                                     .object_first = range.first};
  const LikelihoodPath& path = group.path;
  const std::uint32_t invocations =
      groups_of(slab.nx, path.bins_x) * groups_of(slab.row_count, path.bins_y);
  stream_.dispatch(
      path.kernel,
      {&segments_, &contact_.nodes(), &elements_, group.maps.nodes().read_as(Access::table),
       group.maps.nodes().read_as(Access::storage), &group.axes, &group.places,
       &slab.log_likelihood},
      push,
      {groups_of(invocations, independent_lanes(context_.limits())), range.count,
       slab.theta_count});
}

void DenseLikelihood::reserve(std::size_t elements) {
  if (elements * bytes_per_element(lattice_) > elements_.bytes()) {
    // The old ones go first, so that both never count at once.
    segments_ = {};
    elements_ = {};
    segments_ = gpu::Buffer(context_, elements * sizeof(shaders::Segment), gpu::Memory::device,
                            "segments", VK_FORMAT_R32G32B32A32_SINT);
    elements_ = gpu::Buffer(context_, elements * bytes_per_element(lattice_), gpu::Memory::device,
                            "rotated elements", VK_FORMAT_R32G32B32A32_SINT);
  }
}

void DenseLikelihood::accumulate(const KnownElements& known, const DenseBelief& belief,
                                 const std::function<void(double)>& progress) {
  const std::vector<ReadingRun>& runs = known.runs;
  const double bins = static_cast<double>(lattice_.bins()) * static_cast<double>(objects_);
  const double all_work = bins * static_cast<double>(known.from_pivot_mm.size());
  double done = 0.0;
  double pending = 0.0;
  // For all elements of the touches, so that the next ones, of which more may be known, find room.
  const std::size_t room = std::min(known.from_pivot_mm.capacity(), batch_elements_);
  reserve(room);
  batch_.reserve(runs.capacity());
  rotated_.reserve(room * static_cast<std::size_t>(lattice_.theta_rad.count));

  for (std::size_t run = 0; run < runs.size();) {
    // As many whole runs as the table holds and as the kernel's loops take together: up to two
    // iterations for an element and eight for a run.
    const std::size_t first = runs[run].begin;
    batch_.clear();
    const auto fits = [&](const ReadingRun& next) {
      const std::size_t elements = next.end - first;
      return elements <= batch_elements_ &&
             elements + 4 * (batch_.size() + 1) <= gpu::most_iterations;
    };
    for (; run < runs.size() && fits(runs[run]); ++run) {
      batch_.push_back(segment_of(runs[run], first));
    }
    const std::size_t elements = batch_.back().end;
    stream_.upload(segments_, batch_);

    for (const Group& group : groups_) {
      rotated_ = rotated_elements(std::span(known.from_pivot_mm).subspan(first, elements),
                                  lattice_.theta_rad, group.cell_mm, std::move(rotated_));
      stream_.upload(elements_, rotated_);
      for (const Slab& slab : belief.slabs()) {
        const Range range = within(group, slab);
        if (range.count == 0) {
          continue;
        }
        dispatch(group, range, slab, batch_.size(), elements);
        pending += static_cast<double>(range.count * slab.bins()) * static_cast<double>(elements);
        if (pending > work_per_run(context_.limits())) {
          stream_.run();
          done += pending;
          pending = 0.0;
          if (progress) {
            progress(done / all_work);
          }
        }
      }
    }
  }
  stream_.run();
}

std::vector<std::string> DenseLikelihood::paths() const {
  std::vector<std::string> descriptions;
  for (auto group = groups_.begin(); group != groups_.end(); ++group) {
    // Maps of one kind may need several groups.
    const auto same = [&](const Group& earlier) { return earlier.alike(*group); };
    if (std::none_of(groups_.begin(), group, same)) {
      descriptions.push_back(group->path.description);
    }
  }
  return descriptions;
}

std::uint64_t DenseLikelihood::device_bytes() const {
  std::uint64_t bytes = elements_.bytes() + segments_.bytes() + contact_.nodes().bytes();
  for (const Group& group : groups_) {
    bytes += group.maps.nodes().bytes() + group.axes.bytes() + group.places.bytes();
  }
  return bytes;
}

}  // namespace palpate
