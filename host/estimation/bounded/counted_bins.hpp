#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/displaced/overlap_shares.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"
#include "estimation/touch_overlap.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// The bins of a plane, one object at one theta, that count in a mean.
struct CountedPlane {
  int theta = 0;
  std::vector<OverlapPlane::Bins> rows;  ///< [y] bins that count, or may have a share
  BinBox around;                         ///< a box around all rows
  std::int64_t bins = 0;                 ///< number of bins over which the mean is
  double log_most_share = 0.0;           ///< no bin has a larger share

  /// The bins of a box's row that count.
  OverlapPlane::Bins in_row(const BinBox& box, int y) const;
  /// Whether any bin of the box counts.
  bool any_in(const BinBox& box) const;
};

/// The bins that count in the mean of a touch's likelihood: those at which its array overlaps an
/// object, or all. Where the touch is displaced, exact likelihoods count by their OverlapShares.
class CountedBins {
 public:
  /// A sum of shares, and the bound of its error. A bin without shares has one of 1.
  struct ShareSum {
    double shares = 0.0;
    double error = 0.0;
  };

  /// On the threads of the caller's arena.
  /// @param space,lattice outlive this object
  /// @param sensor_from_pivot_mm where the touch is displaced
  /// @param everywhere all bins count
  CountedBins(const SearchSpace& space, const PoseLattice& lattice, const ArrayRectangle& array,
              const std::optional<glm::dvec2>& sensor_from_pivot_mm, bool everywhere);

  CountedPlane plane(std::size_t object, int theta) const;
  /// The shares of a plane's bins that lie outside a box.
  /// @param looked_at planes of the plane's object
  ShareSum outside(const BinBox& box, const CountedPlane& plane,
                   OverlapShares::Planes& looked_at) const;
  /// Where the touch is displaced.
  const std::optional<OverlapShares>& shares() const { return shares_; }

 private:
  const SearchSpace& space_;
  const PoseLattice& lattice_;
  ArrayRectangle array_;
  bool everywhere_;
  std::optional<OverlapShares> shares_;
};

/// Boxes in neighbouring planes of one object whose likelihoods are to be summed, as far as their
/// bins count.
class CountedBoxes {
 public:
  void add(const BinBox& box, const CountedPlane& plane);

  /// Bounds of the log of the summed likelihood of the bins that count, by their shares, beside
  /// the likelihood's own error.
  /// @param counted of which the planes were
  /// @param looked_at planes of the boxes' object
  LogInterval log_sum(const BinLikelihood& likelihood, const KnownElements& elements,
                      Arithmetic arithmetic, const CountedBins& counted,
                      OverlapShares::Planes& looked_at) const;

 private:
  using Rows = std::vector<OverlapPlane::Bins>::const_iterator;

  /// Appends the values of a box's bins that count.
  /// @param from of its first bin; rows are `pitch` apart
  /// @param row moves on behind the box's rows
  static void append_counted(const BinBox& box, std::vector<double>::const_iterator from,
                             std::ptrdiff_t pitch, Rows& row, std::vector<double>& values);
  /// The shares of the bins that count, box after box.
  /// @param error receives the bound of the error of each
  std::vector<double> shares_of_bins(const OverlapShares& shares, OverlapShares::Planes& looked_at,
                                     double& error) const;

  std::vector<BinBox> boxes_;
  std::vector<OverlapPlane::Bins> rows_;  ///< [box, row] bins that count
};

}  // namespace palpate
