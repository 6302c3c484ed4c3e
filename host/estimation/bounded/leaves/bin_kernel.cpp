// Highway compiles this file once for every set of vector instructions. Products and sums are never
// fused and lanes never mixed, so that every set gives the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "estimation/bounded/leaves/bin_kernel.cpp"
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <type_traits>

#include "estimation/bounded/leaves/bin_kernel-inl.hpp"
#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "model/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

template <class D>
void place(D d, const double* xy_mm, double cos_by_cell, double sin_by_cell, double reach,
           double rounder, double* x, double* y) {
  hn::Vec<D> px;
  hn::Vec<D> py;
  hn::LoadInterleaved2(d, xy_mm, px, py);
  const auto c = hn::Set(d, cos_by_cell);
  const auto s = hn::Set(d, sin_by_cell);
  const auto limit = hn::Set(d, reach);
  const auto round = hn::Set(d, rounder);
  const auto rounded = [&](auto v) HWY_ATTR {
    const auto clamped = hn::Max(hn::Neg(limit), hn::Min(v, limit));
    return hn::Sub(hn::Add(clamped, round), round);
  };
  hn::StoreU(rounded(hn::Sub(hn::Mul(c, px), hn::Mul(s, py))), d, x);
  hn::StoreU(rounded(hn::Add(hn::Mul(s, px), hn::Mul(c, py))), d, y);
}

void PlaceElements(const double* xy_mm, std::size_t count, double cos_by_cell, double sin_by_cell,
                   double reach, double rounder, double* x, double* y) {
  const hn::ScalableTag<double> d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t e = 0;
  for (; e + lanes <= count; e += lanes) {
    place(d, xy_mm + 2 * e, cos_by_cell, sin_by_cell, reach, rounder, x + e, y + e);
  }
  if (e < count) {
    double rest[2 * most_lanes] = {};
    std::copy(xy_mm + 2 * e, xy_mm + 2 * count, rest);
    place(d, rest, cos_by_cell, sin_by_cell, reach, rounder, x + e, y + e);
  }
}

/// Finds each element's patch. The index is clamped so that elements beyond the map see a patch of
/// the border, whose nodes are all equal.
void find_patches(const BinBlock& block, const MapPatches& map, const PlacedElements& placed,
                  ElementPatches& found) {
  const hn::ScalableTag<double> d;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const auto first_x = hn::Set(d, block.x);
  const auto first_y = hn::Set(d, block.y);
  const auto last_x = hn::Set(d, static_cast<double>(map.width() - MapPatches::side));
  const auto last_y = hn::Set(d, static_cast<double>(map.height() - MapPatches::side));
  const auto width = hn::Set(d, static_cast<double>(map.width()));
  const auto border = hn::Set(d, static_cast<double>(MapPatches::border));
  for (std::size_t e = 0; e < found.patch.size(); e += hn::Lanes(d)) {
    const auto x = hn::Add(hn::LoadU(d, placed.x.data() + e), first_x);
    const auto y = hn::Add(hn::LoadU(d, placed.y.data() + e), first_y);
    const auto whole_x = hn::Floor(x);
    const auto whole_y = hn::Floor(y);
    hn::StoreU(hn::Sub(x, whole_x), d, found.x.data() + e);
    hn::StoreU(hn::Sub(y, whole_y), d, found.y.data() + e);
    const auto column = hn::Max(hn::Zero(d), hn::Min(whole_x, last_x));
    const auto row = hn::Max(hn::Zero(d), hn::Min(whole_y, last_y));
    const auto patch = hn::Add(hn::Mul(row, width), column);
    const auto x_off = hn::Or(hn::Lt(column, border), hn::Gt(column, hn::Sub(last_x, border)));
    const auto y_off = hn::Or(hn::Lt(row, border), hn::Gt(row, hn::Sub(last_y, border)));
    const auto flipped = hn::Sub(hn::Set(d, -1.0), patch);
    const auto marked = hn::IfThenElse(hn::Or(x_off, y_off), flipped, patch);
    hn::StoreU(hn::DemoteTo(di, marked), di, found.patch.data() + e);
  }
}

