#include "estimation/bounded/leaves/bin_likelihood.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <tuple>

#include "estimation/bounded/displaced/undisplaced_bins.hpp"
#include "estimation/parallel_for.hpp"
#include "model/extremes.hpp"

namespace palpate {

namespace {

/// Most bins along an axis of a block, and most cells of a map that they span: an element then sees
/// the 4 x 4 nodes of one patch.
constexpr int most_block_bins = 16;
constexpr double most_block_cells = 2.0;
/// Blocks that are evaluated together, to fill vectors.
constexpr std::size_t blocks_together = 16;
/// Bins of a thread's task: large beside the cost of a task, small beside many boxes.
constexpr std::size_t task_bins = 1024;

/// Positions along one axis of neighbouring bins: on the grid, and as offsets from the first.
struct AxisRun {
  double first = 0.0;
  int count = 0;
  std::array<double, most_block_bins> offset{};

  /// Takes as many bins from `begin` on as a block may span, at most `limit`.
  AxisRun(const Axis& axis_mm, int begin, int limit, double origin_mm, const PlacedMap& map) {
    const auto at = [&](int bin) {
      const double cells = (axis_mm.centre(bin) - origin_mm) / map.cell_mm + MapPatches::border;
      return map.grid.rounded(cells);
    };
    first = at(begin);
    for (; count < std::min(limit, most_block_bins); ++count) {
      const double cells = at(begin + count) - first;
      if (cells > most_block_cells) {
        break;
      }
      offset[count] = cells;
    }
  }
};

constexpr int side = BlockRun::side;

/// The blocks of 4 x 4 bins that boxes of one object lie in, and sums for all of their bins.
class BlockSums {
 public:
  explicit BlockSums(std::span<const BinBox> boxes) {
    std::vector<std::tuple<int, int, int>> blocks;
    for (const BinBox& box : boxes) {
      for (int y = box.y_first / side; side * y < box.y_first + box.y_count; ++y) {
        for (int x = box.x_first / side; side * x < box.x_first + box.x_count; ++x) {
          blocks.emplace_back(box.theta, y, x);
        }
      }
    }
    std::ranges::sort(blocks);
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    for (const auto& [theta, y, x] : blocks) {
      const std::size_t runs = runs_.size();
      append_block(theta, y, x, runs_);
      if (runs_.size() > runs) {
        first_.push_back(log_likelihood_.size());
      }
      log_likelihood_.resize(log_likelihood_.size() + BlockRun::places);
    }
  }

  std::span<const BlockRun> runs() const { return runs_; }
  void add(std::span<const double> log_means) {
    std::ranges::transform(log_likelihood_, log_means, log_likelihood_.begin(), std::plus());
  }
  /// Copies the sums of a box's bins, [y, x].
  void copy(const BinBox& box, double* to) const {
    const auto after = [](const BlockRun& run) { return std::tuple(run.theta, run.y, run.x); };
    for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
      // A box's bins of a row lie in one run.
      const auto run = std::ranges::upper_bound(
                           runs_, std::tuple(box.theta, y / side, box.x_first / side), {}, after) -
                       1;
      const std::size_t first = first_[static_cast<std::size_t>(run - runs_.begin())];
      for (int x = box.x_first; x < box.x_first + box.x_count; ++x) {
        const auto block = static_cast<std::size_t>(x / side - run->x);
        const std::size_t bin = first + block * BlockRun::places +
                                static_cast<std::size_t>(side * (y % side) + x % side);
        *to++ = log_likelihood_[bin];
      }
    }
  }

 private:
  std::vector<BlockRun> runs_;
  std::vector<std::size_t> first_;  ///< [run] its first bin's place in what follows
  std::vector<double> log_likelihood_;
};

// Bounds of rounding: every sum, product and quotient has a relative error of at most one unit of
// roundoff, u. Terms of the second order are covered by `second_order`.

constexpr double u = 0x1p-53;
constexpr double second_order = 1.001;

/// Relative error of 2^f. VectorMath's polynomial is within 7.8e-14 of 2^f. Horner's rule adds at
/// most (2 k + 1) u of each term c_k f^k, in all 2.5 u where 2^f is at least 0.7.
constexpr double exp_error = 8e-14 + 4.0 * u;

/// Largest magnitude whose exponential is not clamped, in nats.
constexpr double most_exponent = 709.0;

double farthest(const Axis& axis) { return std::max(std::abs(axis.lower), std::abs(axis.upper)); }

}  // namespace

