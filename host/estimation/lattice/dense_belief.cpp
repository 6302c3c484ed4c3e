#include "estimation/lattice/dense_belief.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "shaders/interface.h"
#include "shaders/reduce_belief.hpp"

namespace palpate {

namespace {

using gpu::Access;

constexpr float least = -std::numeric_limits<float>::infinity();

/// Index in the lattice of a slab's bin.
std::int64_t lattice_index(const PoseLattice& lattice, const Slab& slab, std::int64_t in_slab) {
  return (slab.theta_first + in_slab / slab.plane()) * lattice.plane() +
         std::int64_t{slab.row_first} * slab.nx + in_slab % slab.plane();
}

ReductionSizes sizes_for(const gpu::Context& context, const PoseLattice& lattice,
                         std::size_t objects) {
  return reduction_sizes(context.limits(), lattice.bins() * static_cast<std::int64_t>(objects));
}

/// Partial results of reducing a slab.
std::size_t partials_of(const SlabExtent& slab, const ReductionSizes& sizes) {
  return std::size_t{slab.object_count} * groups_of(slab.bins(), sizes.bins());
}

/// Visits a block's bins as boxes: whole rows of a plane, or a part of a row.
/// @param log_likelihood of each bin, or one number that stands for all
void visit_boxes(const Slab& slab, std::size_t object, const BeliefBlock& block,
                 std::span<const double> log_likelihood, const BinVisitor& visitor) {
  const bool alike = log_likelihood.size() == 1;
  const std::int64_t end = block.first + block.bins;
  for (std::int64_t first = block.first; first < end;) {
    const auto left = static_cast<std::size_t>(end - first);
    const auto in_plane = static_cast<std::uint32_t>(first % slab.plane());
    const std::uint32_t row = in_plane / slab.nx;
    const std::uint32_t x = in_plane % slab.nx;
    const std::size_t rows = left / slab.nx;
    const bool whole_rows = x == 0 && rows > 0;
    const BinBox box{.object = static_cast<std::int32_t>(object),
                     .theta = static_cast<std::int32_t>(slab.theta_first + first / slab.plane()),
                     .y_first = static_cast<std::int32_t>(slab.row_first + row),
                     .y_count = static_cast<std::int32_t>(
                         whole_rows ? std::min<std::size_t>(rows, slab.row_count - row) : 1),
                     .x_first = static_cast<std::int32_t>(x),
                     .x_count = static_cast<std::int32_t>(
                         whole_rows ? slab.nx : std::min<std::size_t>(slab.nx - x, left))};
    visitor(box, alike ? log_likelihood
                       : log_likelihood.subspan(static_cast<std::size_t>(first - block.first),
                                                static_cast<std::size_t>(box.bins())));
    first += box.bins();
  }
}

}  // namespace

DenseBelief::DenseBelief(gpu::Context& context, gpu::CommandStream& stream,
                         const PoseLattice& lattice, std::size_t objects)
    : context_(context),
      stream_(stream),
      lattice_(lattice),
      objects_(objects),
      reduction_(sizes_for(context, lattice, objects)),
      reduce_(context, {.name = "reduce_belief",
                        .spirv = shaders::reduce_belief,
                        .bindings = {Access::table, Access::storage},
                        .push_bytes = sizeof(shaders::ReducePush),
                        .constants = {reduction_.lanes, reduction_.side_by_side,
                                      reduction_.texels_per_lane}}) {
  for (const SlabExtent& extent : cut(context, lattice, objects)) {
    slabs_.push_back(
        {extent, gpu::Buffer(context, extent.bytes(), gpu::Memory::device,
                             fmt::format("{} x {} pose bins", extent.object_count, extent.bins()),
                             VK_FORMAT_R32G32B32A32_SFLOAT)});
    partial_count_ += partials_of(extent, reduction_);
  }
  partials_ = gpu::Buffer(context, partial_count_ * sizeof(shaders::Partial), gpu::Memory::device,
                          "partial sums");
  clear();
}

std::vector<SlabExtent> DenseBelief::cut(const gpu::Context& context, const PoseLattice& lattice,
                                         std::size_t objects) {
  return cut_into_slabs(context, lattice, objects, sizes_for(context, lattice, objects).bins());
}

void DenseBelief::clear() const {
  for (const Slab& slab : slabs_) {
    stream_.fill(slab.log_likelihood, 0);
  }
}

std::uint64_t DenseBelief::device_bytes() const {
  std::uint64_t bytes = partials_.bytes();
  for (const Slab& slab : slabs_) {
    bytes += slab.log_likelihood.bytes();
  }
  return bytes;
}

std::vector<BeliefSummary> DenseBelief::summarise(std::vector<BeliefSummary> reuse) const {
  std::uint32_t first = 0;
  for (const Slab& slab : slabs_) {
    const shaders::ReducePush push{.bins = static_cast<shaders::uint>(slab.bins()),
                                   .stride = static_cast<shaders::uint>(slab.stride()),
                                   .partial_first = first};
    const std::uint32_t groups = groups_of(slab.bins(), reduction_.bins());
    stream_.dispatch(reduce_, {&slab.log_likelihood, &partials_}, push,
                     {groups, slab.object_count, 1});
    first += static_cast<std::uint32_t>(partials_of(slab, reduction_));
  }
  read_partials_.resize(partial_count_);
  stream_.download(partials_, read_partials_);
  stream_.run();

  std::vector<BeliefSummary> summaries = std::move(reuse);
  summaries.resize(objects_);
  for (BeliefSummary& summary : summaries) {
    summary.blocks.clear();
    summary = {.max = {least, 0.0F}, .blocks = std::move(summary.blocks)};
  }
  const auto for_each_partial = [&](const auto& take) {
    const shaders::Partial* partial = read_partials_.data();
    for (const Slab& slab : slabs_) {
      for (std::uint32_t i = 0; i < slab.object_count; ++i) {
        for (std::uint32_t g = groups_of(slab.bins(), reduction_.bins()); g > 0; --g, ++partial) {
          take(summaries[slab.object_first + i], slab, *partial,
               TwoFloat{partial->max_high, partial->max_low});
        }
      }
    }
  };
  // An object's slabs stand in the lattice's order, so the first of equals has the lowest bin.
  for_each_partial([&](BeliefSummary& summary, const Slab& slab, const shaders::Partial& partial,
                       const TwoFloat& max) {
    if (max.value() > summary.max.value()) {
      summary.max = max;
      summary.arg_max = lattice_index(lattice_, slab, partial.arg_max);
    }
  });
  for_each_partial([&](BeliefSummary& summary, const Slab& slab, const shaders::Partial& partial,
                       const TwoFloat& max) {
    const double sum = partial.sum * std::exp(max.value() - summary.max.value());
    summary.sum += sum;
    const auto at = static_cast<std::size_t>(&slab - slabs_.data());
    const bool same_slab = !summary.blocks.empty() && summary.blocks.back().slab == at;
    const std::int64_t begin =
        same_slab ? summary.blocks.back().first + summary.blocks.back().bins : 0;
    summary.blocks.push_back(
        {at, begin, std::min<std::int64_t>(reduction_.bins(), slab.bins() - begin), sum});
  });
  return summaries;
}

void DenseBelief::visit(std::size_t object, const BeliefSummary& summary, const BlockChoice& choice,
                        const BinVisitor& visitor) const {
  constexpr std::size_t most_bins = std::size_t{1} << 20;                  // read at once
  std::vector<std::pair<const BeliefBlock*, std::vector<TwoFloat>>> read;  // no bins: not read
  std::vector<double> log_likelihood;
  const auto visit_read = [&] {
    stream_.run();
    for (const auto& [block, bins] : read) {
      log_likelihood.clear();
      std::ranges::transform(bins, std::back_inserter(log_likelihood), &TwoFloat::value);
      if (bins.empty()) {
        const double mean = block->sum / static_cast<double>(block->bins);
        log_likelihood.push_back(summary.max.value() + std::log(mean));
      }
      visit_boxes(slabs_[block->slab], object, *block, log_likelihood, visitor);
    }
    read.clear();
  };
  for (const BeliefBlock& block : summary.blocks) {
    if (block.sum < choice.least_share * summary.sum) {
      continue;
    }
    read.emplace_back(&block, std::vector<TwoFloat>());
    if (!choice.reads || choice.reads(object, block.sum / summary.sum)) {
      const Slab& slab = slabs_[block.slab];
      read.back().second.resize(static_cast<std::size_t>(block.bins));
      stream_.download(slab.log_likelihood, read.back().second,
                       (slab.first_bin(object) + block.first) * sizeof(TwoFloat));
    }
    if (read.size() * reduction_.bins() >= most_bins) {
      visit_read();
    }
  }
  visit_read();
}

std::vector<double> DenseBelief::download(std::span<const BinBox> boxes) const {
  const auto nx = static_cast<std::size_t>(lattice_.x_mm.count);
  std::size_t rows = 0;
  for (const BinBox& box : boxes) {
    rows += static_cast<std::size_t>(box.y_count);
  }
  std::vector<TwoFloat> raw(rows * nx);  // whole rows: they are contiguous
  std::size_t row_in_raw = 0;
  for (const BinBox& box : boxes) {
    for (const Slab& slab : slabs_) {
      const int slab_theta = box.theta - static_cast<int>(slab.theta_first);
      const int slab_row = static_cast<int>(slab.row_first);
      const int slab_end = slab_row + static_cast<int>(slab.row_count);
      const int begin = std::max(box.y_first, slab_row);
      const int end = std::min(box.y_first + box.y_count, slab_end);
      const auto object = static_cast<std::size_t>(box.object);
      if (!slab.holds(object) || slab_theta < 0 ||
          slab_theta >= static_cast<int>(slab.theta_count) || begin >= end) {
        continue;
      }
      const std::size_t row_in_slab =
          static_cast<std::size_t>(slab_theta) * slab.row_count + (begin - slab_row);
      stream_.download(
          slab.log_likelihood,
          std::span(raw).subspan((row_in_raw + (begin - box.y_first)) * nx, (end - begin) * nx),
          (slab.first_bin(object) + row_in_slab * nx) * sizeof(TwoFloat));
    }
    row_in_raw += static_cast<std::size_t>(box.y_count);
  }
  stream_.run();
  std::vector<double> values;
  const TwoFloat* row = raw.data();
  for (const BinBox& box : boxes) {
    for (int i = 0; i < box.y_count; ++i, row += nx) {
      const TwoFloat* const first = row + box.x_first;
      std::transform(first, first + box.x_count, std::back_inserter(values),
                     [](const TwoFloat& nats) { return nats.value(); });
    }
  }
  return values;
}

}  // namespace palpate