/// The bins of one vector, by the model's form.
/// @param log_odds_at (element): in every lane
template <class D, class LogOddsAt>
void evaluate_vector(D d, const LogOddsAt& log_odds_at, const BinTask& task,
                     double* log_likelihood) {
  const ReadingForm& form = task.form;
  if (form.kind == ReadingForm::Kind::products) {
    multiply_elements(d, log_odds_at, task.runs, form, log_likelihood);
  } else if (form.kind == ReadingForm::Kind::table) {
    const auto row = [&](Reading reading)
                         HWY_ATTR { return TableRow(d, form, task.object, reading); };
    add_elements(d, log_odds_at, task.runs, row, log_likelihood);
  } else {
    const auto logs = [&](Reading reading) HWY_ATTR { return LogisticFloor(d, form, reading); };
    add_elements(d, log_odds_at, task.runs, logs, log_likelihood);
  }
}

/// Fills vectors with the bins of as many blocks as fit wholly, or with a part of one block's.
/// @param patches [block] memory
void EvaluateBins(const BinTask& task, std::vector<ElementPatches>& patches) {
  const BinList& bins = task.bins;
  const std::vector<BinBlock>& blocks = bins.blocks;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    find_patches(blocks[i], task.map, task.placed, patches[i]);
  }
  using D = hn::ScalableTag<double>;
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN double x_offset[most_lanes] = {};
  HWY_ALIGN double y_offset[most_lanes] = {};
  HWY_ALIGN double out[most_lanes] = {};
  LanesOfBlock<D> parts[most_lanes];
  std::size_t block = 0;
  for (std::size_t first = 0, end = 0; first < bins.bins(); first = end) {
    std::size_t count = 0;  // of parts: blocks in this vector
    for (end = first; block < blocks.size() && (count == 0 || blocks[block].end <= first + lanes);
         ++block) {
      // All lanes from here on: the next block takes its own.
      const std::size_t before = end - first;
      parts[count++] = {&patches[block], hn::Not(hn::FirstN(d, before)),
                        hn::Not(hn::FirstN(hn::Rebind<float, D>(), before))};
      end = std::min(blocks[block].end, first + lanes);
      if (end < blocks[block].end) {
        break;
      }
    }
    std::copy(bins.x_offset.begin() + first, bins.x_offset.begin() + end, x_offset);
    std::copy(bins.y_offset.begin() + first, bins.y_offset.begin() + end, y_offset);
    const auto x = hn::Load(d, x_offset);
    const auto y = hn::Load(d, y_offset);
    const auto fill = [&](auto of_parts) HWY_ATTR {
      evaluate_vector(
          d,
          [&](std::size_t e) HWY_ATTR { return log_odds(d, task.map, parts, of_parts, e, x, y); },
          task, out);
    };
    if (count == 1) {
      fill(std::integral_constant<std::size_t, 1>());
    } else {
      fill(count);
    }
    for (std::size_t i = first; i < end; ++i) {
      *bins.result[i] = out[i - first];
    }
  }
}

std::int64_t Target() { return HWY_TARGET; }

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <cmath>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

HWY_EXPORT(PlaceElements);
HWY_EXPORT(EvaluateBins);
HWY_EXPORT(Target);

namespace {

/// Below it powers of two would have to be taken out every 33 elements or oftener.
constexpr double least_ratio = 0x1p-30;
/// Stands for log 0: below all log odds.
constexpr double log_zero = -1e38;

}  // namespace