BinLikelihood::BinLikelihood(std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                             const PoseLattice& lattice, const DisplacementSd& touch_sd)
    : form_(contact), lattice_(lattice) {
  if (!touch_sd.none()) {
    displaced_.emplace(DisplacementWeights(lattice, touch_sd), 1);
  }
  for (const Hypothesis& hypothesis : hypotheses) {
    maps_.emplace_back(hypothesis.compared(), *contact.prior, lattice);
  }
}

void BinLikelihood::evaluate_on_this_thread(std::span<const BinBox> boxes,
                                            const KnownElements& elements,
                                            double* log_likelihood) const {
  PlacedElements placed;
  BinList bins;
  std::vector<ElementPatches> scratch;
  const BinBox* of = nullptr;  // the listed bins' object and theta
  const auto evaluate_list = [&] {
    if (of != nullptr && bins.bins() > 0) {
      const auto object = static_cast<std::size_t>(of->object);
      evaluate_bins({bins, maps_[object].nodes, object, placed, elements.runs, form_}, scratch);
      bins.clear();
    }
  };
  for (const BinBox& box : boxes) {
    const PlacedMap& map = maps_[box.object];
    if (of == nullptr || of->object != box.object || of->theta != box.theta) {
      evaluate_list();
      place_elements(elements.from_pivot_mm, lattice_.theta_rad.centre(box.theta), map.cell_mm,
                     map.reach_cells, map.grid, placed);
    }
    of = &box;
    for (int j = 0; j < box.y_count;) {
      const AxisRun rows(lattice_.y_mm, box.y_first + j, box.y_count - j, map.origin_mm.y, map);
      for (int i = 0; i < box.x_count;) {
        const AxisRun columns(lattice_.x_mm, box.x_first + i, box.x_count - i, map.origin_mm.x,
                              map);
        for (int r = 0; r < rows.count; ++r) {
          for (int c = 0; c < columns.count; ++c) {
            bins.x_offset.push_back(columns.offset[c]);
            bins.y_offset.push_back(rows.offset[r]);
            bins.result.push_back(log_likelihood + std::ptrdiff_t{j + r} * box.x_count + i + c);
          }
        }
        bins.blocks.push_back({columns.first, rows.first, bins.bins()});
        if (bins.blocks.size() == blocks_together) {
          evaluate_list();
        }
        i += columns.count;
      }
      j += rows.count;
    }
    log_likelihood += box.bins();
  }
  evaluate_list();
}

void BinLikelihood::evaluate_undisplaced(std::span<const BinBox> boxes,
                                         const KnownElements& elements,
                                         std::span<double> log_likelihood) const {
  std::vector<BinBox> parts;               // large boxes are cut between rows
  std::vector<std::size_t> first_bin{0};   // [part]
  std::vector<std::size_t> first_part{0};  // [task]
  for (const BinBox& box : boxes) {
    const auto rows = static_cast<std::int32_t>(
        std::clamp<std::int64_t>(std::int64_t{task_bins} / box.x_count, 1, box.y_count));
    for (std::int32_t row = 0; row < box.y_count; row += rows) {
      BinBox& part = parts.emplace_back(box);
      part.y_first += row;
      part.y_count = std::min(rows, box.y_count - row);
      first_bin.push_back(first_bin.back() + static_cast<std::size_t>(part.bins()));
      if (first_bin.back() - first_bin[first_part.back()] >= task_bins) {
        first_part.push_back(parts.size());
      }
    }
  }
  if (first_part.back() < parts.size()) {
    first_part.push_back(parts.size());
  }
  parallel_for(first_part.size() - 1, [&](std::size_t task) {
    const std::size_t first = first_part[task];
    evaluate_on_this_thread(std::span(parts).subspan(first, first_part[task + 1] - first), elements,
                            log_likelihood.data() + first_bin[first]);
  });
}

