#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "estimation/lattice/reading_predictor.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// The touches whose surprises are judged together: the last of an unknown. Two may be surprising
/// by chance, and more would take long to notice an object that has moved.
inline constexpr std::size_t surprises_judged = 3;

/// Number of samples of the belief from which SurpriseJudge judges a touch of so many elements: 64
/// of up to 576 elements, fewer of larger arrays, and at least 32.
std::size_t surprise_samples(std::size_t elements);

/// Judges how much touches surprise beliefs over a task's hypotheses.
class SurpriseJudge {
 public:
  /// Copies the maps. Not for particles, whose motion noise comes between the belief and the touch.
  explicit SurpriseJudge(const RecognitionTask& task);

  /// The number of standard deviations by which
  ///   log p(touch | belief) = log mean of the touch's likelihood (Eq. 7) over the belief
  /// falls below its mean over touches as the belief itself predicts them; positive: less likely
  /// than expected. Touches of the belief's own have mean 0 and variance 1; more than half of them
  /// lie below 0, as a rare reading costs more than a common one gains.
  ///
  /// The belief is given by equally likely samples. Each sample's sensor is displaced by the task's
  /// touch_sd, and its object moved by slip_sd, at random. One touch is drawn from each sample; its
  /// likelihood is averaged over the other samples, the touch's own over all. The seed is fixed,
  /// and the chance that is left is about 1 / sqrt(samples).
  /// @param samples of the belief before the touch, at least 2
  /// @returns none where no element is known
  std::optional<double> surprise_of(const TouchEvidence& touch,
                                    std::span<const PoseSample> samples) const;

 private:
  DisplacementSd touch_sd_;
  DisplacementSd slip_sd_;
  ContactModel contact_;
  ReadingPredictor predictor_;
  std::vector<glm::dvec2> centroids_mm_;  ///< [hypothesis] about which a slip turns the object
};

}  // namespace palpate
