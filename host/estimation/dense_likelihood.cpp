#include "dense_likelihood.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "bordered_map.hpp"
#include "interface.h"
#include "kernel_sizes.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr VkDeviceSize table_bytes = 16 << 20;
// A batch of whole products, so that it does not matter which elements share one.
constexpr std::size_t factors = shaders::FACTORS_PER_LOG;

/// Cells of the map with its border.
std::uint64_t bordered_cells(const OccupancyGrid& map) {
  constexpr int border = 2 * shaders::MAP_BORDER;
  return (static_cast<std::uint64_t>(map.nx) + border) *
         (static_cast<std::uint64_t>(map.ny) + border);
}

/// How kernels read the map. Throws Error where the device has no way.
gpu::Access access_of(const gpu::Context& context, const OccupancyGrid& map) {
  const gpu::Limits& limits = context.limits();
  const std::uint64_t cells = bordered_cells(map);
  const std::uint64_t most_in_storage = limits.storage_range / sizeof(float);
  if (cells <= limits.table_texels) {
    return gpu::Access::table;
  }
  if (cells <= most_in_storage) {
    return gpu::Access::storage;
  }
  throw Error(
      Fault::input,
      fmt::format("map '{}': {} x {} cells exceed the {} that kernels of device '{}' read in one "
                  "buffer; build it with larger cells",
                  map.label, map.nx, map.ny,
                  std::max<std::uint64_t>(limits.table_texels, most_in_storage), context.name()));
}

VkDeviceSize bytes_per_element(const PoseLattice& lattice) {
  return static_cast<VkDeviceSize>(lattice.theta_rad.count) * sizeof(shaders::RotatedElement);
}

VkDeviceSize axes_bytes(const PoseLattice& lattice) {
  return (static_cast<VkDeviceSize>(lattice.x_mm.count) + lattice.y_mm.count) *
         sizeof(shaders::Split);
}

std::uint32_t blocks(std::uint32_t count, std::uint32_t per_block) {
  return (count + per_block - 1) / per_block;
}

/// The lattice's x centres, then its y centres, in cells of the bordered map.
std::vector<shaders::Split> axes_in_cells(const PoseLattice& lattice, const OccupancyGrid& map) {
  std::vector<shaders::Split> axes;
  axes.reserve(static_cast<std::size_t>(lattice.x_mm.count) + lattice.y_mm.count);
  for (int i = 0; i < lattice.x_mm.count; ++i) {
    axes.push_back(
        split((lattice.x_mm.centre(i) - map.origin_mm.x) / map.cell_mm + shaders::MAP_BORDER));
  }
  for (int j = 0; j < lattice.y_mm.count; ++j) {
    axes.push_back(
        split((lattice.y_mm.centre(j) - map.origin_mm.y) / map.cell_mm + shaders::MAP_BORDER));
  }
  return axes;
}

}  // namespace

std::size_t DenseLikelihood::batch_for(const gpu::Context& context, const PoseLattice& lattice) {
  const gpu::Limits& limits = context.limits();
  const auto thetas = static_cast<std::size_t>(lattice.theta_rad.count);
  if (thetas > limits.table_texels) {
    throw Error(Fault::input,
                fmt::format("bins theta = {}: device '{}' takes at most {}; use fewer", thetas,
                            context.name(), limits.table_texels));
  }
  // What bounds a dispatch: the table, the kernel's loops (which take up to two iterations for an
  // element), and the work. Below 16 elements reading and writing the belief would begin to count.
  const std::size_t by_table = table_bytes / bytes_per_element(lattice);
  const auto by_work =
      static_cast<std::size_t>(work_per_run(limits) / static_cast<double>(lattice.bins()));
  const std::size_t wanted = std::min(
      {by_table, std::size_t{gpu::most_iterations / 2}, std::max<std::size_t>(16, by_work)});
  const std::size_t elements = std::min(std::max(wanted, factors), limits.table_texels / thetas);
  return elements < factors ? elements : elements / factors * factors;
}

std::uint64_t DenseLikelihood::bytes_needed(const gpu::Context& context,
                                            std::span<const Hypothesis> hypotheses,
                                            const PoseLattice& lattice, std::size_t elements) {
  std::uint64_t bytes = gpu::allocated(elements * bytes_per_element(lattice)) +
                        gpu::allocated(elements * sizeof(shaders::Segment)) +
                        gpu::allocated(sizeof(float));
  for (const Hypothesis& hypothesis : hypotheses) {
    access_of(context, hypothesis.map);
    bytes += gpu::allocated(bordered_cells(hypothesis.map) * sizeof(float)) +
             gpu::allocated(axes_bytes(lattice));
  }
  return bytes;
}

