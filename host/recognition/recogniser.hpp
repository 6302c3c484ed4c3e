#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "recognition_task.hpp"

namespace palpate {

/// The filter of a task, whichever the task names. Every function that can throws Error as the
/// filter's own does.
class Recogniser {
 public:
  Recogniser(Device& device, const RecognitionTask& task);

  /// Forgets all touches, for the next unknown. Particles begin as the same particles again.
  void reset();
  /// Updates the belief with these touches. `progress`, where there is one, is called with the
  /// fraction done, now and then.
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  /// Evaluates a touch that is likely to come next; does nothing to particles, whose weighing also
  /// moves and draws them.
  void prepare(const Touch& touch);
  Estimate estimate() const;
  /// The mode's pose between the bins; none of particles.
  std::optional<RefinedPose> refine(const Mode& mode) const;
  /// Of the particles; none of a histogram.
  std::optional<double> effective_sample_size() const;
  /// Probability of every (x, y) of one object over the task's lattice, [ny, nx].
  std::vector<double> marginal_xy(int object) const;
  std::uint64_t device_bytes() const;

  /// The histogram, or nullptr where particles were asked for.
  const PoseHistogram* histogram() const { return std::get_if<PoseHistogram>(&filter_); }

 private:
  PoseLattice lattice_;
  std::variant<PoseHistogram, ParticleFilter> filter_;
};

}  // namespace palpate
