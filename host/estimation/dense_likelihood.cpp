#include "dense_likelihood.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "bordered_map.hpp"
#include "interface.h"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr VkDeviceSize table_bytes = 16 << 20;
// Bins times elements: about half a second on a CPU device, so that progress shows; watchdogs of
// desktop GPUs, which are a hundred times faster, allow two.
constexpr double work_per_run = 5e8;

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

DenseLikelihood::DenseLikelihood(gpu::Context& context, gpu::CommandStream& stream,
                                 const Belief& belief, std::span<const Hypothesis> hypotheses,
                                 const PoseLattice& lattice, const ContactLikelihood& model)
    : context_(context), stream_(stream), lattice_(lattice) {
  for (std::size_t object = 0; object < hypotheses.size(); ++object) {
    const OccupancyGrid& map = hypotheses[object].map;
    const std::vector<float> cells = with_border(map, model.prior);
    const std::vector<shaders::Split> axes = axes_in_cells(lattice, map);
    if (cells.size() > context.limits().table_texels) {
      throw Error(
          Fault::input,
          fmt::format("map '{}': {} x {} cells exceed the {} that device '{}' reads as a "
                      "table; build it with larger cells",
                      map.label, map.nx, map.ny, context.limits().table_texels, context.name()));
    }
    Map& uploaded = maps_.emplace_back();
    uploaded.width = map.nx + 2 * shaders::MAP_BORDER;
    uploaded.height = map.ny + 2 * shaders::MAP_BORDER;
    uploaded.log_odds = gpu::Buffer(context, cells.size() * sizeof(float), gpu::Memory::device,
                                    fmt::format("map '{}'", map.label), VK_FORMAT_R32_SFLOAT);
    uploaded.axes = gpu::Buffer(context, axes.size() * sizeof(shaders::Split), gpu::Memory::device,
                                "the lattice's axes");
    stream.upload(uploaded.log_odds, std::span(cells));
    stream.upload(uploaded.axes, std::span(axes));

    const auto scale = std::find_if(scales_.begin(), scales_.end(),
                                    [&](const Scale& s) { return s.cell_mm == map.cell_mm; });
    if (scale == scales_.end()) {
      scales_.push_back({map.cell_mm, choose_path(context, lattice, map.cell_mm, model), {object}});
    } else {
      scale->objects.push_back(object);
    }
  }

  bytes_per_element_ = lattice.theta_rad.count * sizeof(shaders::RotatedElement);
  // What bounds a dispatch: the table, the kernel's loops (which take up to two iterations for an
  // element), and the work. Below 16 elements reading and writing the belief would begin to count.
  const std::size_t most_texels = context.limits().table_texels;
  const auto thetas = static_cast<std::size_t>(lattice.theta_rad.count);
  if (thetas > most_texels) {
    throw Error(Fault::input,
                fmt::format("bins theta = {}: device '{}' takes at most {}; use fewer", thetas,
                            context.name(), most_texels));
  }
  const std::size_t by_table =
      std::clamp<std::size_t>(table_bytes / bytes_per_element_, 1, most_texels / thetas);
  const auto by_work = static_cast<std::size_t>(work_per_run / static_cast<double>(lattice.bins()));
  batch_elements_ = std::min(
      {by_table, std::size_t{gpu::most_iterations / 2}, std::max<std::size_t>(16, by_work)});

  reserve(1);
  for (const Scale& scale : scales_) {
    const std::size_t object = scale.objects.front();
    dispatch(scale.path, object, belief.slabs(object).front(), 0, 0);
  }
}

void DenseLikelihood::dispatch(const LikelihoodPath& path, std::size_t object, const Slab& slab,
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
  const std::uint32_t invocations =
      blocks(slab.nx, path.bins_x) * blocks(slab.row_count, path.bins_y);
  stream_.dispatch(path.kernel,
                   {&map.log_odds, &map.axes, &elements_, &segments_, &slab.log_likelihood}, push,
                   {blocks(invocations, likelihood_workgroup), 1, slab.theta_count});
}

void DenseLikelihood::reserve(std::size_t elements) {
  if (elements * bytes_per_element_ > elements_.bytes()) {
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
                          lattice_.theta_rad, scale.cell_mm);
      stream_.upload(elements_, std::span<const shaders::RotatedElement>(rotated));
      for (const std::size_t object : scale.objects) {
        for (const Slab& slab : belief.slabs(object)) {
          dispatch(scale.path, object, slab, batch.size(), elements);
          pending += static_cast<double>(slab.bins()) * static_cast<double>(elements);
          if (pending > work_per_run) {
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
  std::uint64_t bytes = elements_.bytes() + segments_.bytes();
  for (const Map& map : maps_) {
    bytes += map.log_odds.bytes() + map.axes.bytes();
  }
  return bytes;
}

}  // namespace palpate
