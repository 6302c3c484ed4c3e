#pragma once

#include <cstddef>
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

}  // namespace palpate
