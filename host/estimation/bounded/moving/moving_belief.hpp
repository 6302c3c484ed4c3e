#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "estimation/bounded/moving/moving_object.hpp"
#include "estimation/bounded/moving/step_pace.hpp"
#include "estimation/bounded/moving/tile_choice.hpp"
#include "estimation/bounded/search/search_goal.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// What MovingBelief gives for the logarithm of no mass, whose product with the mass is a number;
/// a scale of some nats is added.
inline constexpr double no_mass = -1e9;

/// The belief about objects that slip between touches, b_n = L_n c_n W b_(n-1): W averages over
/// slips, c_n restores the object's mass, and L_n is the touch's likelihood. Bins of the tiles that
/// may matter are followed in float64. The others have upper bounds, which W and the tiles' bounds
/// of L_n take from touch to touch. docs/bounds_inside.md has the bound and its proof.
class MovingBelief {
 public:
  /// @param options checked, with a resolved contact model
  /// @param space with tiles of MovingObject::tile_bins; all of these outlive the belief
  MovingBelief(const SearchSpace& space, const BoundedOptions& options,
               const BinLikelihood& likelihood, std::span<const Hypothesis> hypotheses);
  MovingBelief(const MovingBelief&) = delete;  // its objects refer to it
  MovingBelief& operator=(const MovingBelief&) = delete;

  /// Host memory in bytes that so many objects take.
  static double bytes_needed(const BoundedOptions& options, std::size_t objects);

  void reset();
  /// Keeps one more touch for take_in().
  void add(KnownElements touch) { touches_.push_back(std::move(touch)); }
  /// Takes in the touches that were kept, each after a slip unless it is the first. A deadline lets
  /// them follow as many tiles as the time is enough for, and a few after it has passed. Begins
  /// anew the next time where the deadline's cancel point throws.
  void take_in(const Deadline& deadline);
  /// Takes them in, and follows more bins, from the first touch on, until the goal is reached, all
  /// are followed or the deadline leaves no time to begin anew.
  SearchResult find(const SearchGoal& goal, const Deadline& deadline);
  /// Shows the bins that are followed after take_in().
  void visit(const BinVisitor& visit) const;

  /// After take_in(): upper bounds of the log-likelihood of bins in nats, box after box, [y, x] in
  /// each: close where the belief is, and loose where a bin is not followed.
  std::vector<double> log_likelihood(std::span<const BinBox> boxes) const;
  /// The same bins' log-likelihood, close also where they are not followed, but no bound there; see
  /// MovingObject::log_belief().
  std::vector<double> close_log_likelihood(std::span<const BinBox> boxes) const;

 private:
  void start();
  void step(const KnownElements& touch, const Deadline& deadline);
  /// Sets the least bounds by the depth, and adds prior weights to the scales.
  /// @param tiles [object] MovingObject::tile_beliefs()
  void set_least(std::span<TileBeliefs> tiles) const;
  /// How many tiles the next touch may follow.
  std::size_t most_followed(bool slips, const Deadline& deadline) const;
  SearchResult result() const;
  bool reaches(const SearchResult& found, const SearchGoal& goal) const;

  const SearchSpace& space_;
  const BoundedOptions& options_;
  DisplacementWeights weights_;
  std::vector<double> log_mean_;  ///< memory that slips share
  std::vector<double> error_;
  std::vector<MovingObject> objects_;
  std::vector<KnownElements> touches_;
  /// Nats below all of the belief at which a tile is not followed.
  double depth_ = 0.0;
  std::size_t stepped_ = 0;  ///< touches that were taken in
  bool cut_short_ = false;   ///< a deadline left out tiles within the depth
  double spent_s_ = 0.0;     ///< on the touches that were taken in
  StepPace pace_;
  std::vector<std::size_t> followed_;  ///< [touch] tiles that it followed, by the last run
  bool again_ = false;                 ///< another run, which is to follow more
  double prior_log_likelihood_ = 0.0;  ///< of these
};

}  // namespace palpate