void BinLikelihood::evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                             std::span<double> log_likelihood) const {
  if (displaced_) {
    evaluate_displaced(boxes, elements, log_likelihood);
  } else {
    evaluate_undisplaced(boxes, elements, log_likelihood);
  }
}

void BinLikelihood::evaluate_blocks(std::size_t object, std::span<const BlockRun> runs,
                                    const KnownElements& touch,
                                    const PlaceRows<double>& rows) const {
  std::vector<BinBox> parts;
  for (const BlockRun& run : runs) {
    parts.push_back({.object = static_cast<std::int32_t>(object),
                     .theta = run.theta,
                     .y_first = side * run.y,
                     .y_count = std::min(side, lattice_.y_mm.count - side * run.y),
                     .x_first = side * run.x,
                     .x_count = std::min(side * run.count, lattice_.x_mm.count - side * run.x)});
  }
  std::vector<double> values(bins_in(parts));
  evaluate_on_this_thread(parts, touch, values.data());
  auto value = values.begin();
  for (const BinBox& part : parts) {
    for (int y = part.y_first; y < part.y_first + part.y_count; ++y) {
      std::copy(value, value + part.x_count, rows.at(part.x_first, y));
      value += part.x_count;
    }
  }
}

void BinLikelihood::evaluate_displaced(std::span<const BinBox> boxes, const KnownElements& elements,
                                       std::span<double> log_likelihood) const {
  // The order in which touches came must show in no bit.
  const std::span<const KnownElements> items = elements.items();
  const std::vector<std::size_t> order = sorted_touches(items);
  double* to = log_likelihood.data();
  for (std::size_t first = 0, end = 0; first < boxes.size(); first = end) {
    while (end < boxes.size() && boxes[end].object == boxes[first].object) {
      ++end;
    }
    const std::span<const BinBox> of_object = boxes.subspan(first, end - first);
    const auto object = static_cast<std::size_t>(boxes[first].object);
    BlockSums sums(of_object);
    for (const std::size_t i : order) {
      const KnownElements& touch = items[i];
      const auto source = [&](std::span<const BlockRun> runs, const PlaceRows<double>& rows) {
        if (touch.undisplaced_bins == nullptr) {
          evaluate_blocks(object, runs, touch, rows);
          return;
        }
        const std::vector<BlockRun> others = touch.undisplaced_bins->copy(object, runs, rows);
        evaluate_blocks(object, others, touch, rows);
        touch.undisplaced_bins->keep(object, others, rows);
      };
      sums.add(displaced_->means(touch.sensor_from_pivot_mm, sums.runs(), source));
    }
    for (const BinBox& box : of_object) {
      sums.copy(box, to);
      to += box.bins();
    }
  }
}

std::uint64_t BinLikelihood::bytes() const {
  std::uint64_t sum = form_.table.log_likelihood.capacity() * sizeof(double);
  for (const PlacedMap& map : maps_) {
    sum += map.nodes.bytes();
  }
  return sum;
}

double PlacedMap::place_error(const KnownElements& elements) const {
  double norm_cells = 0.0;
  for (const glm::dvec2& p_mm : elements.from_pivot_mm) {
    norm_cells = std::max(norm_cells, (std::abs(p_mm.x) + std::abs(p_mm.y)) / cell_mm);
  }
  // Rotation: cosine, sine, their quotients by the cell, two products and a sum. Bins: a
  // difference, a quotient and two sums.
  return 6.0 * u * std::min(norm_cells, 2.0 * reach_cells) +
         4.0 * u * (lattice_cells + reach_cells);
}

