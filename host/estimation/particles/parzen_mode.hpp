#pragma once

#include <cstdint>
#include <span>

#include "gpu/command_stream.hpp"
#include "shaders/interface.h"

namespace palpate {

/// Where the Parzen estimate is largest: a point of its grid, about the region's centre.
struct ParzenMaximum {
  std::uint32_t object = 0;
  double x_mm = 0.0;
  double y_mm = 0.0;
  double theta_rad = 0.0;
  double density = 0.0;  ///< sum of weight times cone, Eq. 11
};

/// The maximum of the Parzen estimate over particles (Eq. 10-12): a cone of rho = 1 mm and 1 rad,
/// d^2 = (dx^2 + dy^2) / mm^2 + dtheta^2 / rad^2, on a grid of 0.5 mm and 0.04 pi rad.
///
/// Particles are sorted by grid cell on the host and the device sums their cones at tiles of grid
/// points. A tile is left out where the particles in its reach weigh less than what has been found
/// elsewhere, for no cone is higher than 1: the heaviest tiles come first.
class ParzenMode {
 public:
  /// Runs the stream.
  /// @param most_particles that find() is given
  ParzenMode(gpu::Context& context, gpu::CommandStream& stream, std::size_t most_particles);

  /// Some particle must have a weight above 0. Of points whose densities differ by less than about
  /// 1e-5 of their value, any may be the answer; its density is exact.
  ParzenMaximum find(std::span<const shaders::Particle> particles, std::span<const double> weights);

  /// The most device memory that a find() has held at once; it gives all of it back.
  std::uint64_t peak_bytes() const { return peak_bytes_; }

 private:
  gpu::Context& context_;
  gpu::CommandStream& stream_;
  VkFormat texel_;  ///< of the particles as a table, or undefined where they are in storage
  gpu::Kernel sum_cones_;
  std::uint64_t peak_bytes_ = 0;
};

}  // namespace palpate
