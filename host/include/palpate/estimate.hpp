#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// An object that the unknown may turn out to be.
struct Hypothesis {
  OccupancyGrid map;
  double weight = 1.0;  ///< prior weight, relative to the other objects'
  /// What readings are compared with in the place of the map: a grid of the same object frame whose
  /// `log_odds` the contact model's table is over, see reading_layer(). The body and the extent of
  /// the object remain the map's.
  std::optional<OccupancyGrid> layer = {};
  bool mirrored = false;  ///< the map is the mirror image (x to -x) of the one that was learned

  const OccupancyGrid& compared() const { return layer ? *layer : map; }
};

/// Puts behind every hypothesis whose map has `mirror` its mirror image, Hypothesis::mirrored, and
/// gives each of the two half the weight. To be called once, before apply() of a sensor model: no
/// filter looks at `mirror`.
PALPATE_API void add_mirror_images(std::vector<Hypothesis>& hypotheses);

/// Index of the first hypothesis whose map's prior differs from the first map's; none where all
/// agree. Maps recognised together share one prior, unless the contact model says which one to use.
PALPATE_API std::optional<std::size_t> differing_prior(std::span<const Hypothesis> hypotheses);

/// The pose of the largest posterior probability (Eq. 15-16).
struct Mode {
  int object = 0;                        ///< index into the hypotheses
  std::optional<std::int64_t> bin = {};  ///< index into the lattice, where the filter has bins
  Pose T_object_robot;                   ///< the bin's centre, where there is a bin
  double log_likelihood = 0.0;           ///< of all touches, without prior weights, in nats
};

/// The bounds of a probability.
struct ProbabilityInterval {
  double low = 0.0;
  double high = 1.0;
};

/// The bounds of a logarithm, in nats.
struct LogInterval {
  double low = 0.0;
  double high = 0.0;
};

/// What a search by bounds proves of its estimate.
struct Certificate {
  /// Bound of the total variation distance between the estimate and the posterior over all bins:
  /// the mass of the bins that were not evaluated, and the rounding of those that were.
  double dropped_mass = 0.0;
  /// Log of each hypothesis's prior weight times the summed likelihood of its bins, in nats,
  /// [hypothesis]: bounds.
  std::vector<LogInterval> log_evidence = {};
  bool mode_certain = false;        ///< no bin that was not evaluated can exceed the mode
  std::int64_t blocks_bounded = 0;  ///< blocks of bins whose bound was computed
  /// Bins whose likelihood was computed. Those at which every element sees the prior are settled
  /// without.
  std::int64_t bins_evaluated = 0;
  /// Bounds of the log evidence of "none of these" with its prior weight, in nats, comparable to
  /// log_evidence. None where the options do not ask for "none of these".
  std::optional<LogInterval> none_log_evidence = {};
};

/// An object and its pose, drawn from a belief.
struct PoseSample {
  int object = 0;  ///< index into the hypotheses
  Pose T_object_robot;
};

/// A bin of the lattice, and what share of its object's belief it holds.
struct BinShare {
  std::int64_t bin = 0;  ///< index into the lattice
  double share = 0.0;    ///< all bins of the object together sum to 1
};

/// What the belief says about the unknown object, after any number of touches.
struct Estimate {
  std::vector<double> identity;  ///< probability of every hypothesis, Eq. 14; with `none` sums to 1
  /// Bounds of every probability in `identity`, from a filter that knows no more than the bounds;
  /// empty where `identity` is exact.
  std::vector<ProbabilityInterval> identity_bounds = {};
  std::optional<Certificate> certificate = {};  ///< from a filter that knows bounds
  double none = 0.0;  ///< probability of "none of these", where the options ask for it
  /// Log of each hypothesis's prior weight times its summed likelihood, in nats, but for a constant
  /// that all share: `identity` is their share. Exact where a probability is too small for a
  /// number. By bounds the evidence of the evaluated bins. -infinity where a bounded search
  /// evaluated no bin, or no particle is left of the hypothesis.
  std::vector<double> log_evidence = {};
  /// Log evidence of "none of these", on the scale of log_evidence, where the options ask for it.
  std::optional<double> none_log_evidence = {};
  Mode mode;
  /// True where a map that holds only the prior explains the touches better, by more than 700 nats,
  /// than the best bin of any object (particle filter: than the best particle of each touch). The
  /// object, its pose or the sensor model is then none of the hypotheses; `identity` and `mode`
  /// name the least impossible.
  bool contradicted = false;
};

