#include "estimation/lattice/dense_belief.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "shaders/interface.h"
#include "shaders/reduce_belief.hpp"
#include "shaders/sum_marginals.hpp"

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

/// Adds every row of `parts` to `sums`.
void add_rows(std::span<const float> parts, std::span<double> sums) {
  for (; !parts.empty(); parts = parts.subspan(sums.size())) {
    for (std::size_t i = 0; i < sums.size(); ++i) {
      sums[i] += parts[i];
    }
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
      marginal_(marginal_sizes(context.limits(), lattice.plane(), lattice.theta_rad.count)),
      reduce_(context, {.name = "reduce_belief",
                        .spirv = shaders::reduce_belief,
                        .bindings = {Access::table, Access::storage},
                        .push_bytes = sizeof(shaders::ReducePush),
                        .constants = {reduction_.lanes, reduction_.side_by_side,
                                      reduction_.texels_per_lane}}),
      sum_marginals_(
          context, {.name = "sum_marginals",
                    .spirv = shaders::sum_marginals,
                    .bindings = {Access::table, Access::storage, Access::storage},
                    .push_bytes = sizeof(shaders::MarginalPush),
                    .constants = {marginal_.lanes, marginal_.side_by_side, marginal_.pairs_per_lane,
                                  marginal_.thetas, lattice.x_mm.count % 2 == 0 ? 1U : 0U}}) {
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

template <typename Wanted, typename Visit>
void DenseBelief::read_blocks(std::size_t object, const BeliefSummary& summary,
                              const Wanted& wanted, const Visit& visit) const {
  constexpr std::size_t most_bins = std::size_t{1} << 20;  // read at once
  std::vector<std::pair<const BeliefBlock*, std::vector<TwoFloat>>> read;
  const auto take_in = [&] {
    stream_.run();
    for (const auto& [block, bins] : read) {
      visit(*block, bins);
    }
    read.clear();
  };
  for (const BeliefBlock& block : summary.blocks) {
    if (!wanted(block)) {
      continue;
    }
    const Slab& slab = slabs_[block.slab];
    read.emplace_back(&block, std::vector<TwoFloat>(block.bins));
    stream_.download(slab.log_likelihood, read.back().second,
                     (slab.first_bin(object) + block.first) * sizeof(TwoFloat));
    if (read.size() * reduction_.bins() >= most_bins) {
      take_in();
    }
  }
  take_in();
}

std::vector<std::int64_t> DenseBelief::bins_at(std::size_t object, const BeliefSummary& summary,
                                               std::span<const double> parts) const {
  /// A block with some of the parts in it.
  struct Hit {
    const BeliefBlock* block;
    double before;          ///< summed probability before the block
    std::size_t parts_end;  ///< in `parts`
  };
  std::vector<Hit> hits;
  auto block = summary.blocks.begin();
  double before = 0.0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    while (block + 1 != summary.blocks.end() && before + block->sum <= parts[i] * summary.sum) {
      before += block->sum;
      ++block;
    }
    if (hits.empty() || hits.back().block != &*block) {
      hits.push_back({&*block, before, i});
    }
    hits.back().parts_end = i + 1;
  }
  std::vector<std::int64_t> found;
  auto wanted = hits.begin();
  auto hit = hits.begin();
  read_blocks(
      object, summary,
      [&](const BeliefBlock& next) {
        const bool is_hit = wanted != hits.end() && wanted->block == &next;
        wanted += is_hit ? 1 : 0;
        return is_hit;
      },
      [&](const BeliefBlock& from, std::span<const TwoFloat> bins) {
        std::size_t bin = 0;
        const auto mass = [&] { return std::exp(bins[bin].value() - summary.max.value()); };
        double reached = hit->before + mass();  // up to and with `bin`
        while (found.size() < hit->parts_end) {
          // Rounding must not lead past the block's last bin.
          while (bin + 1 < bins.size() && reached <= parts[found.size()] * summary.sum) {
            ++bin;
            reached += mass();
          }
          found.push_back(lattice_index(lattice_, slabs_[from.slab],
                                        from.first + static_cast<std::int64_t>(bin)));
        }
        ++hit;
      });
  return found;
}

double DenseBelief::entropy(std::size_t object, const BeliefSummary& summary) const {
  constexpr double negligible = 1e-5;  // nats, of all blocks left out together
  double below_max = 0.0;              // mean of max - log-likelihood
  const auto counts = [&](const BeliefBlock& block) {
    // The largest that n bins of a summed probability p can add: p log(n / p).
    const double p = block.sum / summary.sum;
    const double most = p * (std::log(static_cast<double>(block.bins)) - std::log(p));
    return most > negligible / static_cast<double>(summary.blocks.size());
  };
  read_blocks(object, summary, counts,
              [&](const BeliefBlock& /*block*/, std::span<const TwoFloat> bins) {
                for (const TwoFloat& bin : bins) {
                  const double below = summary.max.value() - bin.value();
                  below_max += std::exp(-below) / summary.sum * below;
                }
              });
  return below_max + std::log(summary.sum);
}

std::vector<BinShare> DenseBelief::likely_bins(std::size_t object, const BeliefSummary& summary,
                                               double least_share) const {
  std::vector<BinShare> likely;
  const auto may_hold = [&](const BeliefBlock& block) {
    constexpr double rounding = 1e-5;  // of the block's sum
    return block.sum * (1.0 + rounding) >= least_share * summary.sum;
  };
  read_blocks(
      object, summary, may_hold, [&](const BeliefBlock& block, std::span<const TwoFloat> bins) {
        for (std::size_t i = 0; i < bins.size(); ++i) {
          const double share = std::exp(bins[i].value() - summary.max.value()) / summary.sum;
          if (share >= least_share) {
            likely.push_back({lattice_index(lattice_, slabs_[block.slab],
                                            block.first + static_cast<std::int64_t>(i)),
                              share});
          }
        }
      });
  return likely;
}

Marginals DenseBelief::marginals(std::size_t object, TwoFloat max, double of_largest) const {
  Marginals sums{.grid = lattice_, .xy = {}, .theta = {}};
  sums.xy.resize(static_cast<std::size_t>(lattice_.plane()));
  sums.theta.resize(static_cast<std::size_t>(lattice_.theta_rad.count));
  for (const Slab& slab : slabs_) {
    if (!slab.holds(object)) {
      continue;
    }
    const std::uint32_t chunks = groups_of(slab.theta_count, marginal_.thetas);
    const std::uint32_t blocks = groups_of(slab.plane(), marginal_.plane());
    std::vector<float> over_theta(std::size_t{chunks} * slab.plane());
    std::vector<float> over_plane(std::size_t{blocks} * slab.theta_count);
    const gpu::Buffer theta_parts(context_, std::span(over_theta).size_bytes(), gpu::Memory::device,
                                  "a marginal");
    const gpu::Buffer plane_parts(context_, std::span(over_plane).size_bytes(), gpu::Memory::device,
                                  "a marginal");
    const shaders::MarginalPush push{
        .plane = slab.plane(),
        .thetas = slab.theta_count,
        .first_bin = static_cast<shaders::uint>(slab.first_bin(object)),
        .max_high = max.high,
        .max_low = max.low};
    stream_.dispatch(sum_marginals_, {&slab.log_likelihood, &theta_parts, &plane_parts}, push,
                     {blocks, chunks, 1});
    stream_.download(theta_parts, over_theta);
    stream_.download(plane_parts, over_plane);
    stream_.run();

    add_rows(over_theta,
             std::span(sums.xy).subspan(std::size_t{slab.row_first} * slab.nx, slab.plane()));
    add_rows(over_plane, std::span(sums.theta).subspan(slab.theta_first, slab.theta_count));
  }
  for (std::vector<double>* marginal : {&sums.xy, &sums.theta}) {
    for (double& sum : *marginal) {
      sum *= of_largest;
    }
  }
  return sums;
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
