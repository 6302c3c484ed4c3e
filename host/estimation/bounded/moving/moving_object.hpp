#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/moving/slip_mean.hpp"
#include "estimation/bounded/moving/tile_choice.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"

namespace palpate {

/// What the objects of a belief that slips share; it outlives them.
struct SlipTask {
  const SearchSpace& space;  ///< with tiles of MovingObject::tile_bins
  const PoseLattice& lattice;
  const BinLikelihood& likelihood;
  const DisplacementWeights& weights;  ///< of the slip
  // Memory that slips share, [bin].
  std::vector<double>& log_mean;
  std::vector<double>& error;
};

/// The belief about one object that slips between touches, but for a factor, its scale. Bins of
/// some tiles are followed in float64; the others have an upper bound that a tile's bins share.
/// Every bin's belief is within [e^-rounding log_mass, e^rounding log_mass + log_rest] times the
/// scale.
class MovingObject {
 public:
  /// Bins of a tile along x and y.
  static constexpr int tile_bins = slip_tile_bins;
  static_assert(tile_bins == BlockRun::side);

  MovingObject(const SlipTask& task, std::size_t object, const glm::dvec2& centroid_mm);

  /// Returns to the uniform belief, all of it followed.
  void start();
  /// Belief in each tile, [theta, y, x], after a slip, unless `slips` is false, and the touch; with
  /// scale(), but without least.
  /// @param known asks for TileBeliefs::known
  TileBeliefs tile_beliefs(const KnownElements& touch, bool slips, bool known) const;
  /// Goes through the slip and the touch.
  /// @param tiles tile_beliefs() of these
  /// @param followed [tile] 1 where its bins are followed
  /// @param by_logs also bins whose mass float64 does not hold beside their surroundings'
  void step(const KnownElements& touch, bool slips, const TileBeliefs& tiles,
            std::vector<std::uint8_t> followed, bool by_logs);

  /// Upper bound of a bin's log-likelihood, in nats: close where it is followed.
  double most(std::int64_t bin) const;
  /// Log-likelihood of the bins of some boxes of this object, box after box, [y, x] in each: no
  /// bound of it, but what is known, and where more may be missing, no less than if the object had
  /// always been within the boxes' tiles.
  /// @param touches that step() went through
  std::vector<double> log_belief(std::span<const BinBox> boxes,
                                 std::span<const KnownElements> touches) const;

  /// The tiles that are followed, in runs along x.
  std::span<const BlockRun> runs() const { return runs_; }
  BinBox box_of(const BlockRun& run) const;
  /// [bin] log of the followed part; -infinity where there is none.
  const std::vector<double>& log_mass() const { return log_mass_; }
  /// [bin] log of what may be missing.
  const std::vector<double>& log_rest() const { return log_rest_; }
  /// Logs of the sums of both.
  double mass() const { return sums_.mass; }
  double rest() const { return sums_.rest; }
  /// Bound of the error of log_mass() and of its sum, in nats.
  double rounding() const;
  /// The scale is within e^(scale - under) and e^(scale + over).
  double scale() const { return scale_; }
  double over() const { return over_; }
  double under() const { return under_; }
  std::size_t tiles() const { return followed_.size(); }

  template <typename Visit>
  void for_bins(std::span<const BlockRun> runs, const Visit& visit) const {
    for (const BlockRun& run : runs) {
      const BinBox box = box_of(run);
      for (int y = 0; y < box.y_count; ++y) {
        const auto first =
            static_cast<std::size_t>(box.bin(std::int64_t{y} * box.x_count, task_.lattice));
        for (std::size_t bin = first; bin < first + static_cast<std::size_t>(box.x_count); ++bin) {
          visit(bin);
        }
      }
    }
  }

 private:
  /// Logs of sums over the object's bins.
  struct Sums {
    double mass = 0.0;
    double rest = 0.0;
    double kept = 0.0;  ///< of the mass that all bins have after a slip, before it is restored
    double off = 0.0;   ///< of its differences from the mass, bin by bin
  };

  /// [tile] the most mass of a bin, with what may be missing unless only the known is asked for.
  std::vector<double> largest_of_tiles(bool known) const;
  /// [tile] upper bound of the touch's log-likelihood.
  std::vector<double> touch_bounds(const KnownElements& touch) const;
  void follow(std::vector<std::uint8_t> tiles);
  void slip(bool by_logs);
  void restore();
  /// Leaves the touch's log-likelihood at the tiles' bins, and its error, in the shared memory.
  void evaluate(const KnownElements& touch, std::span<const BlockRun> runs) const;
  void multiply(const KnownElements& touch);
  std::size_t tile_of(std::int64_t bin) const;
  /// [tile] not 0 where it is to be among the runs.
  std::vector<BlockRun> runs_of(std::span<const std::uint8_t> wanted) const;
  /// [bin] log-likelihood, but for the scale, of an object that has always been in these tiles.
  std::vector<double> belief_within(std::span<const BlockRun> runs,
                                    std::span<const KnownElements> touches) const;
  /// @param set takes a bin, its log_mass and log_rest, and the largest error that no rest has
  template <typename Set>
  void change_bins(const Set& set);
  /// Leaves the bins of tiles that are not followed their bounds.
  void leave_others(const TileBeliefs& tiles);
  void add_up(const TileBeliefs& tiles);
  /// Log of a tile's number of bins.
  double log_bins_of(std::size_t tile) const {
    return log_tile_bins_[tile % log_tile_bins_.size()];
  }

  SlipTask task_;
  std::size_t object_;
  SlipMean of_bins_;
  SlipMean of_tiles_;
  int columns_;  ///< of tiles
  int rows_;
  std::vector<double> log_tile_bins_;  ///< [y, x] log of a tile's number of bins
  std::vector<double> kept_;           ///< SlipMean::kept()
  double least_kept_;
  double most_kept_;

  std::vector<double> log_mass_;
  std::vector<double> log_rest_;
  std::vector<double> before_;          ///< log_mass() before the last step
  std::vector<std::uint8_t> followed_;  ///< [theta, y, x] of tiles
  std::vector<BlockRun> runs_;
  Sums sums_;
  double rounding_ = 0.0;
  double scale_ = 0.0;
  double over_ = 0.0;
  double under_ = 0.0;
};

}  // namespace palpate
