#pragma once

#include <optional>
#include <span>
#include <string>

#include "model/touch_evidence.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// A warning where touches are not where they were said to be, or else none: where the last touches
/// surprise the belief (a mean above `surprising_from`) or all touches together do not fit, and
/// every touch displaced by itself, by up to 4 mm and the turn that belongs to it, makes them fit
/// the object at the step's pose. Names the root mean square of these displacements over the
/// touches in contact. Never for a single touch, nor where "(none)" is best, nor for particles. An
/// unlearned object may be warned of, too: its touches fit pieces of a known one.
/// @param touches all touches of the unknown so far
/// @param step what the filter believes after them; reads mode, pose and fit
/// @param surprises of the touches so far; see SurpriseJudge
std::optional<std::string> touches_contradict(std::span<const TouchEvidence> touches,
                                              const RecognitionTask& task,
                                              const RecognitionStep& step,
                                              std::span<const double> surprises);

/// Mean of the last `surprises_judged` surprises from which they are surprising. Simulated letters:
/// of 620 such means at exact poses none reached 0.9; of those misplaced by 1 mm and 0.05 rad 10 to
/// 25 % exceed 1.5. After 10 touches the warning was given once or more, on 25 x 25 x 16 and
/// 30 x 30 x 113 bins, to 1 of 60 and 0 of 15 unknowns at exact poses, 42 of 60 misplaced by 1 mm,
/// and 59 of 60 and 15 of 15 misplaced by 2 mm and 0.1 rad.
inline constexpr double surprising_from = 1.5;

}  // namespace palpate
