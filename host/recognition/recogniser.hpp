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

  /// Forgets all touches, for the next unknown. Particles start from the same places again. An
  /// automatic pivot returns to the robot frame's origin until the next touch.
  void reset();
  /// Updates the belief with these touches. The first touch since reset() places an automatic
  /// pivot, whether the touch meets an object or not. `progress` is called now and then with the
  /// fraction done.
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
  /// The task's lattice about the pivot in use.
  const PoseLattice& lattice() const { return lattice_; }
  /// Device memory held, in bytes.
  std::uint64_t device_bytes() const;

  /// The histogram; nullptr for particles.
  const PoseHistogram* histogram() const { return std::get_if<PoseHistogram>(&filter_); }

 private:
  /// Moves an automatic pivot to the sensor's origin, unless an earlier touch has placed it.
  void place_pivot(const Touch& touch);
  void move_pivot(const glm::dvec2& pivot_mm);

  PoseLattice lattice_;
  bool auto_pivot_;
  bool touched_ = false;  ///< since reset()
  std::variant<PoseHistogram, ParticleFilter> filter_;
};

}  // namespace palpate
