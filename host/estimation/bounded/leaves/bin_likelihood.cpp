#include "estimation/bounded/leaves/bin_likelihood.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimation/bounded/parallel_for.hpp"

namespace palpate {

namespace {

/// Most bins along an axis of a block, and most cells of a map that they span: an element then sees
/// the 4 x 4 nodes of one patch.
constexpr int most_block_bins = 16;
constexpr double most_block_cells = 2.0;
/// Blocks that are evaluated together, to fill vectors.
constexpr std::size_t blocks_together = 16;
/// Bins of a thread's task: large beside the cost of a task, small beside many boxes.
template <typename Result>
constexpr std::size_t task_bins = sizeof(Result) == 4 ? 2048 : 512;

/// A bin's coordinate in cells of the bordered map.
double in_cells(const Axis& axis_mm, int bin, double origin_mm, double cell_mm) {
  return (axis_mm.centre(bin) - origin_mm) / cell_mm + MapPatches::border;
}

/// Positions along one axis of neighbouring bins: on the grid, and as offsets from the first.
template <typename Lane>
struct AxisRun {
  double first = 0.0;
  int count = 0;
  std::array<Lane, most_block_bins> offset{};

  /// Takes as many bins from `begin` on as a block may span, `most` at most.
  AxisRun(const Axis& axis_mm, int begin, int most, double origin_mm, double cell_mm,
          const PositionGrid& grid)
      : first(grid.rounded(in_cells(axis_mm, begin, origin_mm, cell_mm))) {
    for (; count < std::min(most, most_block_bins); ++count) {
      const double place = grid.rounded(in_cells(axis_mm, begin + count, origin_mm, cell_mm));
      if (place - first > most_block_cells) {
        break;
      }
      offset[count] = static_cast<Lane>(place - first);
    }
  }
};

/// Where the results of a block's bins go: rows of a larger box.
template <typename Result>
struct BlockResults {
  Result* out = nullptr;
  std::ptrdiff_t row_stride = 0;
  int rows = 0;
  int columns = 0;

  /// Returns the end of what it took, [row, column].
  const double* take(const double* from) const {
    for (int r = 0; r < rows; ++r, from += columns) {
      std::transform(from, from + columns, out + r * row_stride,
                     [](double nats) { return static_cast<Result>(nats); });
    }
    return from;
  }
};

/// Bins along an axis for each of the fewest equal parts that fit a block.
int bins_per_part(int count, double step_cells) {
  const double fit = step_cells > 0.0 ? std::floor(most_block_cells / step_cells) + 1.0 : 1e9;
  const int most = static_cast<int>(std::min<double>(most_block_bins, fit));
  const int parts = (count + most - 1) / most;
  return (count + parts - 1) / parts;
}

}  // namespace

BinLikelihood::BinLikelihood(std::span<const Hypothesis> hypotheses, const ContactModel& contact,
                             const PoseLattice& lattice, const DisplacementSd& touch_sd)
    : form_(contact), lattice_(lattice) {
  if (!touch_sd.none()) {
    displacement_ = std::make_unique<DisplacementWeights>(lattice, touch_sd);
    displaced_.emplace(*displacement_, 1);
  }
  for (const Hypothesis& hypothesis : hypotheses) {
    placements_.push_back(placement_of(hypothesis.compared(), *contact.prior, lattice));
  }
}

BinLikelihood::Placement BinLikelihood::placement_of(const OccupancyGrid& map, double prior,
                                                     const PoseLattice& lattice) {
  MapPatches nodes(map, prior);
  double farthest = 0.0;
  const auto add = [&](const Axis& axis_mm, double origin_mm) {
    for (const int bin : {0, axis_mm.count - 1}) {
      farthest = std::max(farthest, std::abs(in_cells(axis_mm, bin, origin_mm, map.cell_mm)));
    }
  };
  add(lattice.x_mm, map.origin_mm.x);
  add(lattice.y_mm, map.origin_mm.y);
  const double reach =
      farthest + std::max(nodes.width(), nodes.height()) + 2.0 * MapPatches::border;
  // Places within a patch are below 4 cells: these steps leave them exact in 24 and 53 bits.
  const MapExtent extent(map, nodes.prior_log_odds(), lattice);
  return {.nodes = std::move(nodes),
          .extent = extent,
          .cell_mm = map.cell_mm,
          .origin_mm = map.origin_mm,
          .reach_cells = reach,
          .float_grid = PositionGrid(reach, 0x1p-22),
          .double_grid = PositionGrid(reach, 0x1p-51)};
}

void BinLikelihood::move_pivot(const glm::dvec2& pivot_mm) { lattice_.pivot_mm = pivot_mm; }

template <typename Lane, typename Result>
void BinLikelihood::evaluate_in(std::span<const BinBox> boxes, const KnownElements& elements,
                                std::span<Result> log_likelihood) const {
  PlacedElements placed;
  BinList<Lane> bins;
  std::vector<BlockResults<Result>> results;  // [block]
  std::vector<double> evaluated;
  std::vector<ElementPatches<Lane>> scratch;
  Result* out = log_likelihood.data();
  std::int32_t object = -1;  // of the bins in the list
  std::int32_t theta = -1;
  const auto evaluate_list = [&] {
    evaluated.resize(bins.bins());
    const auto of = static_cast<std::size_t>(object);
    evaluate_bins<Lane>({bins, placements_[of].nodes, of, placed, elements.runs, form_}, scratch,
                        evaluated);
    const double* from = evaluated.data();
    for (const BlockResults<Result>& block : results) {
      from = block.take(from);
    }
    bins.clear();
    results.clear();
  };
  for (const BinBox& box : boxes) {
    const Placement& at = placements_[box.object];
    const PositionGrid& grid = sizeof(Lane) == 4 ? at.float_grid : at.double_grid;
    if (object != box.object || theta != box.theta) {
      if (!results.empty()) {
        evaluate_list();
      }
      place_elements(elements.from_pivot_mm, lattice_.theta_rad.centre(box.theta), at.cell_mm,
                     at.reach_cells, grid, placed);
    }
    object = box.object;
    theta = box.theta;
    const int width = bins_per_part(box.x_count, lattice_.x_mm.step() / at.cell_mm);
    const int height = bins_per_part(box.y_count, lattice_.y_mm.step() / at.cell_mm);
    for (int j = 0; j < box.y_count;) {
      const AxisRun<Lane> rows(lattice_.y_mm, box.y_first + j, std::min(height, box.y_count - j),
                               at.origin_mm.y, at.cell_mm, grid);
      for (int i = 0; i < box.x_count;) {
        const AxisRun<Lane> columns(lattice_.x_mm, box.x_first + i,
                                    std::min(width, box.x_count - i), at.origin_mm.x, at.cell_mm,
                                    grid);
        for (int r = 0; r < rows.count; ++r) {
          for (int c = 0; c < columns.count; ++c) {
            bins.x_offset.push_back(columns.offset[c]);
            bins.y_offset.push_back(rows.offset[r]);
          }
        }
        bins.blocks.push_back({columns.first, rows.first, bins.bins()});
        results.push_back(
            {out + std::ptrdiff_t{j} * box.x_count + i, box.x_count, rows.count, columns.count});
        if (results.size() == blocks_together) {
          evaluate_list();
        }
        i += columns.count;
      }
      j += rows.count;
    }
    out += box.bins();
  }
  if (!results.empty()) {
    evaluate_list();
  }
}

template <typename Result>
void BinLikelihood::evaluate_all(std::span<const BinBox> boxes, const KnownElements& elements,
                                 std::span<Result> log_likelihood, std::span<double> errors) const {
  const auto with = [&]<typename Lane>(Lane /*of the kernel*/) {
    if (displaced_) {
      evaluate_displaced<Lane>(boxes, elements, log_likelihood, errors);
    } else {
      evaluate_in<Lane>(boxes, elements, log_likelihood);
    }
  };
  if (sizeof(Result) == 8 || form_.kind == ReadingForm::Kind::table) {
    with(double());
    return;
  }
  with(float());
}

void BinLikelihood::evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                             std::span<float> log_likelihood) const {
  evaluate_all(boxes, elements, log_likelihood, {});
}

