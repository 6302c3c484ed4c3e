#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "recognition/recognition_task.hpp"
#include "recognition/surprise.hpp"

namespace palpate {

/// The filter that a task names. Functions throw Error as those of PoseHistogram, BoundedPosterior
/// and ParticleFilter do.
class Recogniser {
 public:
  Recogniser(Device& device, const RecognitionTask& task);
  /// By bounds, which need no device.
  explicit Recogniser(const RecognitionTask& task);

  /// Forgets all touches, for the next unknown. Particles start from the same places again; bounds
  /// keep their tables. An automatic pivot returns to the robot frame's origin until a touch places
  /// it.
  void reset();
  /// Updates the belief with these touches. The first touch since reset() that has an element In
  /// Contact (Eq. 3) places an automatic pivot. Copies of the touches before it wait, and join the
  /// belief together with that touch; until then the belief is the one before any touch.
  /// `progress` is called now and then with the fraction done.
  void update(std::span<const Touch> touches, const std::function<void(double)>& progress = {});
  /// Evaluates a touch that is likely to come next; see PoseHistogram::prepare(). Does nothing
  /// with a touch that would wait for an automatic pivot, nothing for bounds, which search only
  /// once they are asked, and nothing for particles: they cannot be weighed ahead, since weighing
  /// follows resampling and noise.
  void prepare(const Touch& touch);
  Estimate estimate() const;
  /// The refined pose near the mode; empty for particles.
  std::optional<RefinedPose> refine(const Mode& mode) const;
  /// ParticleFilter::effective_sample_size(); empty without particles.
  std::optional<double> effective_sample_size() const;
  /// sample() of the histogram or of the bounded posterior; for particles, draws by their weights.
  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed) const;
  /// Whether the belief has taken in a touch since reset(). Touches that wait for an automatic
  /// pivot do not count.
  bool touched() const { return touched_; }
  /// Judges touches by the recogniser's task; made at the first call. Not for particles.
  const SurpriseJudge& surprise_judge(const RecognitionTask& task);
  /// Keeps the surprise of a touch until reset().
  void note_surprise(double surprise) { surprises_.push_back(surprise); }
  /// What note_surprise() was given since reset(), in order.
  std::span<const double> surprises() const { return surprises_; }
  /// Marginal probabilities of one object's poses: a histogram's over the task's lattice, those of
  /// other filters over its marginal_grid(). A particle counts in the nearest bin.
  Marginals marginals(int object) const;
  /// The task's lattice about the pivot in use.
  const PoseLattice& lattice() const { return lattice_; }
  /// Device memory held, in bytes; none by bounds, which BoundedPosterior::host_bytes() tells of.
  std::uint64_t device_bytes() const;

  /// The histogram; nullptr where the filter is another.
  const PoseHistogram* histogram() const { return std::get_if<PoseHistogram>(&filter_); }
  /// The bounded posterior; nullptr where the filter is another.
  const BoundedPosterior* bounded() const { return std::get_if<BoundedPosterior>(&filter_); }

 private:
  /// A copy of a touch that waits for the pivot.
  struct WaitingTouch {
    Pose T_robot_sensor;
    std::vector<glm::dvec2> elements_mm;
    std::vector<double> pressure;
    std::vector<std::uint8_t> valid;
  };

  /// Whether an automatic pivot has yet to be placed.
  bool lacks_pivot() const { return auto_pivot_ && !pivot_placed_; }
  /// Whether the touch has an element In Contact.
  bool meets_object(const Touch& touch) const;
  /// Moves the pivot to the array's centre.
  void place_pivot(const Touch& touch);
  void move_pivot(const glm::dvec2& pivot_mm);

  PoseLattice lattice_;
  ContactClassifier classifier_;
  bool auto_pivot_;
  bool pivot_placed_ = false;          ///< by a touch since reset(); only where it is automatic
  std::vector<WaitingTouch> waiting_;  ///< in order; empty once the pivot is placed
  bool touched_ = false;               ///< since reset()
  std::vector<double> surprises_;      ///< since reset()
  std::optional<SurpriseJudge> surprise_judge_;
  std::variant<PoseHistogram, BoundedPosterior, ParticleFilter> filter_;
};

}  // namespace palpate
