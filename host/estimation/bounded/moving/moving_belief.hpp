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
  /// Keeps one more touch for take_in().
  void add(KnownElements touch) { touches_.push_back(std::move(touch)); }
  /// Takes in the touches that were kept, each after a slip unless it is the first. Begins anew the
  /// next time where the deadline's cancel point throws.
  void take_in(const Deadline& deadline);
  /// Takes them in, and follows more bins, from the first touch on, until the goal is reached or
  /// all are followed.
  SearchResult find(const SearchGoal& goal, const Deadline& deadline, const BinVisitor& visit);

  /// After take_in(): upper bounds of the log-likelihood of bins in nats, box after box, [y, x] in
  /// each: close where the belief is, and loose where a bin is not followed.
  std::vector<double> log_likelihood(std::span<const BinBox> boxes) const;
  std::uint64_t bytes() const;

 private:
  /// Logs of sums over an object's bins.
  struct Sums {
    double mass = 0.0;  ///< of what is followed
    double rest = 0.0;  ///< of what may be missing
    double kept = 0.0;  ///< of the mass that all bins have after a slip, before it is restored
    double off = 0.0;   ///< of that mass's differences from the mass, bin by bin
  };
  /// What all bins have of an object's bin after a slip; see SlipMean::kept().
  struct Kept {
    std::vector<double> part;
    double least = 1.0;
    double most = 1.0;
  };

  /// One object's belief but for its scale: every bin's belief b is within
  /// [e^-rounding log_mass, e^rounding log_mass + log_rest] times the scale.
  struct Moving {
    std::vector<double> log_mass;        ///< [bin] in nats; -infinity where it is not followed
    std::vector<double> log_rest;        ///< [bin] what may be missing
    std::vector<std::uint8_t> followed;  ///< [theta, y, x] of tiles
    std::int64_t bins_followed = 0;
    Sums sums;
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
  void slip(std::size_t object, std::span<const BlockRun> runs);
  /// What restores the object's mass after a slip.
  void restore(std::size_t object);
  void touch_bins(std::size_t object, const KnownElements& touch, std::span<const BlockRun> runs);
  /// @param set takes a bin, its log_mass and log_rest, and the largest error that no rest has
  void settle_bins(Moving& moving, std::span<const BlockRun> runs,
                   const std::function<void(std::size_t, double&, double&, double&)>& set);
  /// Leaves their upper bounds to tiles that are not followed.
  void leave_others(Moving& moving, std::span<const double> tiles) const;
  /// @param tiles upper bounds of a bin of each tile that is not followed
  Sums add_up(std::size_t object, std::span<const BlockRun> runs,
              std::span<const double> tiles) const;
  /// Bound of the error of the sums, in nats.
  double sum_error(std::span<const BlockRun> runs) const;
  SearchResult result() const;
  bool reaches(const SearchResult& found, const SearchGoal& goal) const;
  template <typename Visit>
  void for_bins(std::span<const BlockRun> runs, const Visit& visit) const;
  std::vector<BlockRun> runs_of(const Moving& moving) const;
  BinBox box_of(std::size_t object, const BlockRun& run) const;

  const SearchSpace& space_;
  const BoundedOptions& options_;
  const BinLikelihood& likelihood_;
  DisplacementWeights weights_;
  std::vector<SlipMean> of_bins_;   ///< [object]
  std::vector<SlipMean> of_tiles_;  ///< [object]
  std::vector<Kept> kept_;          ///< [object]
  int columns_;                     ///< of tiles
  int rows_;
  std::vector<double> log_bins_;  ///< [y, x] of a plane's tiles: log of their number of bins
  std::vector<KnownElements> touches_;
  /// Nats below all of the belief at which a tile is not followed.
  double depth_ = 0.0;
  std::size_t stepped_ = 0;            ///< touches that the belief has taken in
  double prior_log_likelihood_ = 0.0;  ///< of these
  std::vector<Moving> moving_;
  // Memory that slips share.
  std::vector<double> log_mean_;
  std::vector<double> log_rest_mean_;
  std::vector<double> error_;
};

}  // namespace palpate
