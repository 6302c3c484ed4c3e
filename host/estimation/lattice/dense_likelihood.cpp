#include "estimation/lattice/dense_likelihood.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "estimation/kernel_sizes.hpp"
#include "model/log_message.hpp"
#include "palpate/error.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

constexpr VkDeviceSize table_bytes = 16 << 20;
// A batch of whole products, so that it does not matter which elements share one.
constexpr std::size_t factors = shaders::FACTORS_PER_LOG;

/// Memory of an element rotated by every theta.
VkDeviceSize bytes_per_element(const PoseLattice& lattice) {
  return static_cast<VkDeviceSize>(lattice.theta_rad.count) * sizeof(shaders::RotatedElement);
}

/// Every object's first bin in its slab.
std::vector<std::uint32_t> first_bins_of(const DenseBelief& belief, std::size_t objects) {
  std::vector<std::uint32_t> bins;
  for (std::size_t object = 0; object < objects; ++object) {
    const auto slab = std::find_if(belief.slabs().begin(), belief.slabs().end(),
                                   [&](const Slab& s) { return s.holds(object); });
    bins.push_back(static_cast<std::uint32_t>(slab->first_bin(object)));
  }
  return bins;
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
  const std::size_t by_table = table_bytes / bytes_per_element(lattice);
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
  const std::vector<std::uint32_t> first_bins = first_bins_of(belief, hypotheses.size());
  for (const MapGroup& group : group_maps(context, hypotheses, lattice)) {
    groups_.push_back({group,
                       choose_path(context, lattice, group.objects.size(), group.kind, model),
                       MapTable(context, stream, group, hypotheses, lattice, first_bins,
                                *model.prior, contact_)});
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
  const MapTable& tables = group.tables;
  const gpu::Buffer& maps = tables.maps.nodes();
  const std::uint32_t invocations =
      groups_of(slab.nx, path.bins_x) * groups_of(slab.row_count, path.bins_y);
  stream_.dispatch(
      path.kernel,
      {&segments_, &contact_.nodes(), &elements_, maps.read_as(gpu::Access::table),
       maps.read_as(gpu::Access::storage), &tables.axes, &tables.places, &slab.log_likelihood},
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

void DenseLikelihood::accumulate(const ContactEvidence& evidence, const DenseBelief& belief,
                                 const std::function<void(double)>& progress) {
  const auto& segments = evidence.segments;
  const double bins = static_cast<double>(lattice_.bins()) * static_cast<double>(objects_);
  const double all_work = bins * static_cast<double>(evidence.from_pivot_mm.size());
  double done = 0.0;
  double pending = 0.0;
  // For the whole touches, so that the next ones, of which more may be known, find room.
  const std::size_t most = std::min(evidence.elements(), batch_elements_);
  reserve(most);
  batch_.reserve(segments.capacity());
  rotated_.reserve(most * static_cast<std::size_t>(lattice_.theta_rad.count));

  for (std::size_t s = 0; s < segments.size();) {
    // As many whole segments as the table holds and as the kernel's loops take together: up to two
    // iterations for an element and eight for a segment.
    const std::size_t first = segments[s].begin;
    batch_.clear();
    const auto fits = [&](const shaders::Segment& next) {
      const std::size_t elements = next.end - first;
      return elements <= batch_elements_ &&
             elements + 4 * (batch_.size() + 1) <= gpu::most_iterations;
    };
    for (; s < segments.size() && fits(segments[s]); ++s) {
      batch_.push_back(segments[s]);
      batch_.back().begin -= static_cast<shaders::uint>(first);
      batch_.back().end -= static_cast<shaders::uint>(first);
    }
    const std::size_t elements = batch_.back().end;
    stream_.upload(segments_, batch_);

    for (const Group& group : groups_) {
      rotated_ = rotate_evidence(std::span(evidence.from_pivot_mm).subspan(first, elements),
                                 lattice_.theta_rad, group.kind.cell_mm, std::move(rotated_));
      stream_.upload(elements_, rotated_);
      for (const Slab& slab : belief.slabs()) {
        const Range range = within(group, slab);
        if (range.count == 0) {
          continue;
        }
        dispatch(group, range, slab, batch_.size(), elements);
        pending += work_of(range, slab, elements);
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
    const auto same = [&](const Group& earlier) { return earlier.kind == group->kind; };
    if (std::none_of(groups_.begin(), group, same)) {
      descriptions.push_back(group->path.description);
    }
  }
  return descriptions;
}

std::uint64_t DenseLikelihood::device_bytes() const {
  std::uint64_t bytes = elements_.bytes() + segments_.bytes() + contact_.nodes().bytes();
  for (const Group& group : groups_) {
    bytes += group.tables.device_bytes();
  }
  return bytes;
}

}  // namespace palpate
