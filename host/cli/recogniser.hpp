#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/pose_histogram.hpp"
#include "recognition_task.hpp"

namespace palpate::cli {

/// What the commands need of a filter, whichever was asked for.
class Recogniser {
 public:
  virtual ~Recogniser() = default;

  /// Forgets all touches, for the next unknown.
  virtual void reset() = 0;
  /// `progress` is called with the fraction done, now and then.
  virtual void update(std::span<const Touch> touches,
                      const std::function<void(double)>& progress) = 0;
  /// Evaluates a touch that is likely to come, where that can be done ahead.
  virtual void prepare(const Touch& touch) = 0;
  virtual Estimate estimate() const = 0;
  /// The mode's pose between the bins, where there are bins.
  virtual std::optional<RefinedPose> refine(const Mode& mode) const = 0;
  /// Of the particles, where there are any.
  virtual std::optional<double> effective_sample_size() const = 0;
  /// Marginal probabilities of one object's poses.
  virtual Marginals marginals(int object) const = 0;
  /// What is evaluated, where and how, in a few words.
  virtual std::string description() const = 0;
  /// The dense belief, where there is one.
  virtual const PoseHistogram* histogram() const = 0;
};

/// Chooses the lattice's counts where they are left to the maps and the device, and says on
/// standard error where the device allows fewer than the maps are worth.
void settle_bins(const Device& device, RecognitionTask& task);

std::unique_ptr<Recogniser> make_recogniser(Device& device, const RecognitionTask& task);

}  // namespace palpate::cli