/// Probabilities of parts of one object's poses, over a grid that may be coarser than the belief.
struct Marginals {
  PoseLattice grid;
  std::vector<double> xy;     ///< of every (x, y) of the grid, summed over theta, [ny, nx]
  std::vector<double> theta;  ///< of every theta of the grid, summed over (x, y), [ntheta]
};

/// Where the posterior peaks near a mode, to a fraction of a bin, with its uncertainty.
struct RefinedPose {
  Pose T_object_robot;
  /// Covariance of (x_mm, y_mm, theta_rad) of T_object_robot, row by row, in mm^2, mm rad and
  /// rad^2.
  std::array<double, 9> covariance{};
};

/// How far poses are off where a belief is sure of them, as left-out touches show it.
struct PoseScale {
  /// Multiplies covariances, but for what displaced touches and slips add to them. Eq. 7 is surer
  /// of a reading, or less, than the sensor deserves, and readings of neighbouring elements are no
  /// news to each other.
  double factor = 1.0;
  /// What all touches share, since it is the map that is off: the standard deviation along each
  /// axis of the body's motion (its centroid's shift, and its turn as a displacement), mm.
  double map_sd_mm = 0.0;
};

/// A refined pose as a robot acts on it: the object's frame in the robot's.
struct PALPATE_API ObjectPose {
  Pose T_robot_object;
  /// Covariance of (x_mm, y_mm, theta_rad) of T_robot_object, row by row, in mm^2, mm rad and
  /// rad^2.
  std::array<double, 9> covariance{};

  /// Standard deviations of (x_mm, y_mm, theta_rad), in mm, mm and rad.
  std::array<double, 3> sd() const;
};

/// T_robot_object from T_object_robot; the covariance is carried over to first order, by the
/// Jacobian of the inverse. A robot frame whose origin is L mm away makes x and y of T_object_robot
/// vary by L times the deviation of theta, all but what their correlation with theta takes back;
/// x and y of T_robot_object are those of the object frame's origin and have no such part. The
/// difference of the two rounds to about 1e-16 L^2 times the variance of theta, in mm^2.
PALPATE_API ObjectPose inverse(const RefinedPose& refined);

/// What one touch is expected to tell, in nats: the mutual information between its readings and the
/// unknown, given the touches so far. By the chain rule, information about (object, pose) is that
/// about the object plus that about the pose once the object is known.
/// Estimates, none of them below 0.
struct TouchGain {
  /// Standard errors of the estimates, from the spread over simulated readings; what too few
  /// samples cannot show is not in them.
  struct StandardError {
    double identity = 0.0;
    double pose = 0.0;
    double both = 0.0;
  };

  double identity = 0.0;  ///< about which object it is
  double pose = 0.0;      ///< about the pose, given the object
  StandardError standard_error = {};
  /// About object and pose together.
  double both() const { return identity + pose; }
};

/// How expected_gain() of PoseHistogram and BoundedPosterior estimates.
struct PlanOptions {
  /// Objects and poses that stand for the belief. No gain exceeds the log of their number. The
  /// time grows with the square of the number.
  std::size_t samples = 96;
  std::uint64_t seed = 0;  ///< of the samples and the simulated readings
  /// [hypothesis] objects of equal numbers count as one: maps of one label, which no touch needs to
  /// tell apart. Empty: every hypothesis is an object of its own.
  std::vector<std::size_t> label_of = {};
};

}  // namespace palpate
