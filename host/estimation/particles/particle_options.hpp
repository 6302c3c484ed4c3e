#pragma once

#include <span>
#include <vector>

#include "gpu/context.hpp"
#include "palpate/estimate.hpp"
#include "palpate/particle_filter.hpp"
#include "shaders/interface.h"

namespace palpate {

/// A probability in units of 2^-32.
shaders::uint in_words(double probability);

/// Throws Error on a number of particles, a region, a noise, a rate or a weight out of range.
void validate(const ParticleOptions& options);

/// Throws Error where the device cannot hold so many particles, before any memory is taken.
void require_room(const ParticleOptions& options, const gpu::Context& context);

/// The parts of the objects in the initial distribution.
std::vector<shaders::ObjectShare> object_shares(std::span<const Hypothesis> hypotheses,
                                                const ParticleOptions& options);

}  // namespace palpate
