#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/fit.hpp"
#include "palpate/lattice.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/touch.hpp"

/// The method of Pezzementi, Reyda and Hager (ICRA 2011) in plain float64 and in the paper's order.
/// Read this page first; every kernel is tested against it. It shares the product's data types,
/// with their units and frames, and none of the product's functions. It checks nothing.
///
///   e, e_max    pressure of an element; largest pressure of the touch
///   T, ratio    thresholds of the contact classifier
///   m           prior probability that a cell is occupied, the paper's p(m)
///   p, l        probability that a cell is occupied; its log odds, in nats
///   a, s        peak and standard deviation of G', the sensor's inverse point spread
///   gamma       probability that an element is classified at random
///   C, x        object and pose (x, y, theta) of a hypothesis; the pose is T_object_robot
///   w           weight of a particle
///   p_k         probability of bin k of the histogram
namespace palpate::reference {

// --- pose.cpp: Eq. 17-20 ---

/// p_a = R(theta) p_b + t, in mm.
glm::dvec2 transform(const Pose& T_a_b, const glm::dvec2& p_b);

/// Centroid and mean squared distance from it, J, of the map's cells with log odds > 0.
Body body_of(const OccupancyGrid& map);

/// Eq. 17-20 (Chirikjian and Zhou 1998): root mean squared displacement of the body between two
/// poses, sqrt(|centroid difference|^2 + 2 J (1 - cos dtheta)), in mm. The map's symmetry wraps
/// dtheta.
double pose_error_mm(const OccupancyGrid& map, const Pose& T_object_robot_estimate,
                     const Pose& T_object_robot_truth);

// --- map.cpp: Eq. 1-6 ---
// In Contact: e > T and e > ratio e_max. No Contact: e < T and e < ratio e_max. Unknown: otherwise.

/// Eq. 3: the class of every element, [e].
std::vector<Reading> classify(const Touch& touch, const ContactClassifier& classifier);
/// The class of every element, with In Contact at the levels of the model's table, [e].
std::vector<Reading> classify(const Touch& touch, const ContactModel& model);

// At a distance d from an element, G'(d) = a exp(-d^2 / (2 s^2)) (Eq. 4). The element alone makes
// p = m + (1 - m) G' In Contact, p = m - m G' with No Contact and p = m where Unknown (Eq. 5).

/// Eq. 1: l = log(p / (1 - p)).
double logit(double p);

/// Eq. 6: logit(p) - logit(m), what one element adds to the log odds of a cell at this distance.
double increment(Reading reading, double distance_mm, const InverseSensorModel& sensor);

/// Eq. 2 and 6: log odds of every cell, [ny, nx]: logit(m) plus the increments of all elements. No
/// Gaussian is cut off. The function reads the geometry of `grid` alone. The object frame is the
/// touches' robot frame.
std::vector<double> log_odds_map(std::span<const Touch> touches, const OccupancyGrid& grid,
                                 const ContactClassifier& classifier,
                                 const InverseSensorModel& sensor);

// --- likelihood.cpp: Eq. 7 ---
// In Contact: gamma m + (1 - gamma) p. No Contact: gamma m + (1 - gamma) (1 - p). Unknown: 1. The
// elements of a touch multiply, and so do touches.

/// Bilinear interpolation of the map's log odds; every cell beyond the map holds the prior's.
double interpolate(const OccupancyGrid& map, double prior, const glm::dvec2& p_object_mm);

/// Eq. 7 for one element, in nats, or the table in its place; the prior must be set for Eq. 7.
double log_likelihood(Reading reading, const MapSample& map, const ContactModel& model,
                      std::size_t object = 0);

/// Eq. 7 for all elements of a touch on an object at a pose, in nats. The prior is the map's where
/// the model has none. `object` says whose numbers of a table count.
double log_likelihood(const Touch& touch, const Pose& T_object_robot, const OccupancyGrid& map,
                      const ContactModel& model, std::size_t object = 0);

// --- prediction.cpp: fit and gain ---
// At a place the map predicts reading r with probability q(r), the likelihood of r over the sum of
// the likelihoods of all readings but Unknown. M and V are mean and variance of log-likelihood(r)
// under q. Over the known elements, z = sum (log-likelihood(reading) - M) / sqrt(sum V).

/// How well one object at one pose explains the touches; none where no element is known.
std::optional<Fit> fit_of(std::span<const Touch> touches, const Pose& T_object_robot,
                          const OccupancyGrid& map, const ContactModel& model,
                          std::size_t object = 0);

/// The fit where each touch by itself may have been displaced by delta, normally distributed. Per
/// touch: L(readings) = log E_delta prod P(reading), and M and V are mean and variance of L under
/// Q(readings) = E_delta prod q(reading). E_delta is a sum over a grid of displacements, M and V
/// are sums over all readings that the known elements could have had: for few elements.
std::optional<Fit> fit_of(std::span<const Touch> touches, const Pose& T_object_robot,
                          const OccupancyGrid& map, const ContactModel& model,
                          const DisplacementSd& touch_sd, std::size_t object = 0);

// Given sample i of the belief, with the probability w_i, element e reads z_e with the probability
// q(z_e | i), the likelihood of z_e over the sum of the likelihoods of all readings but Unknown;
// f(z | i) is the mean over displacements of the product over e. Then both = sum over i and z of
// w_i f(z | i) log(f(z | i) / f(z)) with f(z) = sum over i of w_i f(z | i).

/// An object at a pose, with its probability.
struct BeliefSample {
  std::size_t object = 0;
  std::size_t label = 0;
  Pose T_object_robot;
  double probability = 0.0;
};

/// Mutual information between one touch's readings and the unknown, in nats, by summing over all
/// readings of the array: few elements only.
struct Gain {
  double identity = 0.0;  ///< about the label
  double both = 0.0;      ///< about the sample
};
/// @param displacements of the sensor, of equal probability; one at 0 where touches are undisplaced
Gain expected_gain(std::span<const BeliefSample> samples, std::span<const OccupancyGrid> maps,
                   const Pose& T_robot_sensor, std::span<const glm::dvec2> elements_mm,
                   const ContactModel& model, std::span<const Pose> displacements);

// --- particles.cpp: Eq. 8-12 ---

/// A hypothesis (C, x, y, theta) with its weight.
struct Particle {
  int object = 0;
  Pose pose;
  double weight = 0.0;
};

/// Weights of particles, proportional to the likelihoods of Eq. 7, which are given in nats. The
/// weights sum to 1.
std::vector<double> importance_weights(std::span<const double> log_likelihoods);

/// Eq. 8-9: summed weight of the particles of every object, [objects].
std::vector<double> identity(std::span<const Particle> particles, int objects);

/// Eq. 10: max(0, 1 - d / rho) with d^2 = dx^2 + dy^2 + dtheta^2 and rho = 1 mm and 1 rad. dtheta
/// is at most half a turn.
double cone(const Pose& a, const Pose& b);

/// Eq. 11: Parzen density of one object at a pose, the sum of w cone over the object's particles.
double parzen(std::span<const Particle> particles, int object, const Pose& pose);

/// Eq. 12: the largest Parzen density of any object on a grid of 0.5 mm by 0.04 pi rad about the
/// origin, within `extent_mm` of it in x and y.
double largest_parzen(std::span<const Particle> particles, int objects, double extent_mm);

// --- histogram.cpp: Eq. 13-16 ---
// Every touch multiplies p_k by its likelihood at the bin's centroid (Eq. 13).

/// The pose of a bin's centroid (x, y, theta): p_o = R(theta) (p_r - pivot) + (x, y).
Pose bin_pose(const PoseLattice& lattice, std::int64_t bin);

/// Eq. 13 in logs: the touches' log-likelihood at every bin, [theta, y, x], in nats.
std::vector<double> log_likelihoods(std::span<const Touch> touches, const PoseLattice& lattice,
                                    const OccupancyGrid& map, const ContactModel& model,
                                    std::size_t object = 0);

// --- displaced.cpp: touches of uncertain pose, objects that slip, "none of these" ---
// G_sigma blurs every plane of a theta along y, then along x: weights exp(-(k step)^2 / (2
// sigma^2)) for steps k up to ceil(4 sigma / step), over the sum of those whose bin lies inside. An
// axis of one bin is not blurred, and a place keeps its coordinate on it.

/// f~(theta, t) = sum over alpha of w(alpha) (G_sigma * f(theta + alpha, .)) (t + (R(theta) -
/// R(theta + alpha)) r): one touch's log-likelihoods f, [theta, y, x], averaged over where the
/// sensor may have been. r is the sensor's origin relative to the pivot, in the robot frame. The
/// angles alpha are steps of theta, wrapped where theta covers the circle and left out where it
/// ends; a place between bins, rounded to 2^-20 of a bin, takes its four neighbours bilinearly, as
/// far as they lie inside; the sum is divided by that of all weights used.
std::vector<double> displaced_touch(const std::vector<double>& log_likelihood,
                                    const PoseLattice& lattice, const DisplacementSd& sd,
                                    const Pose& T_robot_sensor);

/// b~(theta, t) = sum over alpha of w(alpha) (G_sigma * b(theta + alpha, .)) (g + R(alpha) (t -
/// g)): one object's log-belief after the object has moved about its centroid g, of the same total.
std::vector<double> slipped(const std::vector<double>& log_belief, const PoseLattice& lattice,
                            const DisplacementSd& sd, const glm::dvec2& centroid_mm);

/// Whether the rectangle around the array's elements, parallel to the sensor's axes, meets the box
/// around the map's cells with log odds above 0, or around all of its cells where there are none.
/// Rectangles that come within 1e-3 mm meet.
bool overlaps(const Touch& touch, const Pose& T_object_robot, const OccupancyGrid& map);

/// Log evidence of "none of these" without its weight: log s + the sum over touches of the log of
/// the touch's mean likelihood, over the hypotheses by prior weight and over the bins at which the
/// array overlaps the object. s is the share of such bins at the first touch with a known element.
/// All bins count where a touch has no such bin.
/// @param log_likelihood [touch][object][bin], averaged where touches are uncertain
double none_log_evidence(std::span<const Touch> touches, const PoseLattice& lattice,
                         std::span<const Hypothesis> hypotheses,
                         const std::vector<std::vector<std::vector<double>>>& log_likelihood);

/// The belief over objects and bins: log-likelihoods [object][bin] and prior weights [object].
struct Posterior {
  PoseLattice lattice;
  std::vector<std::vector<double>> log_likelihood;
  std::vector<double> weight;
};

/// Eq. 14: probability of every object; sums to 1.
std::vector<double> identity(const Posterior& posterior);

/// Eq. 15-16: object and bin of the largest probability, the first among equals.
struct Mode {
  int object = 0;
  std::int64_t bin = 0;
};
Mode mode(const Posterior& posterior);

/// Probability of every (x, y) of one object, [ny, nx].
std::vector<double> marginal_xy(const Posterior& posterior, int object);
/// Probability of every theta of one object, [ntheta].
std::vector<double> marginal_theta(const Posterior& posterior, int object);

}  // namespace palpate::reference
