#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/touch_evidence.hpp"
#include "recognition/filter.hpp"
#include "recognition/recognition_task.hpp"
#include "recognition/touch_places.hpp"

namespace palpate {

/// The filter that a task names. Functions throw Error as those of PoseHistogram, BoundedPosterior
/// and ParticleFilter do.
class Recogniser {
 public:
  Recogniser(Device& device, const RecognitionTask& task) : Recogniser(&device, task, {}) {}
  /// By bounds, which need no device.
  explicit Recogniser(const RecognitionTask& task, const FilterResources& search = {})
      : Recogniser(nullptr, task, search) {}

  /// Forgets all touches, for the next unknown. Particles start from the same places again; bounds
  /// keep their tables. An automatic pivot returns to the robot frame's origin until a touch places
  /// it.
  void reset();
  /// Updates the belief with these touches. The first touch since reset() that has an element In
  /// Contact (Eq. 3) places an automatic pivot. The touches before it wait, and join the
  /// belief together with that touch; until then the belief is the one before any touch.
  /// `progress` is called now and then with the fraction done.
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  /// See Filter::estimate().
  Estimate estimate(std::optional<double> tolerance = {}) const {
    return filter_->estimate(tolerance);
  }
  /// The refined pose near the mode; empty for particles.
  std::optional<RefinedPose> refine(const Mode& mode) const { return filter_->refine(mode); }
  /// ParticleFilter::effective_sample_size(); empty without particles.
  std::optional<double> effective_sample_size() const { return filter_->effective_sample_size(); }
  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed) const {
    return filter_->sample(count, seed);
  }
  /// Filter::entropy(); empty for particles.
  std::optional<double> entropy() const { return filter_->entropy(); }
  /// See PoseHistogram::expected_gain(); empty for particles.
  std::vector<TouchGain> expected_gain(std::span<const Pose> T_robot_sensor,
                                       std::span<const glm::dvec2> elements_mm,
                                       const PlanOptions& plan) const {
    return filter_->expected_gain(T_robot_sensor, elements_mm, plan);
  }
  /// Whether the belief has taken in a touch since reset(). Touches that wait for an automatic
  /// pivot do not count.
  bool touched() const { return touched_; }
  /// All touches since reset(), in order, those that wait for an automatic pivot included; weighed
  /// by place where RecognitionTask::by_place says so.
  std::span<const TouchEvidence> evidence() const { return evidence_; }
  /// See Filter::marginals().
  Marginals marginals(int object) const { return filter_->marginals(object, lattice_); }
  /// See Filter::likely_bins().
  /// @param lattice receives the lattice that the bins are of
  std::vector<std::vector<BinShare>> likely_bins(std::span<const int> objects, double least_share,
                                                 PoseLattice& lattice) const {
    lattice = lattice_;
    return filter_->likely_bins(objects, least_share, lattice);
  }
  /// The task's lattice about the pivot in use.
  const PoseLattice& lattice() const { return lattice_; }
  /// What to say where the lattice does not resolve the filter's touch_sd or slip_sd at one of the
  /// touches since reset(); else "".
  std::string unresolved_words() const;
  /// See TouchPlaces::words().
  std::string place_words() const { return places_.words(); }
  /// See Filter::words().
  std::vector<std::string> words() const { return filter_->words(); }
  std::uint64_t device_bytes() const { return filter_->device_bytes(); }
  std::uint64_t host_bytes() const { return filter_->host_bytes(); }
  /// See Filter::histogram().
  const PoseHistogram* histogram() const { return filter_->histogram(); }
  /// See Filter::evaluated_bins().
  std::optional<EvaluatedBelief> evaluated_bins() const { return filter_->evaluated_bins(); }

 private:
  /// Whether an automatic pivot has yet to be placed.
  bool lacks_pivot() const { return auto_pivot_ && !pivot_placed_; }
  /// Moves the pivot to the array's centre.
  void place_pivot(const TouchEvidence& touch);
  void move_pivot(const glm::dvec2& pivot_mm);

  Recogniser(Device* device, const RecognitionTask& task, const FilterResources& search);

  FilterTraits traits_;
  PoseLattice lattice_;
  ContactModel contact_;
  bool auto_pivot_;
  bool by_place_;
  TouchPlaces places_;                   ///< since reset(); only where touches count by place
  bool pivot_placed_ = false;            ///< by a touch since reset(); only where it is automatic
  std::vector<TouchEvidence> evidence_;  ///< in order; waits where the pivot lacks
  bool touched_ = false;                 ///< since reset()
  std::unique_ptr<Filter> filter_;
};

}  // namespace palpate
