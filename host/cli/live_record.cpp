#include "cli/live_record.hpp"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

#include "cli/step_words.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

TextTable table_of(const RecognitionTask& task) {
  const std::size_t dropped = traits_of(task.filter).certificate ? 7 : 0;
  return TextTable(
      step_columns({{"unknown", true, 7}, {"touch", true, 5}}, {"latency ms", true, 10}, dropped));
}

}  // namespace

nlohmann::ordered_json to_json(const LiveTouch& touch, const RecognitionTask& task) {
  const Pose& pose = *touch.touch.T_robot_sensor;
  nlohmann::ordered_json json{{"time", 0.5 * (touch.touch.begin_s + touch.touch.end_s)},
                              {"unknown", touch.unknown},
                              {"touch", touch.index},
                              {"pose",
                               {{"x_mm", pose.translation_mm.x},
                                {"y_mm", pose.translation_mm.y},
                                {"theta_rad", pose.theta_rad}}}};
  json.update(to_json(touch.step, task));
  if (!touch.step.truth.label.empty()) {
    json["truth"] = truth_to_json(touch.step.truth);
  }
  json["latency_ms"] = touch.latency_ms;
  json["frames_lost"] = touch.frames_lost;
  if (!touch.left_out.empty()) {
    json["left_out"] = touch.left_out;
  }
  return json;
}

std::string plan_line(const LiveTouch& touch) {
  nlohmann::ordered_json json{
      {"unknown", touch.unknown}, {"touch", touch.index}, {"next", to_json(touch.next.value())}};
  json["next"].erase("index");  // of a grid that nobody else knows
  return text_of(json);
}

std::string table_heading(const RecognitionTask& task) {
  const TextTable table = table_of(task);
  return table.line(table.headings());
}

std::string table_line(const LiveTouch& touch, const RecognitionTask& task) {
  TextTable::Row row =
      step_cells({fmt::format("{}", touch.unknown + 1), fmt::format("{}", touch.index + 1)},
                 touch.step, task, fmt::format("{:.2f}", touch.latency_ms));
  std::ranges::replace(row, std::string(), "-");
  row.back() += touch.step.decision.act ? ", act" : "";
  return table_of(task).line(row);
}

std::string summary(const LiveState& state, std::vector<double> latencies_ms,
                    const RecognitionTask& task) {
  std::string text;
  if (state.last) {
    const RecognitionStep& step = state.last->step;
    const StepSentences words = sentences_of(step, task);
    std::vector<std::string> lines{words.decision, result_words(step, task), words.truth};
    std::ranges::copy(words.findings, std::back_inserter(lines));
    for (const std::string& line : lines) {
      text += line.empty() ? "" : line + "\n";
    }
  }
  text += fmt::format("{} touches, {} frames, {} lost", state.all_touches, state.counters.frames,
                      state.counters.lost);
  if (state.counters.reconnects > 0) {
    text += fmt::format(", the board came back {} times", state.counters.reconnects);
  }
  if (state.without_pose > 0) {
    text += fmt::format(", {} touches without a pose passed over", state.without_pose);
  }
  if (state.unknown_readings > 0) {
    text += fmt::format(", {} readings unknown", state.unknown_readings);
  }
  text += "\n";
  if (!latencies_ms.empty()) {
    std::ranges::sort(latencies_ms);
    const std::size_t n = latencies_ms.size();
    text += fmt::format("from frame to estimate: median {:.2f} ms, worst {:.2f} ms\n",
                        std::midpoint(latencies_ms[(n - 1) / 2], latencies_ms[n / 2]),
                        state.worst_latency_ms);
  }
  return text;
}

}  // namespace palpate::cli
