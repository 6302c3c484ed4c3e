#include "sampled_touch_mean.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "log_sum.hpp"
#include "random.hpp"

namespace palpate {

namespace {

/// Mixes all bits (the finaliser of SplitMix64; Steele, Lea and Flood 2014).
std::uint64_t mixed(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return z ^ (z >> 31);
}

std::uint64_t fingerprint_of(const KnownElements& elements) {
  std::uint64_t print = 0;
  for (const ReadingRun& run : elements.runs) {
    print = mixed(print ^ static_cast<std::uint64_t>(run.reading));
    for (std::size_t e = run.begin; e < run.end; ++e) {
      print = mixed(print ^ std::bit_cast<std::uint64_t>(elements.from_pivot_mm[e].x));
      print = mixed(print ^ std::bit_cast<std::uint64_t>(elements.from_pivot_mm[e].y));
    }
  }
  return print;
}

/// Bins of a row that vector instructions evaluate at once.
constexpr int longest_run = 8;
/// Boxes that a task evaluates.
constexpr std::size_t boxes_per_task = 256;
constexpr double nothing = -std::numeric_limits<double>::infinity();

int run_length(const BinBox& box) { return std::min(longest_run, box.x_count); }

}  // namespace

SampledTouchMeans::SampledTouchMeans(std::span<const Hypothesis> hypotheses,
                                     const PoseLattice& lattice, std::span<const double> log_weight,
                                     const BinLikelihood& likelihood,
                                     std::span<const TileBounds> bounds)
    : lattice_(lattice),
      log_weight_(log_weight.begin(), log_weight.end()),
      likelihood_(likelihood),
      bounds_(bounds) {
  for (const Hypothesis& hypothesis : hypotheses) {
    boxes_.push_back(occupied_box(hypothesis.map));
  }
  for (int t = 0; t < lattice.theta_rad.count; ++t) {
    const double theta_rad = lattice.theta_rad.centre(t);
    turns_.emplace_back(std::cos(theta_rad), std::sin(theta_rad));
  }
}

void SampledTouchMeans::reset() { means_.clear(); }

void SampledTouchMeans::move_pivot(const glm::dvec2& pivot_mm) { lattice_.pivot_mm = pivot_mm; }

std::vector<TouchMean> SampledTouchMeans::evaluate(
    std::span<const ArrayReadings> touches, const std::function<void()>& cancel_point) const {
  std::vector<TouchMean> means;
  for (const ArrayReadings& touch : touches) {
    const KnownElements elements = known_elements(touch);
    // A touch without a known element says nothing, not even where the array was.
    if (!elements.empty()) {
      const std::uint64_t fingerprint = fingerprint_of(elements);
      const auto same = [&](const TouchMean& mean) { return mean.fingerprint == fingerprint; };
      const auto times_before =
          std::ranges::count_if(means_, same) + std::ranges::count_if(means, same);
      const Overlap overlap = overlap_of(touch.rectangle);
      const WeightedSum sum =
          overlap.bins <= bins_per_touch_mean
              ? sum_of_all(overlap, elements)
              : sum_by_draws(overlap, elements,
                             mixed(fingerprint + static_cast<std::uint64_t>(times_before)));
      means.push_back(
          {.log_mean = sum.log_sum - std::log(overlap.weighted_bins),
           .squared_error = sum.squared_error,
           .log_share = std::log(overlap.weighted_bins / static_cast<double>(lattice_.bins())),
           .fingerprint = fingerprint});
    }
    if (cancel_point) {
      cancel_point();
    }
  }
  return means;
}

void SampledTouchMeans::add(std::span<const TouchMean> means) {
  means_.insert(means_.end(), means.begin(), means.end());
}

double SampledTouchMeans::log_evidence() const {
  if (means_.empty()) {
    return 0.0;
  }
  // In an order of their own, so that the order of touches shows in no bit.
  std::vector<double> logs;
  for (const TouchMean& mean : means_) {
    logs.push_back(mean.log_mean);
  }
  std::sort(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double log_mean : logs) {
    sum += log_mean;
  }
  return means_.front().log_share + sum;
}

double SampledTouchMeans::standard_error() const {
  std::vector<double> squares;
  for (const TouchMean& mean : means_) {
    squares.push_back(mean.squared_error);
  }
  std::sort(squares.begin(), squares.end());
  double sum = 0.0;
  for (const double square : squares) {
    sum += square;
  }
  return std::sqrt(sum);
}

SampledTouchMeans::Overlap SampledTouchMeans::overlap_of(const ArrayRectangle& array) const {
  const std::size_t thetas = turns_.size();
  Overlap overlap;
  overlap.planes.reserve(boxes_.size() * thetas);
  for (const BoundingBox& box : boxes_) {
    for (std::size_t theta = 0; theta < thetas; ++theta) {
      overlap.planes.emplace_back(array, box, lattice_, static_cast<int>(theta));
    }
  }
  std::vector<std::int64_t> bins(overlap.planes.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bins.size(), 8), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      bins[i] = overlap.planes[i].bins();
    }
  });
  for (std::size_t object = 0; object < boxes_.size(); ++object) {
    const auto first = bins.begin() + static_cast<std::ptrdiff_t>(object * thetas);
    const std::int64_t of_object =
        std::accumulate(first, first + static_cast<std::ptrdiff_t>(thetas), std::int64_t{0});
    overlap.bins += of_object;
    overlap.weighted_bins += std::exp(log_weight_[object]) * static_cast<double>(of_object);
  }
  if (overlap.weighted_bins == 0.0) {
    // No pose of the region brings the array to an object: all poses are alike.
    overlap.everywhere = true;
    overlap.bins = static_cast<std::int64_t>(boxes_.size()) * lattice_.bins();
    for (const double log_weight : log_weight_) {
      overlap.weighted_bins += std::exp(log_weight) * static_cast<double>(lattice_.bins());
    }
  }
  return overlap;
}

