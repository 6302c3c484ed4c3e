#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/leaves/map_patches.hpp"
#include "estimation/bounded/leaves/reading_form.hpp"

namespace palpate {

/// Most lanes of a vector. Lists that kernels read are padded to a multiple of it.
inline constexpr std::size_t most_lanes = 16;
constexpr std::size_t padded(std::size_t count) {
  return (count + most_lanes - 1) / most_lanes * most_lanes;
}

/// The grid that positions in cells are rounded to: sums and differences of such positions are
/// exact in float64, so that a bin's position is the same from whichever bin it is reached.
class PositionGrid {
 public:
  /// @param reach_cells largest magnitude of a position
  /// @param finest no step is finer: where fractions below 4 must fit the lanes' numbers exactly
  PositionGrid(double reach_cells, double finest);

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
template <typename Lane>
struct ElementPatches {
  std::vector<std::int32_t> patch;
  std::vector<Lane> x;
  std::vector<Lane> y;
};

/// Bins of one object and theta that lie within two cells of the map along each axis.
struct BinBlock {
  double x = 0.0;  ///< of the first bin's pivot, in cells of the bordered map, on the PositionGrid
  double y = 0.0;
  std::size_t end = 0;  ///< of its bins in a list; they begin where those of the last block end
};

/// The bins of some blocks, one block after another.
template <typename Lane>
struct BinList {
  std::vector<BinBlock> blocks;
  std::vector<Lane> x_offset;  ///< [bin] from the first of its block, in [0, 2] cells
  std::vector<Lane> y_offset;

  std::size_t bins() const { return x_offset.size(); }
  void clear() {
    blocks.clear();
    x_offset.clear();
    y_offset.clear();
  }
};

/// Rotates elements by theta and rounds them to the grid, clamped to +-`reach_cells`.
void place_elements(std::span<const glm::dvec2> from_pivot_mm, double theta_rad, double cell_mm,
                    double reach_cells, const PositionGrid& grid, PlacedElements& placed);

/// Bins of one object and theta, and what their log-likelihood follows from.
template <typename Lane>
struct BinTask {
  const BinList<Lane>& bins;
  const MapPatches& map;
  std::size_t object = 0;
  const PlacedElements& placed;
  std::span<const ReadingRun> runs;  ///< of the placed elements
  const ReadingForm& form;           ///< a table only for Lane = double
};

/// Log-likelihood of the elements at bins, with vectors of `Lane`. Vectors are filled with bins of
/// several blocks. Each bin's bits depend neither on the others nor on the processor.
/// @param scratch memory to be used again
/// @param log_likelihood out: [bin] in nats
template <typename Lane>
void evaluate_bins(const BinTask<Lane>& task, std::vector<ElementPatches<Lane>>& scratch,
                   std::span<double> log_likelihood);

/// The vector instructions that kernels use on this processor, such as "AVX3".
std::string vector_instructions();

}  // namespace palpate
