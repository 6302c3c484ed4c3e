#pragma once

#include <optional>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "figures/figures.hpp"
#include "recognition/touch_plan.hpp"

namespace palpate::cli {

/// The plan in the form that other programs rely on.
nlohmann::ordered_json to_json(const Plan& plan, const RecognitionTask& task,
                               const std::string& device);
/// What is believed, the ten best candidates, what is wrong with the touches, and the best one.
/// @param columns see TextTable::text()
std::string plan_text(const Plan& plan, const RecognitionTask& task, std::optional<int> columns);
/// The candidates about the places where the object may be.
/// @param touches so far
PlanFigure figure_of(const Plan& plan, const RecognitionTask& task, std::span<const Touch> touches);

}  // namespace palpate::cli