void BinLikelihood::evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                             std::span<double> log_likelihood) const {
  evaluate_all(boxes, elements, log_likelihood, {});
}

template <typename Result>
void BinLikelihood::evaluate_on_threads(std::span<const BinBox> boxes,
                                        const KnownElements& elements,
                                        std::span<Result> log_likelihood,
                                        std::span<double> errors) const {
  if (displaced_) {
    evaluate_all(boxes, elements, log_likelihood, errors);
    return;
  }
  struct Task {
    std::size_t first_box;
    std::size_t end_box;
    std::size_t first_bin;
    std::size_t bins;
  };
  // Large boxes are cut between rows: the bins of each part stand together.
  std::vector<BinBox> parts;
  std::vector<Task> tasks;
  Task task{};
  for (const BinBox& box : boxes) {
    const auto rows = static_cast<std::int32_t>(
        std::clamp<std::int64_t>(std::int64_t{task_bins<Result>} / box.x_count, 1, box.y_count));
    for (std::int32_t row = 0; row < box.y_count; row += rows) {
      BinBox part = box;
      part.y_first += row;
      part.y_count = std::min(rows, box.y_count - row);
      parts.push_back(part);
      task.bins += static_cast<std::size_t>(part.bins());
      if (task.bins >= task_bins<Result>) {
        task.end_box = parts.size();
        tasks.push_back(task);
        task = {task.end_box, 0, task.first_bin + task.bins, 0};
      }
    }
  }
  if (task.bins > 0) {
    task.end_box = parts.size();
    tasks.push_back(task);
  }
  parallel_for(tasks.size(), [&](std::size_t i) {
    const Task& of = tasks[i];
    evaluate(std::span(parts).subspan(of.first_box, of.end_box - of.first_box), elements,
             log_likelihood.subspan(of.first_bin, of.bins));
  });
}

template void BinLikelihood::evaluate_on_threads(std::span<const BinBox>, const KnownElements&,
                                                 std::span<float>, std::span<double>) const;
template void BinLikelihood::evaluate_on_threads(std::span<const BinBox>, const KnownElements&,
                                                 std::span<double>, std::span<double>) const;
template void BinLikelihood::evaluate_in<float>(std::span<const BinBox>, const KnownElements&,
                                                std::span<double>) const;
template void BinLikelihood::evaluate_in<double>(std::span<const BinBox>, const KnownElements&,
                                                 std::span<double>) const;

std::uint64_t BinLikelihood::bytes() const {
  std::uint64_t sum = form_.table.capacity() * sizeof(double);
  for (const Placement& placement : placements_) {
    sum += placement.nodes.bytes();
  }
  return sum;
}

}  // namespace palpate