MapPatches::MapPatches(const OccupancyGrid& map, double prior)
    : width_(0), height_(0), prior_log_odds_(log_odds_from_probability(prior)) {
  // Kernels hold the index of a node in 32 bits.
  const std::int64_t width = std::int64_t{map.nx} + 2 * border;
  const std::int64_t height = std::int64_t{map.ny} + 2 * border;
  if (width * height > std::numeric_limits<std::int32_t>::max()) {
    throw Error(Fault::input, fmt::format("map \"{}\": {} x {} cells and a border are too many for "
                                          "`filter bounded`; use larger cells",
                                          map.label, map.nx, map.ny));
  }
  width_ = static_cast<int>(width);
  height_ = static_cast<int>(height);
  const auto node = [&](std::int64_t column, std::int64_t row) {
    const std::int64_t i = column - border;
    const std::int64_t j = row - border;
    return i >= 0 && i < map.nx && j >= 0 && j < map.ny
               ? map.at(static_cast<int>(i), static_cast<int>(j))
               : marker;
  };
  // A vector of 16 floats may start as far as one column and one row into the last patch.
  constexpr std::size_t beyond = side * side;
  nodes_.reserve(static_cast<std::size_t>(width * height) * side + beyond);
  for (std::int64_t y = 0; y < height; ++y) {
    for (std::int64_t x = 0; x < width; ++x) {
      for (int row = 0; row < side; ++row) {
        nodes_.push_back(node(x, y + row));
      }
    }
  }
  nodes_.resize(nodes_.size() + beyond, marker);
}

ReadingForm::ReadingForm(const ContactModel& contact) {
  if (contact.table) {
    kind = Kind::table;
    table = *contact.table;
    nodes_per_nat = palpate::nodes_per_nat(table);
    return;
  }
  const double floor = contact.gamma * contact.prior.value();
  const double scale = floor + (1.0 - contact.gamma);
  log_scale = std::log(scale);
  ratio = floor / scale;
  if (ratio >= least_ratio) {
    log_ratio = std::log(ratio);
    // Numerators, in [ratio, 2], and denominators, in [1, 2], that a product takes before it could
    // leave 2^+-1000. Each starts within [1, 2).
    interval = static_cast<int>(std::min(64.0, 999.0 / std::max(1.0, -std::log2(ratio))));
    return;
  }
  kind = Kind::logs;
  log_ratio = contact.gamma > 0.0
                  ? std::log(contact.gamma) + std::log(contact.prior.value()) - log_scale
                  : log_zero;
}

// Places within a patch are below 4 cells: they are exact in 53 bits.
PositionGrid::PositionGrid(double reach_cells)
    : step_(std::max(0x1p-51, std::exp2(std::ceil(std::log2(2.0 * reach_cells)) - 51.0))) {}

void place_elements(std::span<const glm::dvec2> from_pivot_mm, double theta_rad, double cell_mm,
                    double reach_cells, const PositionGrid& grid, PlacedElements& placed) {
  placed.x.assign(padded(from_pivot_mm.size()), 0.0);
  placed.y.assign(padded(from_pivot_mm.size()), 0.0);
  if (!from_pivot_mm.empty()) {
    HWY_DYNAMIC_DISPATCH(PlaceElements)
    (&from_pivot_mm.front().x, from_pivot_mm.size(), std::cos(theta_rad) / cell_mm,
     std::sin(theta_rad) / cell_mm, reach_cells, grid.rounder(), placed.x.data(), placed.y.data());
  }
}

void evaluate_bins(const BinTask& task, std::vector<ElementPatches>& scratch) {
  const std::size_t elements = task.placed.x.size();
  scratch.resize(std::max(scratch.size(), task.bins.blocks.size()));
  for (ElementPatches& patches : scratch) {
    patches.patch.resize(elements);
    patches.x.resize(elements);
    patches.y.resize(elements);
  }
  HWY_DYNAMIC_DISPATCH(EvaluateBins)(task, scratch);
}

std::string vector_instructions() { return hwy::TargetName(HWY_DYNAMIC_DISPATCH(Target)()); }

}  // namespace palpate

#endif  // HWY_ONCE
