#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>
#include <nlohmann/json.hpp>

#include "figures/plan_figure.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/touch_plan.hpp"

namespace palpate::cli {

/// What was planned, and what is believed before the touch.
struct Plan {
  PlanGoal goal;
  const RecognitionTask& task;
  const RecognitionRecord& record;
  const std::vector<Touch>& touches;
  std::vector<glm::dvec2> elements_mm;  ///< of the array that touches next
  std::vector<PoseSample> samples;      ///< of the belief
  double identity_nats = 0.0;           ///< entropy of the labels
  double both_nats = 0.0;               ///< entropy of objects and bins
  std::vector<PlannedTouch> ranked;
  std::uint64_t seed = 0;
  double seconds = 0.0;
};

/// The plan in the form that other programs rely on.
nlohmann::ordered_json to_json(const Plan& plan, const std::string& device);
/// What is believed, the ten best candidates, what is wrong with the touches, and the best one.
/// @param columns see TextTable::text()
std::string plan_text(const Plan& plan, std::optional<int> columns);
/// The candidates about the places where the object may be.
PlanFigure figure_of(const Plan& plan);

}  // namespace palpate::cli