PlacedMap::PlacedMap(const OccupancyGrid& map, double prior, const PoseLattice& lattice)
    : nodes(map, prior),
      cell_mm(map.cell_mm),
      origin_mm(map.origin_mm),
      lattice_cells((std::max(farthest(lattice.x_mm), farthest(lattice.y_mm)) +
                     std::max(std::abs(map.origin_mm.x), std::abs(map.origin_mm.y))) /
                    map.cell_mm),
      reach_cells(lattice_cells + std::max(map.nx, map.ny) + 20.0),
      grid(reach_cells) {
  const double beyond = nodes.prior_log_odds();
  Extremes log_odds{beyond, beyond};
  const auto node = [&](int i, int j) {
    return i >= 0 && i < map.nx && j >= 0 && j < map.ny ? double{map.at(i, j)} : beyond;
  };
  for (int j = -1; j < map.ny; ++j) {
    for (int i = -1; i < map.nx; ++i) {
      const double here = node(i, j);
      log_odds.include(here);
      steepest =
          std::max({steepest, std::abs(node(i + 1, j) - here), std::abs(node(i, j + 1) - here)});
    }
  }
  largest = log_odds.largest_magnitude();
  range = log_odds.span();
}

double BinLikelihood::undisplaced_error(std::size_t object, const KnownElements& elements) const {
  const PlacedMap& map = maps_[object];
  const auto count = static_cast<double>(elements.from_pivot_mm.size());

  // Bins and elements are rounded to the grid, half a step each. Interpolation along an axis rounds
  // a difference, a product and a sum, and does so along y and then along x.
  const double moved_cells = map.place_error(elements) + map.grid.step();
  const double moved = std::min(2.0 * moved_cells * map.steepest, map.range);
  const double interpolated = u * (4.0 * map.steepest + 2.0 * map.largest);
  const double log_odds = moved + interpolated;

  if (form_.kind == ReadingForm::Kind::table) {
    // The place in the table: the first node, a difference, and a quotient and two products of the
    // scale. Then the table's numbers, a product and a sum, and the sum over elements.
    double largest = 0.0;   // magnitude, in nats
    double steepest = 0.0;  // difference per nat of log odds
    for (std::size_t reading = 0; reading < form_.table.levels(); ++reading) {
      const std::span of = numbers_of(form_.table, static_cast<Reading>(reading), object);
      for (std::size_t i = 0; i < of.size(); ++i) {
        const double next = of[std::min(i + 1, of.size() - 1)];
        largest = std::max(largest, std::abs(of[i]));
        steepest = std::max(steepest, std::abs(next - of[i]) * form_.nodes_per_nat);
      }
    }
    const double width = static_cast<double>(form_.table.nodes - 1) / form_.nodes_per_nat;
    const double argument =
        log_odds + u * (map.largest + 2.0 * std::abs(form_.table.first_log_odds) + 4.0 * width);
    const double each =
        std::min(steepest * argument, 2.0 * largest) + (8.0 * u + u * count) * largest;
    return second_order * count * each;
  }

  // Eq. 7 changes by at most 1 nat per nat of log odds, so that a relative error of e = exp(-|z|)
  // changes it by no more than that error. e: the product by log2(e), itself rounded, and 2^f.
  const double exponential = 2.0 * u * std::min(map.largest, most_exponent) + exp_error;
  const double nats =
      std::min(map.largest, std::abs(form_.log_ratio)) + 1.0 + std::abs(form_.log_scale);
  if (form_.kind == ReadingForm::Kind::logs) {
    // Two exponentials, t exp(-t) of the relative error of the second one's argument counts; log r
    // twice; 4 roundings each of numerator, denominator, quotient and its logarithm. Then two sums,
    // and the sum over elements.
    const double each = log_odds + exponential + exp_error + 16.0 * u + 4.0 * u * nats;
    return second_order * count * (each + u * count * nats);
  }
  // Numerator: r, a product, a sum; denominator: a sum; two products over the elements. Then the
  // powers of two, the logarithm and the scale.
  return second_order * count * (log_odds + exponential + 6.0 * u) +
         16.0 * u * (count * nats + 1.0);
}

double BinLikelihood::error(std::size_t object, const KnownElements& elements) const {
  const double of_means =
      displaced_ ? static_cast<double>(elements.touches.size()) * displaced_->mean_error() : 0.0;
  return of_means + undisplaced_error(object, elements);
}

}  // namespace palpate
