#pragma once

#include <array>
#include <optional>

#include "palpate/api.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// How far an object is from looking like itself turned.
struct PALPATE_API RotationalSymmetry {
  /// [n], in mm: mean distance between the outline and the outline turned by k/n of a turn, where
  /// they lie best on each other; the largest over k. At n = 0 the largest over turns of many
  /// angles, at n = 1 zero.
  std::array<double, 9> apart_mm{};
  double tolerance_mm = 0.0;  ///< distance up to which the map cannot tell the outlines apart
  /// OccupancyGrid::symmetry by this measurement: 0 where all turns stay within the tolerance, else
  /// the largest n within it.
  int suggested = 1;

  /// The n from 2 to 8 with the least distance.
  int nearest() const;
};

/// Measures how far the object of a map is from looking like itself turned by multiples of 1/2 to
/// 1/8 of a turn, and by any angle. Compares occupied cells (log odds > 0) only where the map was
/// seen, which is where its log odds differ from the prior's; a turn that carries more than a
/// quarter of them to unseen cells counts as wholly unlike. Takes milliseconds: of many cells, it
/// samples some thousand.
/// @returns none where fewer than 16 cells are occupied
PALPATE_API std::optional<RotationalSymmetry> measure_symmetry(const OccupancyGrid& map);

/// How far an object is from looking like its mirror image, turned and shifted so that the two lie
/// best on each other.
struct PALPATE_API MirrorSymmetry {
  double apart_mm = 0.0;      ///< mean distance between the outlines
  double tolerance_mm = 0.0;  ///< as RotationalSymmetry::tolerance_mm

  /// The object's two sides cannot be told apart.
  bool alike() const { return apart_mm <= tolerance_mm; }
};

/// Compares as measure_symmetry() does.
/// @returns none where fewer than 16 cells are occupied
PALPATE_API std::optional<MirrorSymmetry> measure_mirror_symmetry(const OccupancyGrid& map);

}  // namespace palpate