const OverlapPlane& SampledTouchMeans::plane(const Overlap& overlap, const BinBox& box) const {
  return overlap.planes[static_cast<std::size_t>(box.object) * turns_.size() +
                        static_cast<std::size_t>(box.theta)];
}

BinBox SampledTouchMeans::counted(const Overlap& overlap, const BinBox& row) const {
  if (overlap.everywhere) {
    return row;
  }
  const OverlapPlane::Bins in_row = plane(overlap, row).row(row.y_first);
  const std::int32_t first = std::max(row.x_first, in_row.first);
  const std::int32_t end = std::min(row.x_first + row.x_count, in_row.first + in_row.count);
  BinBox part = row;
  part.x_first = first;
  part.x_count = std::max(0, end - first);
  return part;
}

std::vector<double> SampledTouchMeans::log_sums(std::span<const BinBox> rows,
                                                const Overlap& overlap,
                                                const KnownElements& elements) const {
  std::vector<double> sums(rows.size(), nothing);
  const std::size_t tasks = (rows.size() + boxes_per_task - 1) / boxes_per_task;
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    const std::size_t first = task * boxes_per_task;
    const std::size_t count = std::min(boxes_per_task, rows.size() - first);
    std::vector<BinBox> boxes;
    std::vector<std::size_t> of_box;
    std::size_t bins = 0;
    for (std::size_t i = first; i < first + count; ++i) {
      const BinBox box = counted(overlap, rows[i]);
      if (box.x_count > 0) {
        boxes.push_back(box);
        of_box.push_back(i);
        bins += static_cast<std::size_t>(box.bins());
      }
    }
    std::vector<double> logs(bins);
    likelihood_.evaluate(boxes, elements, std::span(logs));
    const double* log = logs.data();
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      LogSum sum;
      for (std::int64_t i = 0; i < boxes[b].bins(); ++i) {
        sum.add(*log++);
      }
      sums[of_box[b]] = sum.log();
    }
  });
  return sums;
}

SampledTouchMeans::WeightedSum SampledTouchMeans::sum_of_all(const Overlap& overlap,
                                                             const KnownElements& elements) const {
  std::vector<BinBox> rows;
  for (std::size_t object = 0; object < boxes_.size(); ++object) {
    for (int theta = 0; theta < lattice_.theta_rad.count; ++theta) {
      BinBox row{.object = static_cast<std::int32_t>(object),
                 .theta = theta,
                 .y_count = 1,
                 .x_count = lattice_.x_mm.count};
      const OverlapPlane::Bins ys = overlap.everywhere ? OverlapPlane::Bins{0, lattice_.y_mm.count}
                                                       : plane(overlap, row).rows();
      for (row.y_first = ys.first; row.y_first < ys.first + ys.count; ++row.y_first) {
        rows.push_back(row);
      }
    }
  }
  const std::vector<double> sums = log_sums(rows, overlap, elements);
  LogSum total;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    total.add(log_weight_[static_cast<std::size_t>(rows[i].object)] + sums[i]);
  }
  return {.log_sum = total.log()};
}

