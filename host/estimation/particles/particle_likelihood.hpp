#pragma once

#include <span>
#include <vector>

#include "estimation/kernel_inputs.hpp"
#include "estimation/known_elements.hpp"
#include "gpu/command_stream.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// Half the width and the middle of a range.
inline double half(const Axis& axis) { return (axis.upper - axis.lower) / 2.0; }
inline double centre(const Axis& axis) { return axis.lower + half(axis); }

/// The log-likelihood of a touch (Eq. 7) at particles that each have an object and a pose of their
/// own. All maps stand in one buffer, so that one dispatch weighs all particles.
class ParticleLikelihood {
 public:
  /// Most elements that one run may hold. The table's least guaranteed size, less the headings,
  /// holds this many elements at 15 cell sizes.
  static constexpr std::size_t longest_run = 4096;
  static_assert(longest_run <= gpu::most_iterations / 2);

  /// Records the upload of the maps.
  /// @throws Error where the maps together are more than one buffer of the device holds
  ParticleLikelihood(gpu::Context& context, gpu::CommandStream& stream,
                     std::span<const Hypothesis> hypotheses, const PoseLattice& region,
                     const ContactModel& model);

  /// Records the weighing of `count` particles, shaders::Particle about the region's centre, by one
  /// touch, all alike where it has no known element. Where it has very many, runs the stream in
  /// between.
  void weigh(const KnownElements& known, const gpu::Buffer& particles, std::size_t count,
             const gpu::Buffer& log_weights);

  std::uint64_t device_bytes() const;

 private:
  /// Makes room for this many elements per cell size.
  void reserve(std::size_t elements);

  gpu::Context& context_;
  gpu::CommandStream& stream_;
  double theta_centre_rad_ = 0.0;
  std::vector<double> cell_sizes_mm_;  ///< of the maps, each once
  BorderedMaps maps_;
  gpu::Kernel kernel_;
  ContactTable contact_;
  gpu::Buffer objects_;
  gpu::Buffer turns_;  ///< headings, then the elements in cells, [cell size, element]
  gpu::Buffer segments_;
  std::vector<glm::dvec2> turned_mm_;          ///< the elements, turned to the region's centre
  std::vector<shaders::Segment> batch_;        ///< what goes to segments_
  std::vector<shaders::CoarseAndFine> table_;  ///< what goes to turns_
};

}  // namespace palpate
