#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "gpu/context.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/shared_device.hpp"
#include "support/synthetic.hpp"

namespace palpate {

// Objects, devices and what filters tell, for the tests of this folder.

/// What the method allows a mean likelihood to differ from float64, in nats per touch.
inline constexpr double per_mean = 1e-3;

/// Objects of different cells, extents and prior weights.
std::vector<Hypothesis> three_objects();

/// A lattice on which an array near the origin meets such objects at most bins.
PoseLattice small_lattice();

/// A device whose limits `lower` makes smaller.
Device lowered_device(const std::function<void(gpu::Limits&)>& lower);

/// All that a filter tells: beliefs, marginals, identities and the mode, or particles.
std::vector<std::vector<double>> all_answers(const PoseHistogram& histogram);
std::vector<std::vector<double>> all_answers(const ParticleFilter& filter);

/// The log odds of "none of these", by its definition and by a histogram. Its own evidence takes
/// touches as if they lay where the robot says.
double expected_log_odds_of_none(std::span<const Hypothesis> objects,
                                 const HistogramOptions& options, std::span<const Touch> touches);
double log_odds_of_none(const PoseHistogram& histogram);

std::vector<double> weights_of(const ParticleFilter& filter);

/// Largest difference in nats between the particles' weights and the reference's likelihoods of one
/// touch at their poses, both relative to the mean, over every `stride`-th particle that has any
/// weight; at least one has.
double weight_error(const ParticleFilter& filter, const Touch& touch,
                    std::span<const Hypothesis> objects, const ParticleOptions& options,
                    std::size_t stride = 1);

}  // namespace palpate