std::vector<TouchTile> SampledTouchMeans::tiles_of(const Overlap& overlap,
                                                   const KnownElements& elements) const {
  std::vector<BinBox> boxes;
  for (std::size_t i = 0; i < overlap.planes.size(); ++i) {
    const OverlapPlane::Bins x = overlap.everywhere ? OverlapPlane::Bins{0, lattice_.x_mm.count}
                                                    : overlap.planes[i].columns();
    const OverlapPlane::Bins y =
        overlap.everywhere ? OverlapPlane::Bins{0, lattice_.y_mm.count} : overlap.planes[i].rows();
    if (x.count > 0 && y.count > 0) {
      boxes.push_back({static_cast<std::int32_t>(i / turns_.size()),
                       static_cast<std::int32_t>(i % turns_.size()), y.first, y.count, x.first,
                       x.count});
    }
  }
  if (overlap.everywhere) {
    // An array that meets no object sees the same nearly everywhere.
    std::vector<TouchTile> tiles;
    for (const BinBox& box : boxes) {
      tiles.push_back({.log_weight = log_weight_[static_cast<std::size_t>(box.object)] +
                                     std::log(static_cast<double>(box.bins())),
                       .box = box});
    }
    return tiles;
  }
  return touch_tiles(boxes, bounds_, log_weight_, turns_, elements, [&](const BinBox& box) {
    return plane(overlap, box).may_overlap({box.x_first, box.x_count}, {box.y_first, box.y_count});
  });
}

std::vector<SampledTouchMeans::Draw> SampledTouchMeans::draws_from(std::span<const TouchTile> tiles,
                                                                   std::uint64_t seed) const {
  double largest = nothing;
  for (const TouchTile& tile : tiles) {
    largest = std::max(largest, tile.log_weight);
  }
  std::vector<double> ends;  // of the tiles on a line
  ends.reserve(tiles.size());
  double end = 0.0;
  double runs = 0.0;  // weighted lengths
  for (const TouchTile& tile : tiles) {
    const double weight = std::exp(tile.log_weight - largest);
    ends.push_back(end += weight);
    runs += weight * run_length(tile.box);
  }
  const auto strata = std::max(
      std::int64_t{1},
      static_cast<std::int64_t>(static_cast<double>(bins_per_touch_mean) * end / (2.0 * runs)));
  Random random(seed, Stream::touch_means);
  const auto below = [&](int bound) {
    return std::min(static_cast<int>(random.uniform() * bound), bound - 1);
  };
  std::vector<Draw> draws;
  draws.reserve(static_cast<std::size_t>(2 * strata));
  auto from = ends.begin();
  for (std::int64_t h = 0; h < strata; ++h) {
    const double length = end / static_cast<double>(strata);
    const double begin = static_cast<double>(h) * length;
    while (from + 1 != ends.end() && *from <= begin) {
      ++from;
    }
    for (int k = 0; k < 2; ++k) {
      const double at = begin + random.uniform() * length;
      auto drawn = from;
      while (drawn + 1 != ends.end() && *drawn <= at) {
        ++drawn;
      }
      const TouchTile& tile = tiles[static_cast<std::size_t>(drawn - ends.begin())];
      // The run that holds a bin drawn from all: a run's chance is its share of the row.
      BinBox run = tile.box;
      run.y_first += below(run.y_count);
      run.y_count = 1;
      const int first = below(run.x_count) / longest_run * longest_run;
      run.x_count = std::min(longest_run, run.x_count - first);
      run.x_first += first;
      draws.push_back({run, -std::log(static_cast<double>(run.x_count)) - tile.bound});
    }
  }
  return draws;
}

SampledTouchMeans::WeightedSum SampledTouchMeans::sum_by_draws(const Overlap& overlap,
                                                               const KnownElements& elements,
                                                               std::uint64_t seed) const {
  const std::vector<TouchTile> tiles = tiles_of(overlap, elements);
  LogSum line;
  for (const TouchTile& tile : tiles) {
    line.add(tile.log_weight);
  }
  const std::vector<Draw> draws = draws_from(tiles, seed);
  std::vector<BinBox> rows;
  rows.reserve(draws.size());
  for (const Draw& draw : draws) {
    rows.push_back(draw.bins);
  }
  std::vector<double> log_ratios = log_sums(rows, overlap, elements);
  double largest = nothing;
  for (std::size_t i = 0; i < draws.size(); ++i) {
    log_ratios[i] += draws[i].log_scale;
    largest = std::max(largest, log_ratios[i]);
  }
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < draws.size(); i += 2) {
    const double one = std::exp(log_ratios[i] - largest);
    const double other = std::exp(log_ratios[i + 1] - largest);
    sum += one + other;
    squares += (one - other) * (one - other);
  }
  // Strata of equal length L, two draws in each: sum of L (one + other) / 2, whose variance is
  // estimated by the sum of L^2 (one - other)^2 / 4.
  return {.log_sum = line.log() + largest + std::log(sum / static_cast<double>(draws.size())),
          .squared_error = squares / (sum * sum)};
}

}  // namespace palpate
