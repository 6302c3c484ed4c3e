#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"
#include "estimation/touch_overlap.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// The bins of a plane, one object at one theta, that count in a mean.
struct CountedPlane {
  int theta = 0;
  std::vector<OverlapPlane::Bins> rows;  ///< [y] bins that count
  BinBox around;                         ///< a box around all rows
  std::int64_t bins = 0;                 ///< number of bins that count

  /// The bins of a box's row that count.
  OverlapPlane::Bins in_row(const BinBox& box, int y) const;
  /// Whether any bin of the box counts.
  bool any_in(const BinBox& box) const;
  /// The number of bins outside the box that count.
  std::int64_t outside(const BinBox& box) const;
};

/// The bins that count in the mean of a touch's likelihood: those at which its array overlaps an
/// object, or all.
class CountedBins {
 public:
  /// @param space,lattice outlive this object
  /// @param everywhere all bins count
  CountedBins(const SearchSpace& space, const PoseLattice& lattice, const ArrayRectangle& array,
              bool everywhere)
      : space_(space), lattice_(lattice), array_(array), everywhere_(everywhere) {}

  CountedPlane plane(std::size_t object, int theta) const;

 private:
  const SearchSpace& space_;
  const PoseLattice& lattice_;
  ArrayRectangle array_;
  bool everywhere_;
};

/// Boxes in neighbouring planes of one object whose likelihoods are to be summed, as far as their
/// bins count.
class CountedBoxes {
 public:
  void add(const BinBox& box, const CountedPlane& plane);

  /// The log of the summed likelihood of the bins that count.
  double log_sum(const BinLikelihood& likelihood, const KnownElements& elements) const;

 private:
  std::vector<BinBox> boxes_;
  std::vector<OverlapPlane::Bins> rows_;  ///< [box, row] bins that count
};

}  // namespace palpate
