#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "model/touch_evidence.hpp"
#include "palpate/estimate.hpp"
#include "palpate/fit.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// How well an object at a pose explains touches.
struct ObjectFit {
  std::optional<Fit> fit = {};                      ///< RecognitionStep::fit
  std::vector<std::optional<double>> touches = {};  ///< RecognitionStep::touch_fit
};
/// The fit of the mode's object at the refined pose, or near the mode's where there is none.
ObjectFit fit_of(const Mode& mode, const std::optional<RefinedPose>& refined,
                 std::span<const TouchEvidence> touches, const RecognitionTask& task);

/// The best fit near a pose that is known only to the grid of Eq. 12, 0.5 mm and 0.04 pi rad, as
/// the particles' mode is. Shifts the object, and turns it about its map's middle, by half a step
/// of the grid and less, as long as the fit improves. Parameters and errors as evidence_fit().
std::optional<Fit> best_fit_near(std::span<const TouchEvidence> touches, const Pose& T_object_robot,
                                 const OccupancyGrid& map, const ContactModel& contact,
                                 std::size_t object);

/// FitScale::stranger_sd where it was not learned.
inline constexpr double usual_stranger_sd = 4.0;

/// The density, but for a factor, of Fit::z of touches of a stranger, an object that was never
/// learned, at the best pose of the best object that was. One touch fits as stranger_single_touch
/// says; further ones have to share its pose, and each spreads z by stranger_sd more. No density is
/// 0.
/// @param fit on the scale
/// @param touches with an element In Contact
/// @param scale that was learned
double stranger_density(const Fit& fit, std::size_t touches, const FitScale& scale);

/// What the fit of the best object says for none_label: the log of how likely a stranger fits so,
/// over how likely a learned object does. Parameters as above.
double misfit_nats(const Fit& fit, std::size_t touches, const FitScale& scale);

/// The sums of Estimate::identity over the maps of every label, [label]: the probabilities at
/// temperature 1 and without features.
std::vector<double> sums_by_label(const Estimate& estimate, const RecognitionTask& task);

/// Log evidence of every label, the sum over its maps of weight times evidence; -infinity for
/// none_label.
std::vector<double> label_log_evidence(const Estimate& estimate, const RecognitionTask& task);

/// What the task's sensor model makes of the evidence of labels after some touches.
struct Tempering {
  double temperature = 1.0;      ///< of so many touches
  std::vector<double> features;  ///< [label] what features of the presses say, and misfit_nats()

  /// log of E^(1 / temperature) exp(features), but for a constant.
  /// @param log_evidence log E, E being the sum over the label's maps of weight times evidence
  double tempered(double log_evidence, std::size_t label) const {
    return log_evidence / temperature + features[label];
  }
};
/// @param fit of the best object, on the task's scale; adds misfit_nats() to none_label where that
/// scale was learned
/// @throws Error on features beside a threshold of 0
Tempering tempering_of(std::span<const TouchEvidence> touches, const RecognitionTask& task,
                       const std::optional<Fit>& fit = {});

/// The probability of every label: E^(1 / temperature) exp(features), normalised; by
/// sums_by_label() where nothing changes them.
std::vector<double> label_probabilities(const Estimate& estimate, const Tempering& tempering,
                                        const RecognitionTask& task);

/// The log of a probability of 0.
inline constexpr double log_zero = -std::numeric_limits<double>::infinity();

/// log(exp(a) + exp(b))
double log_sum(double a, double b);

/// The bounds of each label's probability, from the bounds of its hypotheses' log evidence
/// (Certificate::log_evidence). A label is least probable where its own evidence is the lowest and
/// all other evidence the highest. With q of label_probabilities() for the label's evidence E:
///   low = q(E_low) of the label / (q(E_low) of the label + q(E_high) of the others),
/// high likewise. "(none)" has the bounds of its own evidence.
/// @param estimate with a certificate
/// @param identity [label] of the estimate; lies within its bounds
/// @returns [label], none_label included where the task has it
std::vector<ProbabilityInterval> label_bounds(const Estimate& estimate,
                                              std::span<const double> identity,
                                              const Tempering& tempering,
                                              const RecognitionTask& task);

}  // namespace palpate