DenseLikelihood::DenseLikelihood(gpu::Context& context, gpu::CommandStream& stream,
                                 const Belief& belief, std::span<const Hypothesis> hypotheses,
                                 const PoseLattice& lattice, const ContactLikelihood& model,
                                 std::size_t most_elements)
    : context_(context),
      stream_(stream),
      lattice_(lattice),
      bytes_per_element_(bytes_per_element(lattice)),
      batch_elements_(std::min(batch_for(context, lattice), most_elements)),
      no_table_(context, sizeof(float), gpu::Memory::device, "no table", VK_FORMAT_R32_SFLOAT) {
  for (std::size_t object = 0; object < hypotheses.size(); ++object) {
    const OccupancyGrid& map = hypotheses[object].map;
    const MapKind kind{map.cell_mm, access_of(context, map)};
    const std::vector<float> cells = with_border(map, model.prior);
    const std::vector<shaders::Split> axes = axes_in_cells(lattice, map);
    Map& uploaded = maps_.emplace_back();
    uploaded.width = map.nx + 2 * shaders::MAP_BORDER;
    uploaded.height = map.ny + 2 * shaders::MAP_BORDER;
    uploaded.log_odds =
        gpu::Buffer(context, cells.size() * sizeof(float), gpu::Memory::device,
                    fmt::format("map '{}'", map.label),
                    kind.access == gpu::Access::table ? VK_FORMAT_R32_SFLOAT : VK_FORMAT_UNDEFINED);
    uploaded.axes =
        gpu::Buffer(context, axes_bytes(lattice), gpu::Memory::device, "the lattice's axes");
    stream.upload(uploaded.log_odds, std::span(cells));
    stream.upload(uploaded.axes, std::span(axes));

    const auto scale = std::find_if(scales_.begin(), scales_.end(),
                                    [&](const Scale& s) { return s.maps == kind; });
    if (scale == scales_.end()) {
      scales_.push_back({kind, choose_path(context, lattice, kind, model), {object}});
    } else {
      scale->objects.push_back(object);
    }
  }

  reserve(1);
  for (const Scale& scale : scales_) {
    const std::size_t object = scale.objects.front();
    dispatch(scale, object, belief.slabs(object).front(), 0, 0);
  }
}

void DenseLikelihood::dispatch(const Scale& scale, std::size_t object, const Slab& slab,
                               std::size_t segments, std::size_t elements) {
  const Map& map = maps_[object];
  const shaders::LikelihoodPush push{.nx = slab.nx,
                                     .row_first = slab.row_first,
                                     .rows = slab.row_count,
                                     .theta_first = slab.theta_first,
                                     .segments = static_cast<shaders::uint>(segments),
                                     .elements = static_cast<shaders::uint>(elements),
                                     .map_width = map.width,
                                     .map_height = map.height};
  const LikelihoodPath& path = scale.path;
  const std::uint32_t invocations =
      blocks(slab.nx, path.bins_x) * blocks(slab.row_count, path.bins_y);
  // A kernel that reads the map in one way is given any buffer for the other.
  const bool in_table = scale.maps.access == gpu::Access::table;
  stream_.dispatch(
      path.kernel,
      {in_table ? &map.log_odds : &no_table_, &map.axes, &elements_, &segments_,
       &slab.log_likelihood, in_table ? &map.axes : &map.log_odds},
      push, {blocks(invocations, independent_lanes(context_.limits())), 1, slab.theta_count});
}

void DenseLikelihood::reserve(std::size_t elements) {
  if (elements * bytes_per_element_ > elements_.bytes()) {
    // The old ones go first, so that both never count at once.
    segments_ = {};
    elements_ = {};
    segments_ = gpu::Buffer(context_, elements * sizeof(shaders::Segment), gpu::Memory::device,
                            "segments", VK_FORMAT_R32G32B32A32_SINT);
    elements_ = gpu::Buffer(context_, elements * bytes_per_element_, gpu::Memory::device,
                            "rotated elements", VK_FORMAT_R32G32B32A32_SINT);
  }
}

void DenseLikelihood::accumulate(const ContactEvidence& evidence, const Belief& belief,
                                 const std::function<void(double)>& progress) {
  const auto& segments = evidence.segments;
  const double bins = static_cast<double>(lattice_.bins()) * static_cast<double>(maps_.size());
  const double all_work = bins * static_cast<double>(evidence.from_pivot_mm.size());
  double done = 0.0;
  double pending = 0.0;
  reserve(std::min(evidence.from_pivot_mm.size(), batch_elements_));

  for (std::size_t s = 0; s < segments.size();) {
    // As many whole segments as the table holds.
    const std::size_t first = segments[s].begin;
    std::vector<shaders::Segment> batch;
    for (; s < segments.size() && segments[s].end - first <= batch_elements_; ++s) {
      batch.push_back(segments[s]);
      batch.back().begin -= static_cast<shaders::uint>(first);
      batch.back().end -= static_cast<shaders::uint>(first);
    }
    const std::size_t elements = batch.back().end;
    stream_.upload(segments_, std::span<const shaders::Segment>(batch));

    for (const Scale& scale : scales_) {
      const std::vector<shaders::RotatedElement> rotated =
          rotate_evidence(std::span(evidence.from_pivot_mm).subspan(first, elements),
                          lattice_.theta_rad, scale.maps.cell_mm);
      stream_.upload(elements_, std::span<const shaders::RotatedElement>(rotated));
      for (const std::size_t object : scale.objects) {
        for (const Slab& slab : belief.slabs(object)) {
          dispatch(scale, object, slab, batch.size(), elements);
          pending += static_cast<double>(slab.bins()) * static_cast<double>(elements);
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
  }
  stream_.run();
}

std::vector<std::string> DenseLikelihood::paths() const {
  std::vector<std::string> descriptions;
  for (const Scale& scale : scales_) {
    descriptions.push_back(scale.path.description);
  }
  return descriptions;
}

std::uint64_t DenseLikelihood::device_bytes() const {
  std::uint64_t bytes = elements_.bytes() + segments_.bytes() + no_table_.bytes();
  for (const Map& map : maps_) {
    bytes += map.log_odds.bytes() + map.axes.bytes();
  }
  return bytes;
}

}  // namespace palpate
