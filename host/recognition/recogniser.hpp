#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "recognition_task.hpp"

namespace palpate {

/// The filter that a task names. Functions throw Error as those of PoseHistogram and ParticleFilter
/// do.
class Recogniser {
 public:
  Recogniser(Device& device, const RecognitionTask& task);

  /// Forgets all touches, for the next unknown. Particles start from the same places again.
  void reset();
  /// Updates the belief with these touches. `progress` is called now and then with the fraction
  /// done.
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  /// Evaluates a touch that is likely to come next; see PoseHistogram::prepare(). Particles cannot
  /// be weighed ahead, since weighing follows resampling and noise: for them it does nothing.
  void prepare(const Touch& touch);
  Estimate estimate() const;
  /// The mode's pose between the bins; empty for particles.
  std::optional<RefinedPose> refine(const Mode& mode) const;
  /// ParticleFilter::effective_sample_size(); empty for a histogram.
  std::optional<double> effective_sample_size() const;
  /// Marginal probabilities of one object's poses over the task's lattice. A particle counts in the
  /// nearest bin.
  Marginals marginals(int object) const;
  /// Device memory held, in bytes.
  std::uint64_t device_bytes() const;

  /// The histogram; nullptr for particles.
  const PoseHistogram* histogram() const { return std::get_if<PoseHistogram>(&filter_); }

 private:
  PoseLattice lattice_;
  std::variant<PoseHistogram, ParticleFilter> filter_;
};

}  // namespace palpate
