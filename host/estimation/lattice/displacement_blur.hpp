#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/lattice/dense_belief.hpp"
#include "estimation/two_float.hpp"
#include "gpu/command_stream.hpp"
#include "palpate/displacement.hpp"
#include "palpate/lattice.hpp"
#include "shaders/interface.h"

namespace palpate {

/// Means over small displacements, on the device: of a touch's likelihood, over where the sensor
/// may have been, or of a belief, over where the object may have slipped to. A Gaussian blurs each
/// plane of a theta along y and then along x; then neighbouring thetas are summed, each at the
/// place to which the turn moves a bin. Weights of bins outside the region are left out, and the
/// others divided by their sum.
class DisplacementBlur {
 public:
  enum class Of { touch, belief };

  /// Throws Error where the device cuts a plane of one theta into parts, or has too few thetas in a
  /// part of one object's bins.
  /// @param keep_touch whether sum_turns() leaves a touch's mean likelihood in the scratch belief
  DisplacementBlur(gpu::Context& context, gpu::CommandStream& stream, const PoseLattice& lattice,
                   std::size_t objects, const DisplacementSd& sd, Of of, bool keep_touch);

  /// Device memory in bytes that it takes, without the scratch belief.
  static std::uint64_t bytes_needed(const PoseLattice& lattice, std::size_t objects,
                                    const DisplacementSd& sd);
  std::uint64_t device_bytes() const;

  int theta_steps() const { return theta_steps_; }

  /// Records the blur along y and x.
  /// @param from a touch's log-likelihood in `scratch` itself, or a belief
  /// @param scratch holds the result
  /// @param references a log-likelihood of every object that values are relative to: 0 for a touch,
  /// the largest of a belief
  void blur_planes(const DenseBelief& from, const DenseBelief& scratch,
                   std::span<const TwoFloat> references);
  /// Records the sum over thetas of what blur_planes() has left in `scratch`: adds it to the belief
  /// (a touch), or replaces the belief by it.
  /// @param turns as touch_turns() or slip_turns() makes them
  void sum_turns(const DenseBelief& scratch, std::span<const shaders::Turn> turns,
                 const DenseBelief& belief);
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

  std::size_t planes() const {
    return objects_ * static_cast<std::size_t>(lattice_.theta_rad.count);
  }
  /// A touch that is not displaced along x and y stays as it is; of a belief, the difference from
  /// its largest is wanted.
  bool blurs_planes() const { return sd_.mm > 0.0 || of_ == Of::belief; }
  Pass make_pass(const Axis& axis, bool along_x);
  void run_pass(const Pass& pass, const DenseBelief& from, const DenseBelief& scratch,
                bool few_groups);
  void record_planes(const DenseBelief& from, const DenseBelief& scratch,
                     std::span<const TwoFloat> references, bool few_groups);
  void record_turns(const DenseBelief& scratch, std::span<const shaders::Turn> turns,
                    const DenseBelief& belief, bool few_groups);

  gpu::Context& context_;
  gpu::CommandStream& stream_;
  PoseLattice lattice_;
  std::size_t objects_;
  DisplacementSd sd_;
  Of of_;
  int theta_steps_;
  std::uint32_t lanes_;
  gpu::Kernel max_planes_;
  Pass along_y_;
  Pass along_x_;
  gpu::Kernel sum_turns_;
  std::uint32_t turn_rows_;     ///< bins along y of an invocation of sum_turns
  std::uint32_t turn_columns_;  ///< along x
  gpu::Buffer turns_;
  gpu::Buffer plane_max_;   ///< [object, theta], then the weights of theta
  gpu::Buffer references_;  ///< [object]
};

}  // namespace palpate
