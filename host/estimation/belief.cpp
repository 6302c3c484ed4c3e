#include "belief.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "interface.h"
#include "palpate/error.hpp"
#include "reduce_belief.hpp"
#include "sum_over_plane.hpp"
#include "sum_over_theta.hpp"

namespace palpate {

namespace {

constexpr std::uint32_t workgroup = 64;  // the minimum a device must allow is 128
constexpr std::uint32_t workgroup_constant[] = {workgroup};

/// Cuts an object's bins into slabs of whole theta planes, or, where a plane alone is too large
/// for a binding or a dispatch, into parts of planes.
std::vector<Slab> cut_into_slabs(gpu::Context& context, const PoseLattice& lattice) {
  const gpu::Limits& limits = context.limits();
  const std::int64_t binding_bins = std::min(
      static_cast<std::int64_t>(std::min<VkDeviceSize>(limits.storage_range, limits.allocation) /
                                sizeof(TwoFloat)),
      std::int64_t{limits.group_count[0]} * shaders::REDUCE_BINS);
  const std::int64_t plane_part =
      std::min({lattice.plane(), binding_bins, std::int64_t{limits.group_count[0]} * workgroup});
  const std::int64_t planes =
      plane_part < lattice.plane()
          ? 1
          : std::min({binding_bins / lattice.plane(), std::int64_t{limits.group_count[2]},
                      std::int64_t{limits.group_count[0]}, std::int64_t{lattice.theta_rad.count}});
  std::vector<Slab> slabs;
  for (std::int64_t theta = 0; theta < lattice.theta_rad.count; theta += planes) {
    for (std::int64_t first = 0; first < lattice.plane(); first += plane_part) {
      Slab slab;
      slab.theta_first = static_cast<std::uint32_t>(theta);
      slab.theta_count =
          static_cast<std::uint32_t>(std::min(planes, lattice.theta_rad.count - theta));
      slab.plane_first = static_cast<std::uint32_t>(first);
      slab.plane_count = static_cast<std::uint32_t>(std::min(plane_part, lattice.plane() - first));
      slab.log_likelihood =
          gpu::Buffer(context, slab.bins() * sizeof(TwoFloat), gpu::Memory::device,
                      fmt::format("{} pose bins", slab.bins()));
      slabs.push_back(std::move(slab));
    }
  }
  return slabs;
}

/// Some drivers hand out more memory than there is and fail only when it is written.
void require_memory(const gpu::Context& context, const PoseLattice& lattice, std::size_t objects) {
  constexpr double gib = 1 << 30;
  const double needed = static_cast<double>(sizeof(TwoFloat)) * static_cast<double>(objects) *
                        lattice.x_mm.count * lattice.y_mm.count * lattice.theta_rad.count;
  const auto held = static_cast<double>(context.limits().memory);
  if (needed > held) {
    throw Error(Fault::system,
                fmt::format("{} objects x {} x {} x {} pose bins need {:.1f} GiB, device '{}' has "
                            "{:.1f}; use fewer bins or objects",
                            objects, lattice.x_mm.count, lattice.y_mm.count,
                            lattice.theta_rad.count, needed / gib, context.name(), held / gib));
  }
}

std::size_t partials_of(const Slab& slab) {
  return static_cast<std::size_t>((slab.bins() + shaders::REDUCE_BINS - 1) / shaders::REDUCE_BINS);
}

/// Index in the lattice of a slab's bin.
std::int64_t lattice_index(const PoseLattice& lattice, const Slab& slab, std::int64_t in_slab) {
  return (slab.theta_first + in_slab / slab.plane_count) * lattice.plane() + slab.plane_first +
         in_slab % slab.plane_count;
}

bool exceeds(const TwoFloat& a, const TwoFloat& b) { return a.value() > b.value(); }

}  // namespace

Belief::Belief(gpu::Context& context, gpu::CommandStream& stream, const PoseLattice& lattice,
               std::size_t objects)
    : context_(context),
      stream_(stream),
      lattice_(lattice),
      reduce_(context, {.name = "reduce_belief",
                        .spirv = shaders::reduce_belief,
                        .buffers = 2,
                        .push_bytes = sizeof(shaders::ReducePush),
                        .constants = workgroup_constant}),
      sum_over_theta_(context, {.name = "sum_over_theta",
                                .spirv = shaders::sum_over_theta,
                                .buffers = 2,
                                .push_bytes = sizeof(shaders::MarginalPush),
                                .constants = workgroup_constant}),
      sum_over_plane_(context, {.name = "sum_over_plane",
                                .spirv = shaders::sum_over_plane,
                                .buffers = 2,
                                .push_bytes = sizeof(shaders::MarginalPush),
                                .constants = workgroup_constant}) {
  require_memory(context, lattice, objects);
  for (std::size_t object = 0; object < objects; ++object) {
    slabs_.push_back(cut_into_slabs(context, lattice));
    for (const Slab& slab : slabs_.back()) {
      partial_count_ += partials_of(slab);
    }
  }
  partials_ = gpu::Buffer(context, partial_count_ * sizeof(shaders::Partial), gpu::Memory::device,
                          "partial sums");
  clear();
}

void Belief::clear() {
  for (const auto& slabs : slabs_) {
    for (const Slab& slab : slabs) {
      stream_.fill(slab.log_likelihood, 0);
    }
  }
}

std::uint64_t Belief::device_bytes() const {
  std::uint64_t bytes = partials_.bytes();
  for (const auto& slabs : slabs_) {
    for (const Slab& slab : slabs) {
      bytes += slab.log_likelihood.bytes();
    }
  }
  return bytes;
}

std::vector<BeliefSummary> Belief::summarise() const {
  std::uint32_t first = 0;
  for (const auto& slabs : slabs_) {
    for (const Slab& slab : slabs) {
      const auto groups = static_cast<std::uint32_t>(partials_of(slab));
      const shaders::ReducePush push{.bins = static_cast<std::uint32_t>(slab.bins()),
                                     .partial_first = first};
      stream_.dispatch(reduce_,
                       std::array{gpu::Binding{&slab.log_likelihood}, gpu::Binding{&partials_}},
                       push, {groups, 1, 1});
      first += groups;
    }
  }
  std::vector<shaders::Partial> partials(partial_count_);
  stream_.download(partials_, std::span(partials));
  stream_.run();

  std::vector<BeliefSummary> summaries;
  const shaders::Partial* partial = partials.data();
  for (const auto& slabs : slabs_) {
    const shaders::Partial* const begin = partial;
    BeliefSummary summary;
    bool any = false;
    for (const Slab& slab : slabs) {
      for (std::size_t i = 0; i < partials_of(slab); ++i, ++partial) {
        const TwoFloat max{partial->max_high, partial->max_low};
        // Slabs stand in the lattice's order, so the first of equals has the lowest bin.
        if (!any || exceeds(max, summary.max)) {
          summary.max = max;
          summary.arg_max = lattice_index(lattice_, slab, partial->arg_max);
          any = true;
        }
      }
    }
    for (const shaders::Partial* p = begin; p != partial; ++p) {
      summary.sum +=
          p->sum * std::exp(TwoFloat{p->max_high, p->max_low}.value() - summary.max.value());
    }
    summaries.push_back(summary);
  }
  return summaries;
}

std::vector<float> Belief::sum_over_theta(std::size_t object, TwoFloat max) const {
  std::vector<float> sums(static_cast<std::size_t>(lattice_.plane()));
  const gpu::Buffer marginal(context_, sums.size() * sizeof(float), gpu::Memory::device,
                             "a marginal");
  stream_.fill(marginal, 0);
  for (const Slab& slab : slabs_[object]) {
    const shaders::MarginalPush push{slab.plane_first, slab.plane_count, slab.theta_first,
                                     slab.theta_count, max.high,         max.low};
    stream_.dispatch(sum_over_theta_,
                     std::array{gpu::Binding{&slab.log_likelihood}, gpu::Binding{&marginal}}, push,
                     {(slab.plane_count + workgroup - 1) / workgroup, 1, 1});
  }
  stream_.download(marginal, std::span(sums));
  stream_.run();
  return sums;
}

std::vector<float> Belief::sum_over_plane(std::size_t object, TwoFloat max) const {
  std::vector<float> sums(static_cast<std::size_t>(lattice_.theta_rad.count));
  const gpu::Buffer marginal(context_, sums.size() * sizeof(float), gpu::Memory::device,
                             "a marginal");
  stream_.fill(marginal, 0);
  for (const Slab& slab : slabs_[object]) {
    const shaders::MarginalPush push{slab.plane_first, slab.plane_count, slab.theta_first,
                                     slab.theta_count, max.high,         max.low};
    stream_.dispatch(sum_over_plane_,
                     std::array{gpu::Binding{&slab.log_likelihood}, gpu::Binding{&marginal}}, push,
                     {slab.theta_count, 1, 1});
  }
  stream_.download(marginal, std::span(sums));
  stream_.run();
  return sums;
}

std::vector<double> Belief::download(std::size_t object) const {
  std::vector<double> values(static_cast<std::size_t>(lattice_.bins()));
  std::vector<TwoFloat> raw;
  for (const Slab& slab : slabs_[object]) {
    raw.resize(static_cast<std::size_t>(slab.bins()));
    stream_.download(slab.log_likelihood, std::span(raw));
    stream_.run();
    for (std::int64_t i = 0; i < slab.bins(); ++i) {
      values[lattice_index(lattice_, slab, i)] = raw[i].value();
    }
  }
  return values;
}

}  // namespace palpate
