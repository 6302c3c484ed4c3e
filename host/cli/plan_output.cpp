#include "cli/plan_output.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "cli/planned_touch.hpp"
#include "cli/record_table.hpp"
#include "cli/sheet.hpp"
#include "cli/step_words.hpp"
#include "cli/text_table.hpp"
#include "model/bounding_box.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

std::string believed_words(const Plan& plan) {
  return fmt::format(
      "after {} {}: {:.2f} nats unknown of the identity, {:.2f} of the pose, "
      "counted in bins",
      plan.record.touches, plan.record.touches == 1 ? "touch" : "touches", plan.identity_nats,
      std::max(plan.both_nats - plan.identity_nats, 0.0));
}

std::string table_of(const Plan& plan, std::optional<int> columns) {
  constexpr std::size_t most_rows = 10;
  TextTable table(
      {{"rank", true},
       {"x mm", true},
       {"y mm", true},
       {"theta deg", true},
       {plan.goal == PlanGoal::both ? "gain nats" : goal_word(plan.goal) + " nats", true},
       {"identity", true},
       {"pose", true},
       {"candidate", true}});
  for (std::size_t i = 0; i < std::min(plan.ranked.size(), most_rows); ++i) {
    const PlannedTouch& touch = plan.ranked[i];
    const std::array<std::string, 3> pose = pose_text(touch.T_robot_sensor).value;
    table.add({std::to_string(i + 1), pose[0], pose[1], pose[2], gain_text(touch.gain, plan.goal),
               // The goal's gain stands in its own column; one without content is left out.
               plan.goal == PlanGoal::identity ? "" : fmt::format("{:.2f}", touch.gain.identity),
               plan.goal == PlanGoal::pose ? "" : fmt::format("{:.2f}", touch.gain.pose),
               std::to_string(touch.index)});
  }
  return table.text(columns);
}

}  // namespace

nlohmann::ordered_json to_json(const Plan& plan, const RecognitionTask& task,
                               const std::string& device) {
  nlohmann::ordered_json json{{"recording", plan.record.recording},
                              {"touches", plan.record.touches},
                              {"goal", goal_word(plan.goal)},
                              {"believed", to_json(plan.record.last(), task)}};
  json["believed"]["entropy"] = {{"identity", plan.identity_nats},
                                 {"pose", plan.both_nats - plan.identity_nats},
                                 {"both", plan.both_nats}};
  json["candidates"] = nlohmann::ordered_json::array();
  for (const PlannedTouch& touch : plan.ranked) {
    json["candidates"].push_back(to_json(touch));
  }
  std::vector<std::string> warnings = warnings_of(plan);
  std::ranges::transform(warnings, warnings.begin(), in_flags);
  if (!warnings.empty()) {
    json["warnings"] = warnings;
  }
  json["samples"] = plan.samples.size();
  json["seed"] = plan.seed;
  json["seconds"] = plan.seconds;
  json["device"] = device;
  return json;
}

std::string plan_text(const Plan& plan, const RecognitionTask& task, std::optional<int> columns) {
  const std::string limit = in_flags(limit_words(plan));
  return fmt::format(
      "{}\n{}\n\n{}{}{}\n{}, {} {} in {:.0f} ms\n", result_words(plan.record.last(), task),
      believed_words(plan), table_of(plan, columns), complaints({plan.record}, task),
      limit.empty() ? "" : limit + "\n", next_touch_words(plan.ranked.front(), plan.goal),
      plan.ranked.size(), plan.ranked.size() == 1 ? "candidate" : "candidates", 1e3 * plan.seconds);
}

PlanFigure figure_of(const Plan& plan, const RecognitionTask& task,
                     std::span<const Touch> touches) {
  PlanFigure figure;
  const RecognitionStep& last = plan.record.last();
  const auto printed = [](std::string words) {
    const std::size_t at = words.find(" deg");
    return at == words.npos ? words : words.replace(at, 4, "°");
  };
  const std::string name = std::filesystem::path(plan.record.recording).filename().string();
  figure.result = fmt::format("{}: {}", name, identity_words(last, task));
  figure.captions = {
      "object at " + printed(pose_words(pose_text(last.T_robot_object()))) + " in the robot frame",
      believed_words(plan), printed(next_touch_words(plan.ranked.front(), plan.goal))};
  figure.gain_caption =
      plan.goal == PlanGoal::both
          ? "expected information about object and pose, nats"
          : fmt::format("expected information about the {}, nats", goal_word(plan.goal));
  figure.elements_mm = plan.elements_mm;
  figure.element_mm = element_edge_mm(plan.elements_mm);
  BoundingBox area;
  for (const PlannedTouch& touch : plan.ranked) {
    figure.candidates.push_back({touch.T_robot_sensor, gain_for(touch.gain, plan.goal)});
    area.take_in(touch.T_robot_sensor * array_centre_mm(plan.elements_mm));
  }
  const double margin_mm = array_reach_mm(plan.elements_mm) + figure.element_mm;
  for (const Touch& touch : touches) {
    auto& elements = figure.touches_mm.emplace_back();
    for (const glm::dvec2& element : touch.elements_mm) {
      elements.push_back(touch.T_robot_sensor * element);
    }
    area.take_in(touch.T_robot_sensor * array_centre_mm(touch.elements_mm));
  }
  area.lower -= margin_mm;
  area.upper += margin_mm;
  constexpr int cells = 160;
  const OccupancyField field =
      expected_occupancy(plan.samples, task, area.lower, area.upper, cells);
  figure.lower_mm = field.lower_mm;
  figure.cell_mm = field.cell_mm;
  figure.nx = field.nx;
  figure.ny = field.ny;
  figure.occupied = field.probability;
  return figure;
}

}  // namespace palpate::cli
