#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// log(p / (1 - p)), Eq. 1.
PALPATE_API double log_odds_from_probability(double p);
/// 1 / (1 + exp(-l)), without overflow.
PALPATE_API double probability_from_log_odds(double l);

/// Label under which results report "none of these", an object that was never learned. No map may
/// bear it: results could not tell its object from an unlearned one.
inline constexpr std::string_view none_label = "(none)";

/// Shortest and longest cell edge and sensor-model spread, in mm (1 nm and 1 km). Their squares fit
/// float32, and a grid of the shortest cells at `farthest_mm` has exact cell indices in float64.
inline constexpr double least_length_mm = 1e-6;
inline constexpr double most_length_mm = 1e6;

/// Most cells of a map: kernels index them in 32 bits.
inline constexpr std::int64_t most_cells = std::int64_t{1} << 30;

/// Largest magnitude of a cell's log odds, in nats: float32 holds sums of 1e8 such values.
inline constexpr double most_log_odds = 1e30;

struct MapSource;

/// The map of one object: log odds of occupancy on a regular grid in the object frame. Cell
/// (row j, column i) is centred at origin_mm + cell_mm * (i, j). Everything beyond the grid holds
/// the prior, and interpolation across the border fades to it.
struct OccupancyGrid {
  std::string label;
  double cell_mm = 0.5;
  glm::dvec2 origin_mm{0.0, 0.0};  ///< centre of cell (0, 0)
  double prior = 0.2;              ///< p(m), probability that an unseen cell is occupied
  int symmetry = 1;                ///< n-fold rotational symmetry of the object; 0 = full
  /// Spread of the inverse sensor model that built the map, in mm; none where it is unknown. Cells
  /// finer than the spread resolve no more.
  std::optional<double> spread_mm = {};
  /// The symmetry that the map itself shows, see measure_symmetry(); none where it is not measured.
  /// Pose errors and filters go by `symmetry` alone.
  std::optional<int> suggested_symmetry = {};
  /// The object may lie on its other side: its mirror image, x to -x, is an object of its own under
  /// the same label; see add_mirror_images().
  bool mirror = false;
  /// Made from a drawing, see drawn_map(): the prior is of places beyond the grid alone.
  bool drawn = false;
  /// The object frame in the robot frame of the touches that the map was learned from.
  Pose T_learned_robot_object{};
  /// How far centre_frame() has moved the object frame's origin, in mm in that frame.
  glm::dvec2 centred_mm{0.0, 0.0};
  int nx = 0;
  int ny = 0;
  std::vector<float> log_odds;  ///< [ny, nx], row-major
  /// Touches that sensed each cell, [ny, nx]; empty where they were not counted.
  std::vector<float> observations = {};
  /// Mean pressure at each cell, in the recordings' unit, [ny, nx]; 0 where nothing sensed it.
  /// Empty where pressures were not averaged.
  std::vector<float> mean_level = {};
  /// What the map was built from, for with_prior(); null where that is not known.
  std::shared_ptr<const MapSource> source = {};
  std::string file = {};  ///< that read_map() read it from; "" of any other map

  float at(int i, int j) const { return log_odds.begin()[std::ptrdiff_t{j} * nx + i]; }
  glm::dvec2 centre_mm(int i, int j) const { return origin_mm + cell_mm * glm::dvec2(i, j); }
  double prior_log_odds() const { return log_odds_from_probability(prior); }
};

/// The map's mirror image, x to -x, with its observations and mean levels.
PALPATE_API OccupancyGrid mirror_image(const OccupancyGrid& map);

/// Returns why a map is not sound, as one line of text that names the field, its value and the
/// remedy; none where the map is sound. A sound map has nx * ny log odds, at most `most_cells` of
/// them, finite and within `most_log_odds`; a cell and a spread within the bounds above; centres
/// within `farthest_mm`; a spread no larger than the grid; a prior between 0 and 1; a symmetry of
/// at least 0; a label other than `none_label`; and as many observations and mean levels as cells
/// or none, all finite and at least 0. Files, filters and all that reads cells refuse others.
PALPATE_API std::optional<std::string> fault_of(const OccupancyGrid& map);
/// Checks a map like fault_of(), except its log odds, which it need not hold yet.
PALPATE_API std::optional<std::string> fault_without_cells(const OccupancyGrid& map);
/// Checks a part of the map's log odds like fault_of(); `first` is the part's row-major index in
/// the map.
PALPATE_API std::optional<std::string> fault_of_cells(const OccupancyGrid& map, std::size_t first,
                                                      std::span<const float> log_odds);

/// Whether the object frame's origin lies on the map's cells.
PALPATE_API bool holds_origin(const OccupancyGrid& map);

/// Puts the object frame's origin on the cell nearest to the centroid of the occupied cells (log
/// odds > 0), with the axes as they were, so that poses tell where the object itself is. The cells
/// stay as they are. A map without an occupied cell keeps its frame.
PALPATE_API void centre_frame(OccupancyGrid& map);

/// Returns T_object_robot in the map's object frame, from one in the frame in which the object was
/// learned; they differ where centre_frame() was called.
PALPATE_API Pose in_centred_frame(const OccupancyGrid& map, const Pose& T_object_robot);

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
