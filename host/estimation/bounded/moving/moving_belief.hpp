#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/moving/slip_mean.hpp"
#include "estimation/bounded/search/search_goal.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// The belief about objects that slip between touches, b_n = L_n c_n W b_(n-1): W averages over
/// slips, c_n restores the object's mass, and L_n is the touch's likelihood. Bins of the tiles that
/// may matter are followed in float64. A tile's bins that are not followed have an upper bound in
/// common, which W and the tile's bound of L_n take from touch to touch. docs/bounds_inside.md has
/// the bound and its proof.
class MovingBelief {
 public:
  /// Bins of a tile along x and y.
  static constexpr int tile_bins = slip_tile_bins;
  static_assert(tile_bins == BlockRun::side);

  /// @param options checked, with a resolved contact model
  /// @param space with tiles of tile_bins; all of these outlive the belief
  MovingBelief(const SearchSpace& space, const BoundedOptions& options,
               const BinLikelihood& likelihood, std::span<const Hypothesis> hypotheses);

  /// Host memory in bytes that the bins of so many objects take.
  static double bytes_needed(const PoseLattice& lattice, std::size_t objects);

  void reset();
  /// Takes in one more touch, after a slip unless it is the first.
  void add(const KnownElements& touch);
  /// Follows more bins, from the first touch on, until the goal is reached or all are followed.
  SearchResult find(const SearchGoal& goal, const Deadline& deadline, const BinVisitor& visit);

  /// Upper bounds of the log-likelihood of bins in nats, box after box, [y, x] in each: close where
  /// the belief is, and loose where a bin is not followed.
  std::vector<double> log_likelihood(std::span<const BinBox> boxes) const;
  std::uint64_t bytes() const;

 private:
  /// One object's belief but for its scale: every bin's belief b is within
  /// [e^-rounding log_mass, e^rounding log_mass + log_rest] times the scale.
  struct Moving {
    std::vector<double> log_mass;        ///< [bin] in nats; -infinity where it is not followed
    std::vector<double> log_rest;        ///< [bin] what may be missing
    std::vector<std::uint8_t> followed;  ///< [theta, y, x] of tiles
    std::int64_t bins_followed = 0;
    double mass = 0.0;  ///< log of the sum of log_mass
    double rest = 0.0;
    double rounding = 0.0;
    // The scale makes up for what slips took from the object's mass; it lies between
    // e^(scale - under) and e^(scale + over).
    double scale = 0.0;
    double over = 0.0;
    double under = 0.0;
  };
  /// Upper bounds of the tiles of one object.
  struct TileMasses {
    std::vector<double> slipped;  ///< [theta, y, x] log of a bin's belief, after the slip
    std::vector<double> touched;  ///< and after the touch
  };

  void start();
  void step(const KnownElements& touch);
  TileMasses bound_tiles(std::size_t object, const KnownElements& touch) const;
  std::vector<double> largest_of_tiles(const Moving& moving) const;
  void add_touch_bounds(std::size_t object, const KnownElements& touch,
                        std::vector<double>& logs) const;
  /// Which tiles to follow through the touch.
  void choose(std::span<const TileMasses> tiles);
  /// @param tiles,runs TileMasses::slipped; the tiles that are followed
  void slip(std::size_t object, std::span<const double> tiles, std::span<const BlockRun> runs);
  void touch_bins(std::size_t object, const KnownElements& touch, std::span<const BlockRun> runs);
  /// @param set takes a bin, its log_mass and log_rest, and the largest error that no rest has
  void settle_bins(Moving& moving, std::span<const BlockRun> runs,
                   const std::function<void(std::size_t, double&, double&, double&)>& set);
  /// Leaves their upper bounds to tiles that are not followed.
  void leave_others(Moving& moving, std::span<const double> tiles) const;
  /// Logs of the sums of mass and rest.
  /// @param tiles upper bounds of a bin of each tile that is not followed
  std::pair<double, double> add_up(const Moving& moving, std::span<const BlockRun> runs,
                                   std::span<const double> tiles) const;
  /// Bound of the error of the sums, in nats.
  double sum_error(std::span<const BlockRun> runs) const;
  SearchResult result() const;
  bool reaches(const SearchResult& found, const SearchGoal& goal) const;
  template <typename Visit>
  void for_bins(std::span<const BlockRun> runs, const Visit& visit) const;
  std::vector<BlockRun> runs_of(const Moving& moving) const;
  BinBox box_of(std::size_t object, const BlockRun& run) const;
  int bins_of_tile(int x, int y) const;

  const SearchSpace& space_;
  const BoundedOptions& options_;
  const BinLikelihood& likelihood_;
  DisplacementWeights weights_;
  std::vector<SlipMean> of_bins_;   ///< [object]
  std::vector<SlipMean> of_tiles_;  ///< [object]
  int columns_;                     ///< of tiles
  int rows_;
  std::vector<KnownElements> touches_;
  /// Nats below all of the belief at which a tile is not followed.
  double depth_ = 0.0;
  std::size_t stepped_ = 0;  ///< touches that the belief has taken in
  double prior_log_likelihood_ = 0.0;  ///< of these
  std::vector<Moving> moving_;
  // Memory that slips share.
  std::vector<double> log_mean_;
  std::vector<double> log_rest_mean_;
  std::vector<double> error_;
};

}  // namespace palpate
