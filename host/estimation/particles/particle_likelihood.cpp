#include "estimation/particles/particle_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "estimation/kernel_sizes.hpp"
#include "palpate/error.hpp"
#include "shaders/interface.h"
#include "shaders/weigh_particles.hpp"

namespace palpate {

namespace {

using gpu::Access;

/// Coordinates in cells, or a cosine and sine, split at multiples of `quantum`. With 2^-2 cells and
/// 2^-11, sums of products of the coarse parts are exact up to 1,000 cells.
shaders::CoarseAndFine split_coarse(const glm::dvec2& v, double quantum) {
  const glm::dvec2 coarse{std::round(v.x / quantum) * quantum, std::round(v.y / quantum) * quantum};
  return {static_cast<float>(coarse.x), static_cast<float>(coarse.y),
          static_cast<float>(v.x - coarse.x), static_cast<float>(v.y - coarse.y)};
}

std::vector<shaders::CoarseAndFine> headings() {
  std::vector<shaders::CoarseAndFine> table;
  for (shaders::uint i = 0; i < shaders::HEADINGS; ++i) {
    table.push_back(
        split_coarse(rotate(2.0 * std::numbers::pi * i / shaders::HEADINGS, {1.0, 0.0}), 0x1p-11));
  }
  return table;
}

/// In cells. An element beyond 2^20 of them, of which products are no longer exact, or whose place
/// is no number, counts as off every map: however it is turned, it lies further from the pivot than
/// the region's centre does, whose cells end at 2^29 or are those of split_axis().
shaders::CoarseAndFine element_in_cells(const glm::dvec2& from_pivot_mm, double cell_mm) {
  constexpr double far = 1 << 20;
  const glm::dvec2 cells = from_pivot_mm / cell_mm;
  if (!(std::abs(cells.x) <= far && std::abs(cells.y) <= far)) {
    return {0x1p30F, 0.0F, 0.0F, 0.0F};
  }
  return split_coarse(cells, 0.25);
}

/// Index in a list of different values, which takes in the value where it lacks it.
std::size_t index_of(std::vector<double>& values, double value) {
  const auto index = static_cast<std::size_t>(std::ranges::find(values, value) - values.begin());
  values.resize(std::max(values.size(), index + 1), value);
  return index;
}

/// Throws Error where no buffer holds the maps together, before any is copied.
BorderedMaps room_for(gpu::Context& context, std::span<const Hypothesis> hypotheses) {
  const gpu::Limits& limits = context.limits();
  std::uint64_t cells = 0;
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.compared();
    cells += bordered_cells(map);
    if (!map_access(limits, cells)) {
      throw Error(Fault::input,
                  fmt::format("maps up to '{}': {} cells together exceed the {} that device '{}' "
                              "reads in one buffer; build them with larger cells",
                              map.label, cells, most_map_cells(limits), context.name()));
    }
  }
  return {context, *map_access(limits, cells), cells, "maps"};
}

}  // namespace

ParticleLikelihood::ParticleLikelihood(gpu::Context& context, gpu::CommandStream& stream,
                                       std::span<const Hypothesis> hypotheses,
                                       const PoseLattice& region, const ContactModel& model)
    : context_(context),
      stream_(stream),
      theta_centre_rad_(centre(region.theta_rad)),
      maps_(room_for(context, hypotheses)),
      contact_(context, stream, model) {
  std::vector<std::uint32_t> constants = contact_constants(context.limits(), model);
  constants.push_back(maps_.nodes().is_table() ? 1U : 0U);
  kernel_ = gpu::Kernel(
      context, {.name = "weigh_particles",
                .spirv = shaders::weigh_particles,
                .bindings = {Access::table, Access::table, Access::table, Access::table,
                             Access::storage, Access::storage, Access::storage, Access::storage},
                .push_bytes = sizeof(shaders::WeighPush),
                .constants = constants});
  std::vector<shaders::ParticleMap> objects;
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const OccupancyGrid& map = hypotheses[i].compared();
    const double cells_per_mm = 1.0 / map.cell_mm;
    const auto high = static_cast<float>(cells_per_mm);
    objects.push_back(
        {.first = maps_.add(stream, map, *model.prior),
         .width = map.nx + 2 * shaders::MAP_BORDER,
         .height = map.ny + 2 * shaders::MAP_BORDER,
         .scale = static_cast<shaders::uint>(index_of(cell_sizes_mm_, map.cell_mm)),
         .cells_per_mm_high = high,
         .cells_per_mm_low = static_cast<float>(cells_per_mm - static_cast<double>(high)),
         .first_table_node = contact_.first_node(i),
         .centre_x = split_axis((centre(region.x_mm) - map.origin_mm.x) / map.cell_mm +
                                shaders::MAP_BORDER),
         .centre_y = split_axis((centre(region.y_mm) - map.origin_mm.y) / map.cell_mm +
                                shaders::MAP_BORDER)});
  }
  objects_ = stream.uploaded(objects, "maps");
  reserve(64);
}

