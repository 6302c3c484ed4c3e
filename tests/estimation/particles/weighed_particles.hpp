#pragma once

#include <cstddef>
#include <vector>

#include "palpate/particle_filter.hpp"
#include "support/synthetic.hpp"

namespace palpate {

/// Objects of different cells, extents and prior weights.
std::vector<Hypothesis> three_objects();

std::vector<double> weights_of(const ParticleFilter& filter);

/// Largest difference in nats between the particles' weights and the reference's likelihoods of one
/// touch at their poses, both relative to the mean, over every `stride`-th particle.
double weight_error(const ParticleFilter& filter, const Touch& touch,
                    const std::vector<Hypothesis>& objects, const ParticleOptions& options,
                    std::size_t stride = 1);

}  // namespace palpate
