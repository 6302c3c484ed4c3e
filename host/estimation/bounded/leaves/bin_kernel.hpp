#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/known_elements.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// A map's log odds for the kernels of bins: bordered by `border` nodes of the prior on every side,
/// and stored so that the 16 floats from patch(x, y) on are the nodes of columns x to x + 3 and
/// rows y to y + 3 of the bordered map, column by column. Every node is stored four times.
class MapPatches {
 public:
  static constexpr int border = 4;
  static constexpr int side = 4;  ///< of a patch, in nodes

  /// @throws Error where the bordered map has more nodes than kernels can index
  MapPatches(const OccupancyGrid& map, double prior);

  int width() const { return width_; }
  int height() const { return height_; }
  /// [y, x, row of the patch]; longer by what a vector may read beyond the last patch.
  const float* nodes() const { return nodes_.data(); }
  std::uint64_t bytes() const { return nodes_.capacity() * sizeof(float); }

  /// Stands for the prior in nodes(): kernels put the exact prior in its place.
  static constexpr float marker = std::numeric_limits<float>::infinity();
  double prior_log_odds() const { return prior_log_odds_; }

 private:
  int width_;
  int height_;
  double prior_log_odds_;
  std::vector<float> nodes_;
};

/// How kernels of bins evaluate Eq. 7, or the table in its place. With r = gamma m / s and
/// s = gamma m + 1 - gamma, the likelihood of contact at log odds z (of no contact at -z) is
///
///     s (1 + r e) / (1 + e) for z >= 0,   s (r + e) / (1 + e) for z < 0,   e = exp(-|z|).
///
/// Numerators and denominators are multiplied over elements, powers of two taken out every
/// `interval` elements, and one logarithm taken per bin. Where r is too small for products of
/// r + e, and for gamma = 0, the elements' logs are added up instead, each with
///
///     r + e = exp(a) (1 + exp(-|z - log r|)),   a = max(z, log r), for z < 0.
struct ReadingForm {
  enum class Kind { products, logs, table };

  /// @param contact resolved: with its prior
  explicit ReadingForm(const ContactModel& contact);

  Kind kind = Kind::products;
  double ratio = 0.0;      ///< r
  double log_ratio = 0.0;  ///< log r, finite also for r = 0
  double log_scale = 0.0;  ///< log s
  int interval = 1;

  LikelihoodTable table;       ///< where it is the kind
  double nodes_per_nat = 0.0;  ///< of the table
};

/// Most lanes of a vector. Lists that kernels read are padded to a multiple of it.
inline constexpr std::size_t most_lanes = 8;
constexpr std::size_t padded(std::size_t count) {
  return (count + most_lanes - 1) / most_lanes * most_lanes;
}

/// The grid that positions in cells are rounded to: sums and differences of such positions are
/// exact in float64, so that a bin's position is the same from whichever bin it is reached.
class PositionGrid {
 public:
  /// @param reach_cells largest magnitude of a position
  explicit PositionGrid(double reach_cells);

  double step() const { return step_; }
  /// Added to a position and subtracted again, it rounds the position to the grid.
  double rounder() const { return 0x1.8p52 * step_; }
  double rounded(double position) const { return (position + rounder()) - rounder(); }

 private:
  double step_;
};

/// Elements in the object frame for one theta, in cells of a map, [e], padded.
struct PlacedElements {
  std::vector<double> x;
  std::vector<double> y;
};

/// Where an element stands about a block of bins: the patch, as an index of MapPatches, and the
/// place of the block's first bin within the patch's first cell, [e], padded.
struct ElementPatches {
  std::vector<std::int32_t> patch;  ///< its bits flipped where it has nodes of the border
  std::vector<double> x;
  std::vector<double> y;
};

/// Bins of one object and theta that lie within two cells of the map along each axis.
struct BinBlock {
  double x = 0.0;  ///< of the first bin's pivot, in cells of the bordered map, on the PositionGrid
  double y = 0.0;
  std::size_t end = 0;  ///< of its bins in a list; they begin where those of the last block end
};

/// The bins of some blocks, one block after another.
struct BinList {
  std::vector<BinBlock> blocks;
  std::vector<double> x_offset;  ///< [bin] from the first of its block, in [0, 2] cells
  std::vector<double> y_offset;
  std::vector<double*> result;  ///< [bin] where its log-likelihood goes

  std::size_t bins() const { return x_offset.size(); }
  void clear() {
    blocks.clear();
    x_offset.clear();
    y_offset.clear();
    result.clear();
  }
};

/// Rotates elements by theta and rounds them to the grid, clamped to +-`reach_cells`.
void place_elements(std::span<const glm::dvec2> from_pivot_mm, double theta_rad, double cell_mm,
                    double reach_cells, const PositionGrid& grid, PlacedElements& placed);

/// Bins of one object and theta, and what their log-likelihood follows from.
struct BinTask {
  const BinList& bins;
  const MapPatches& map;
  std::size_t object = 0;
  const PlacedElements& placed;
  std::span<const ReadingRun> runs;  ///< of the placed elements
  const ReadingForm& form;
};

/// Log-likelihood of the elements at bins, in nats. Vectors are filled with bins of several blocks.
/// Each bin's bits depend neither on the others nor on the processor.
/// @param scratch memory to be used again
void evaluate_bins(const BinTask& task, std::vector<ElementPatches>& scratch);

/// The vector instructions that kernels use on this processor, such as "AVX3".
std::string vector_instructions();

}  // namespace palpate
