#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/displacement_weights.hpp"
#include "estimation/kernel_sizes.hpp"
#include "estimation/lattice/dense_belief.hpp"
#include "gpu/command_stream.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"
#include "shaders/interface.h"

namespace palpate {

/// Means over small displacements, on the device: of a touch's likelihood, over where the sensor
/// may have been, or of a belief, over where the object may have slipped to. A Gaussian blurs each
/// plane of a theta along y and then along x; then neighbouring thetas are summed, each at the
/// place to which the turn moves a bin. Weights of bins outside the region are left out, and the
/// others divided by their sum.
class DisplacementBlur {
 public:
  /// Throws Error where the device cuts a plane of one theta into parts, or has too few thetas in a
  /// part of one object's bins.
  /// @param slip_centroids_mm of a belief's blur: every object's centroid, in its frame; empty for
  /// that of touches
  DisplacementBlur(gpu::Context& context, gpu::CommandStream& stream, const PoseLattice& lattice,
                   std::size_t objects, const DisplacementSd& sd,
                   std::span<const glm::dvec2> slip_centroids_mm);

  std::uint64_t device_bytes() const;

  /// Records the blur along y and x.
  /// @param from a touch's log-likelihood in `scratch` itself, or a belief
  /// @param scratch holds the result
  /// @param references a log-likelihood of every object that values are relative to: 0 for a touch,
  /// the largest of a belief
  void blur_planes(const DenseBelief& from, const DenseBelief& scratch,
                   std::span<const TwoFloat> references);
  /// Sets where touches are taken from as theta grows by k steps: t + (R(theta) - R(theta + alpha))
  /// r.
  /// @param sensor_from_pivot_mm r: the sensor's origin relative to the pivot, in the robot frame
  void turn_for(const glm::dvec2& sensor_from_pivot_mm);
  /// Records the sum over thetas of what blur_planes() has left in `scratch`: adds it to the belief
  /// (a touch), or replaces the belief by it.
  void sum_turns(const DenseBelief& scratch, const DenseBelief& belief);
  /// Runs every kernel once, on a workgroup each: drivers compile them then, and no touch has to
  /// wait for that. What the beliefs hold afterwards is of no use.
  void warm_up(const DenseBelief& scratch, const DenseBelief& belief);

 private:
  /// A pass along an axis, with its weights and norms on the device.
  struct Pass {
    gpu::Kernel kernel;
    gpu::Buffer weights;
    gpu::Buffer norms;
    std::int64_t invocations = 0;  ///< of a plane
  };

  const PoseLattice& lattice() const { return weights_.lattice(); }
  std::size_t planes() const {
    return objects_ * static_cast<std::size_t>(lattice().theta_rad.count);
  }
  /// A touch that is not displaced along x and y stays as it is; of a belief, the difference from
  /// its largest is wanted.
  bool blurs_planes() const { return weights_.sd().mm > 0.0 || slips_; }
  std::uint32_t source() const { return slips_ ? shaders::BLUR_BELIEF : shaders::BLUR_TOUCH; }
  Pass make_pass(const Axis& axis, bool along_x);
  void run_pass(const Pass& pass, const DenseBelief& from, const DenseBelief& scratch);
  /// Workgroups for so many lanes in each plane of a slab; one while kernels are only compiled.
  std::array<std::uint32_t, 3> groups(std::int64_t lanes, const Slab& slab) const;

  gpu::Context& context_;
  gpu::CommandStream& stream_;
  DisplacementWeights weights_;
  std::size_t objects_;
  bool slips_;
  bool warming_up_ = false;
  std::uint32_t lanes_;  ///< of a workgroup
  gpu::Kernel max_planes_;
  Pass along_y_;
  Pass along_x_;
  gpu::Kernel sum_turns_;
  std::uint32_t turn_rows_;     ///< bins along y that an invocation of sum_turns takes
  std::uint32_t turn_columns_;  ///< along x
  gpu::Buffer turns_;
  gpu::Buffer plane_max_;   ///< [object, theta], then weights of theta and their logarithms
  gpu::Buffer references_;  ///< [object]
  /// What goes to turns_: of a touch [theta, k], of a slip [object, k].
  std::vector<shaders::TurnedPlane> host_turns_;
  std::vector<Tap> taps_;  ///< of a theta; kept, so that a touch allocates nothing
};

}  // namespace palpate
