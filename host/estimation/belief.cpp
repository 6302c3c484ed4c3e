#include "belief.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "add_belief.hpp"
#include "interface.h"
#include "palpate/error.hpp"
#include "reduce_belief.hpp"
#include "sum_marginals.hpp"

namespace palpate {

namespace {

constexpr std::uint32_t workgroup = 64;  // the minimum a device must allow is 128
constexpr std::uint32_t workgroup_constant[] = {workgroup};
constexpr gpu::Access read_and_write[] = {gpu::Access::table, gpu::Access::storage};
constexpr gpu::Access marginal_bindings[] = {gpu::Access::table, gpu::Access::storage,
                                             gpu::Access::storage};

/// Cuts an object's bins into slabs of whole theta planes, or, where a plane alone is too large
/// for a binding or a dispatch, into groups of its rows.
std::vector<Slab> cut_into_slabs(gpu::Context& context, const PoseLattice& lattice) {
  const gpu::Limits& limits = context.limits();
  const auto binding_bins = static_cast<std::int64_t>(
      std::min({limits.storage_range / sizeof(TwoFloat), limits.allocation / sizeof(TwoFloat),
                VkDeviceSize{limits.table_texels},
                VkDeviceSize{limits.group_count[0]} * shaders::REDUCE_BINS}) /
      2 * 2);
  // However few bins an invocation takes, a plane's rows must fit one dispatch.
  const std::int64_t plane_bins =
      std::min(binding_bins, std::int64_t{limits.group_count[0]} * workgroup);
  const std::int64_t rows =
      std::min<std::int64_t>(plane_bins / lattice.x_mm.count, lattice.y_mm.count);
  if (rows == 0) {
    throw Error(Fault::input, fmt::format("bins x = {}: device '{}' takes at most {}; use fewer",
                                          lattice.x_mm.count, context.name(), plane_bins));
  }
  const std::int64_t thetas =
      rows < lattice.y_mm.count
          ? 1
          : std::min({binding_bins / lattice.plane(),
                      std::int64_t{std::min(limits.group_count[1], limits.group_count[2])},
                      std::int64_t{lattice.theta_rad.count}});
  std::vector<Slab> slabs;
  for (std::int64_t theta = 0; theta < lattice.theta_rad.count; theta += thetas) {
    for (std::int64_t row = 0; row < lattice.y_mm.count; row += rows) {
      Slab slab;
      slab.theta_first = static_cast<std::uint32_t>(theta);
      slab.theta_count =
          static_cast<std::uint32_t>(std::min(thetas, lattice.theta_rad.count - theta));
      slab.row_first = static_cast<std::uint32_t>(row);
      slab.row_count = static_cast<std::uint32_t>(std::min(rows, lattice.y_mm.count - row));
      slab.nx = static_cast<std::uint32_t>(lattice.x_mm.count);
      // Reductions read two bins a texel, so an odd number takes room for one more.
      slab.log_likelihood =
          gpu::Buffer(context, (slab.bins() + 1) / 2 * 2 * sizeof(TwoFloat), gpu::Memory::device,
                      fmt::format("{} pose bins", slab.bins()), VK_FORMAT_R32G32B32A32_SFLOAT);
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

std::uint32_t groups_of(std::uint32_t count, std::uint32_t per_group) {
  return (count + per_group - 1) / per_group;
}

/// Index in the lattice of a slab's bin.
std::int64_t lattice_index(const PoseLattice& lattice, const Slab& slab, std::int64_t in_slab) {
  return (slab.theta_first + in_slab / slab.plane()) * lattice.plane() +
         std::int64_t{slab.row_first} * slab.nx + in_slab % slab.plane();
}

gpu::Kernel marginal_kernel(gpu::Context& context, const PoseLattice& lattice) {
  const std::uint32_t even_planes[] = {lattice.x_mm.count % 2 == 0 ? 1U : 0U};
  return {context,
          {.name = "sum_marginals",
           .spirv = shaders::sum_marginals,
           .bindings = marginal_bindings,
           .push_bytes = sizeof(shaders::MarginalPush),
           .constants = even_planes}};
}

/// Adds every row of `parts` to `sums`.
void add_rows(std::span<const float> parts, std::span<double> sums) {
  for (; !parts.empty(); parts = parts.subspan(sums.size())) {
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] += parts[i];
    }
  }
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
                        .bindings = read_and_write,
                        .push_bytes = sizeof(shaders::ReducePush),
                        .constants = workgroup_constant}),
      sum_marginals_(marginal_kernel(context, lattice)),
      add_(context, {.name = "add_belief",
                     .spirv = shaders::add_belief,
                     .bindings = read_and_write,
                     .push_bytes = sizeof(shaders::AddPush),
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

void Belief::add(const Belief& other) {
  for (std::size_t object = 0; object < slabs_.size(); ++object) {
    for (std::size_t i = 0; i < slabs_[object].size(); ++i) {
      const Slab& slab = slabs_[object][i];
      // A plane of a slab fits one row of workgroups.
      const shaders::AddPush push{.bins = static_cast<shaders::uint>(slab.bins()),
                                  .row = slab.plane()};
      stream_.dispatch(add_, {&other.slabs_[object][i].log_likelihood, &slab.log_likelihood}, push,
                       {groups_of(slab.plane(), workgroup), slab.theta_count, 1});
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
      stream_.dispatch(reduce_, {&slab.log_likelihood, &partials_}, push, {groups, 1, 1});
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

BeliefMarginals Belief::marginals(std::size_t object, TwoFloat max) const {
  BeliefMarginals sums;
  sums.xy.resize(static_cast<std::size_t>(lattice_.plane()));
  sums.theta.resize(static_cast<std::size_t>(lattice_.theta_rad.count));
  for (const Slab& slab : slabs_[object]) {
    const std::uint32_t chunks = groups_of(slab.theta_count, shaders::MARGINAL_THETAS);
    const std::uint32_t blocks = groups_of(slab.plane(), shaders::MARGINAL_PLANE);
    std::vector<float> over_theta(std::size_t{chunks} * slab.plane());
    std::vector<float> over_plane(std::size_t{blocks} * slab.theta_count);
    const gpu::Buffer theta_parts(context_, std::span(over_theta).size_bytes(), gpu::Memory::device,
                                  "a marginal");
    const gpu::Buffer plane_parts(context_, std::span(over_plane).size_bytes(), gpu::Memory::device,
                                  "a marginal");
    const shaders::MarginalPush push{.plane = slab.plane(),
                                     .thetas = slab.theta_count,
                                     .max_high = max.high,
                                     .max_low = max.low};
    stream_.dispatch(sum_marginals_, {&slab.log_likelihood, &theta_parts, &plane_parts}, push,
                     {blocks, chunks, 1});
    stream_.download(theta_parts, std::span(over_theta));
    stream_.download(plane_parts, std::span(over_plane));
    stream_.run();

    add_rows(over_theta,
             std::span(sums.xy).subspan(std::size_t{slab.row_first} * slab.nx, slab.plane()));
    add_rows(over_plane, std::span(sums.theta).subspan(slab.theta_first, slab.theta_count));
  }
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

std::vector<double> Belief::download(std::size_t object, const BinWindow& window) const {
  const int thetas = lattice_.theta_rad.count;
  const auto nx = static_cast<std::size_t>(lattice_.x_mm.count);
  const int row_end = window.row_first + window.row_count;
  // Whole rows: they are contiguous.
  std::vector<TwoFloat> raw(static_cast<std::size_t>(window.theta_count) * window.row_count * nx);
  for (int t = 0; t < window.theta_count; ++t) {
    const int theta = ((window.theta_first + t) % thetas + thetas) % thetas;
    for (const Slab& slab : slabs_[object]) {
      const int slab_theta = theta - static_cast<int>(slab.theta_first);
      const int slab_row = static_cast<int>(slab.row_first);
      const int slab_end = slab_row + static_cast<int>(slab.row_count);
      const int begin = std::max(window.row_first, slab_row);
      const int end = std::min(row_end, slab_end);
      if (slab_theta < 0 || slab_theta >= static_cast<int>(slab.theta_count) || begin >= end) {
        continue;
      }
      const std::size_t row_in_slab =
          static_cast<std::size_t>(slab_theta) * slab.row_count + (begin - slab_row);
      const std::size_t row_in_raw =
          static_cast<std::size_t>(t) * window.row_count + (begin - window.row_first);
      stream_.download(slab.log_likelihood,
                       std::span(raw).subspan(row_in_raw * nx, (end - begin) * nx),
                       row_in_slab * nx * sizeof(TwoFloat));
    }
  }
  stream_.run();
  std::vector<double> values;
  values.reserve(window.bins());
  for (std::size_t row = 0; row < raw.size(); row += nx) {
    for (int i = 0; i < window.column_count; ++i) {
      values.push_back(raw[row + window.column_first + i].value());
    }
  }
  return values;
}

}  // namespace palpate
