#pragma once

#include "gpu/context.hpp"
#include "palpate/particle_filter.hpp"
#include "shaders/interface.h"

namespace palpate {

/// Throws Error on a number of particles, a region, a noise, a rate or a weight out of range.
void validate(const ParticleOptions& options);

/// Throws Error where the device cannot hold so many particles, before any memory is taken.
void require_room(const ParticleOptions& options, const gpu::Context& context);

}  // namespace palpate
