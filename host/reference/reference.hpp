#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact.hpp"
#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/sensor_model.hpp"
#include "palpate/touch.hpp"

/// The method of Pezzementi, Reyda and Hager (ICRA 2011) in plain float64, in the paper's order:
/// what to read first, and what every kernel is tested against. It shares the product's data types
/// and none of its functions. Units and frames are those of the types; nothing is checked.
///
///   e, e_max    pressure of an element; the largest of the touch
///   m           p(m), the prior probability that a cell is occupied
///   l           log odds of a cell in nats: log(p / (1 - p))
///   G'          inverse of the sensor's point spread: peak a, standard deviation s
///   gamma       probability that an element is classified at random
///   C, x        object and pose (x, y, theta) of a hypothesis: T_object_robot
///   w           weight of a particle
///   p_k         probability of bin k, at whose centroid Eq. 7 is evaluated
namespace palpate::reference {

/// p_a = R(theta) p_b + t, in mm.
glm::dvec2 transform(const Pose& T_a_b, const glm::dvec2& p_b);

/// p_b = R(-theta) (p_a - t), in mm.
glm::dvec2 transform_back(const Pose& T_a_b, const glm::dvec2& p_a);

// --- contact.cpp: Eq. 3 ---

/// Eq. 3: the class of every element, [e].
std::vector<Reading> classify(const Touch& touch, const ContactClassifier& classifier);

// --- map.cpp: Eq. 1, 2, 4-6 ---

/// Eq. 1: log odds of a probability.
double logit(double p);

/// Eq. 4-6: log-odds increment in nats of a cell at this distance from an element's centre.
double increment(Reading reading, double distance_mm, const InverseSensorModel& sensor);

/// Eq. 2 and 6: log odds of every cell of a grid, [ny, nx], of which only the geometry is read: the
/// prior and the increments of all elements, with no Gaussian cut off. The object frame is the
/// touches' robot frame.
std::vector<double> log_odds_map(std::span<const Touch> touches, const OccupancyGrid& grid,
                                 const ContactClassifier& classifier,
                                 const InverseSensorModel& sensor);

// --- likelihood.cpp: Eq. 7 ---

/// Bilinear interpolation of the map's log odds; every cell beyond the map holds the prior's.
double interpolate(const OccupancyGrid& map, double prior, const glm::dvec2& p_object_mm);

/// Eq. 7 for one element, in nats.
double log_likelihood(Reading reading, double log_odds, const ContactLikelihood& model);

/// Eq. 7 for all elements of a touch on an object at a pose, in nats.
double log_likelihood(const Touch& touch, const Pose& T_object_robot, const OccupancyGrid& map,
                      const ContactClassifier& classifier, const ContactLikelihood& model);

// --- particles.cpp: Eq. 8-12 ---

/// x^[m] = (C, x, y, theta) and its weight w^[m].
struct Particle {
  int object = 0;
  Pose pose;
  double weight = 0.0;
};

/// Weights of particles by their log-likelihoods of Eq. 7, in nats; they sum to 1.
std::vector<double> importance_weights(std::span<const double> log_likelihoods);

/// Eq. 8-9: summed weight of the particles of every object, [objects].
std::vector<double> identity(std::span<const Particle> particles, int objects);

/// Eq. 10 with rho = 1 mm and 1 rad; angles differ by at most half a turn.
double cone(const Pose& a, const Pose& b);

/// Eq. 11: Parzen density of one object at a pose.
double parzen(std::span<const Particle> particles, int object, const Pose& pose);

/// Eq. 12: the largest Parzen density of any object on a grid of 0.5 mm by 0.04 pi rad about the
/// origin, within `extent_mm` of it in x and y.
double largest_parzen(std::span<const Particle> particles, int objects, double extent_mm);

// --- histogram.cpp: Eq. 13-16 ---

/// The centroid of a bin as a pose: p_o = R(theta) (p_r - pivot) + (x, y).
Pose bin_pose(const PoseLattice& lattice, std::int64_t bin);

/// Eq. 13 in logs: the touches' log-likelihood at every bin, [theta, y, x], in nats.
std::vector<double> log_likelihoods(std::span<const Touch> touches, const PoseLattice& lattice,
                                    const OccupancyGrid& map, const ContactClassifier& classifier,
                                    const ContactLikelihood& model);

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

// --- pose_error.cpp: Eq. 17-20 ---

/// Centroid and mean squared distance from it, J, of the map's cells with log odds > 0.
Body body_of(const OccupancyGrid& map);

/// Eq. 17-20 of Chirikjian and Zhou 1998: root mean squared displacement in mm of the map's
/// occupied cells between two poses, with the turn wrapped by the map's symmetry.
double pose_error_mm(const OccupancyGrid& map, const Pose& T_object_robot_estimate,
                     const Pose& T_object_robot_truth);

}  // namespace palpate::reference