void ParticleLikelihood::reserve(std::size_t elements) {
  const std::size_t texels = shaders::HEADINGS + elements * cell_sizes_mm_.size();
  if (texels > context_.limits().table_texels) {
    throw Error(Fault::input,
                fmt::format("maps of {} cell sizes: more than device '{}' reads at once; build "
                            "them with the same cells",
                            cell_sizes_mm_.size(), context_.name()));
  }
  if (texels * sizeof(shaders::CoarseAndFine) > turns_.bytes()) {
    segments_ = gpu::Buffer(context_, elements * sizeof(shaders::Segment), gpu::Memory::device,
                            "segments", VK_FORMAT_R32G32B32A32_SINT);
    turns_ = gpu::Buffer(context_, texels * sizeof(shaders::CoarseAndFine), gpu::Memory::device,
                         "elements", VK_FORMAT_R32G32B32A32_SFLOAT);
    stream_.upload(turns_, headings());
  }
}

void ParticleLikelihood::weigh(const KnownElements& known, const gpu::Buffer& particles,
                               std::size_t count, const gpu::Buffer& log_weights) {
  // Room for all elements of the touch: of the next one more may be known.
  const std::size_t room = std::min(known.from_pivot_mm.capacity(), longest_run);
  turned_mm_.clear();
  turned_mm_.reserve(known.from_pivot_mm.capacity());
  batch_.reserve(known.runs.capacity());
  table_.reserve(room * cell_sizes_mm_.size());
  for (const glm::dvec2& p : known.from_pivot_mm) {
    turned_mm_.push_back(rotate(theta_centre_rad_, p));
  }
  if (room * sizeof(shaders::Segment) > segments_.bytes()) {
    stream_.run();  // what was recorded may use the tables that go
    reserve(room);
  }
  const std::vector<ReadingRun>& runs = known.runs;
  double pending = 0.0;
  std::size_t run = 0;
  do {
    const bool fresh = run == 0;
    const std::size_t first = runs.empty() ? 0 : runs[run].begin;
    batch_.clear();
    for (; run < runs.size() && runs[run].end - first <= room; ++run) {
      batch_.push_back(segment_of(runs[run], first));
    }
    const std::size_t elements = batch_.empty() ? 0 : batch_.back().end;
    table_.clear();
    for (const double cell_mm : cell_sizes_mm_) {
      for (std::size_t k = 0; k < elements; ++k) {
        table_.push_back(element_in_cells(turned_mm_[first + k], cell_mm));
      }
    }
    const double work = static_cast<double>(count) * static_cast<double>(elements);
    if (pending + work > work_per_run(context_.limits())) {
      stream_.run();
      pending = 0.0;
    }
    pending += work;
    stream_.upload(segments_, batch_);
    stream_.upload(turns_, table_, shaders::HEADINGS * sizeof(shaders::CoarseAndFine));
    const auto invocations = static_cast<std::uint32_t>(count);
    const shaders::WeighPush push{.particles = invocations,
                                  .segments = static_cast<shaders::uint>(batch_.size()),
                                  .elements = static_cast<shaders::uint>(elements),
                                  .fresh = fresh ? 1U : 0U};
    stream_.dispatch(kernel_,
                     {&segments_, &contact_.nodes(), &turns_, maps_.nodes().read_as(Access::table),
                      maps_.nodes().read_as(Access::storage), &objects_, &particles, &log_weights},
                     push, {groups_of(invocations, independent_lanes(context_.limits())), 1, 1});
  } while (run < runs.size());
}

std::uint64_t ParticleLikelihood::device_bytes() const {
  return maps_.nodes().bytes() + objects_.bytes() + turns_.bytes() + segments_.bytes() +
         contact_.nodes().bytes();
}

}  // namespace palpate
