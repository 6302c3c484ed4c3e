#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "estimation/known_elements.hpp"
#include "estimation/touch_overlap.hpp"
#include "model/bounding_box.hpp"

namespace palpate {

/// What the search for the mean of a touch's likelihood is given; it outlives the search's parts.
struct MeanTask {
  const SearchSpace& space;
  const PoseLattice& lattice;
  const BinLikelihood& likelihood;
  const KnownElements& elements;
  std::span<const BoundingBox> reaches;                 ///< [theta] of the elements
  const std::vector<std::vector<double>>& unpenalised;  ///< [object][level]; see unpenalised()
  const ArrayRectangle& array;  ///< of the touch; bins at which it overlaps an object count
  bool everywhere;              ///< all bins count
};

/// What the largest tiles of a plane, one object at one theta, tell.
struct PlaneSurvey {
  static constexpr double nothing = -std::numeric_limits<double>::infinity();

  std::int64_t bins = 0;      ///< that count
  std::int64_t off_map = 0;   ///< of these, bins at which every element sees the prior
  double best = nothing;      ///< the largest bound, in nats, with the prior weight
  double left_out = nothing;  ///< log of what the tiles that see the map hold at most, with it
};

/// Divides the tiles of neighbouring planes of one object, one plane after another, and evaluates
/// the bins of the smallest tiles of all of them together. A plane is divided depth first, in whole
/// penalties: no list of its tiles is kept, as TileDivision keeps one to choose the best from.
class PlaneDivision {
 public:
  PlaneDivision(const MeanTask& task, std::size_t object);

  /// The sums of the penalties of a plane's largest tiles, [batch, tile].
  using LargestSums = std::vector<std::uint32_t>;

  /// Looks at the largest tiles of a plane.
  /// @param sums receives these
  PlaneSurvey survey(int theta, LargestSums& sums);
  /// Divides a plane's tiles down to bins, which are evaluated later, but for those whose bounds,
  /// with the prior weight, are below `least`.
  /// @param kept the sums that its survey found, or none
  /// @returns log of what these hold at most
  double divide(int theta, double least, const LargestSums& kept);
  /// The log of the summed likelihood of the bins that count in what was divided, with the prior
  /// weight.
  double evaluated() const;

 private:
  class PenaltySum;
  /// A plane's bins that count in the mean, and the largest tiles that are looked at.
  struct Plane {
    int theta = 0;
    std::vector<RowBins> rows;  ///< [y] bins that count
    BinBox around;              ///< a box around all rows
    std::int64_t bins = 0;      ///< number of bins that count
    /// Whole batches, about those that see the map and hold bins that count.
    TileRange largest;
    bool all_seen = true;  ///< the largest tiles hold all bins that count

    /// The bins of a box's row that count.
    RowBins in_row(const BinBox& box, int y) const;
    /// The number of bins of the box that count.
    std::int64_t count_in(const BinBox& box) const;
  };
  /// A plane that is being divided.
  struct Division {
    const Plane& plane;
    std::vector<std::int64_t> last_divided;  ///< [level] the largest sum of a tile that is divided
    std::vector<PenaltySum> left_out;        ///< [level]
  };
  /// A level's elements at the theta at which they were placed last.
  struct Placed {
    int theta = -1;
    WindowPlaces places;
  };

  Plane plane(int theta) const;
  BinBox box_of(std::size_t level, const Plane& plane, const TileRange& tiles) const {
    return levels_[level].box_of(static_cast<std::int32_t>(object_), plane.theta, tiles);
  }
  const WindowPlaces& places(std::size_t level, int theta);
  LargestSums largest_sums(const Plane& plane);
  /// Leaves out the tiles of a batch whose bounds are low, and divides the others.
  /// @param x, y its first tile
  void divide_batch(Division& division, std::size_t level, int x, int y, const std::uint32_t* sums);
  /// Leaves out the smallest tiles of a batch whose bounds are low. The others are to be evaluated,
  /// with those between them.
  void take_smallest(Division& division, int x, int y, const std::uint32_t* sums);

  const MeanTask& task_;
  std::size_t object_;
  const TileBounds& bounds_;
  std::span<const TileLevel> levels_;
  std::span<const double> unpenalised_;  ///< [level]
  std::vector<Placed> placed_;           ///< [level]
  std::vector<BinBox> boxes_;            ///< to be evaluated
  std::vector<RowBins> boxes_rows_;      ///< [box, row] bins that count
};

}  // namespace palpate
