#pragma once

#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "gpu/context.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// Touches on objects, and how far a histogram of them may lie from float64.
struct LikelihoodCase {
  std::string name;
  std::vector<Hypothesis> objects;
  Recording recording;
  std::vector<PoseLattice> lattices;  ///< one after another, each in the place of the options'
  HistogramOptions options;
  double nats = per_touch;  ///< what a touch may add to the difference
  double share = 0.0;       ///< of the largest log-likelihood, which may be off as well
  std::string path;         ///< by which the likelihood must be evaluated
  std::size_t paths = 0;    ///< how many there must be, where it matters
  std::function<void(gpu::Limits&)> lower = {};  ///< makes the device a lesser one

  friend void PrintTo(const LikelihoodCase& of, std::ostream* out) { *out << of.name; }
};

/// Every way of a touch into a histogram, and every hard input: small and odd sizes, steep maps,
/// likelihoods without a floor, tables of a learned sensor, touches of uncertain pose, objects that
/// slip, lesser devices.
std::vector<LikelihoodCase> histogram_cases();
std::vector<LikelihoodCase> displaced_cases();  ///< those of uncertain poses and slips

/// The same for particles.
struct ParticleCase {
  std::string name;
  std::vector<Hypothesis> objects;
  Recording recording;
  ParticleOptions options;
  double nats = per_touch;
  std::size_t stride = 1;  ///< of the particles that are compared
  std::function<void(gpu::Limits&)> lower = {};

  friend void PrintTo(const ParticleCase& of, std::ostream* out) { *out << of.name; }
};
std::vector<ParticleCase> particle_cases();

/// Lattices of these steps in mm, whose first bin lies at no special place.
std::vector<PoseLattice> lattices_of(std::initializer_list<double> steps_mm, int nx, int ny,
                                     int thetas);

/// Each element has a place of its own at every touch; a fifth of them is dead.
Recording changing_array();

}  // namespace palpate
