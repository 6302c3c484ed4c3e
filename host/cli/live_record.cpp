#include "cli/live_record.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <numeric>

#include <fmt/format.h>

#include "cli/options.hpp"
#include "cli/page/page_json.hpp"
#include "cli/step_words.hpp"
#include "palpate/error.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

double time_s(const LiveTouch& touch) { return 0.5 * (touch.touch.begin_s + touch.touch.end_s); }

/// A cell of the column that only bounds have.
std::string dropped_cell(const std::string& text, const RecognitionTask& task) {
  return traits_of(task.filter).certificate ? fmt::format("  {:>7}", text) : "";
}

}  // namespace

nlohmann::ordered_json to_json(const LiveTouch& touch, const RecognitionTask& task) {
  const Pose& pose = *touch.touch.T_robot_sensor;
  nlohmann::ordered_json json{{"time", time_s(touch)},
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

std::string json_line(const LiveTouch& touch, const RecognitionTask& task) {
  return line_of(to_json(touch, task));
}

std::string plan_line(const LiveTouch& touch) {
  nlohmann::ordered_json json{
      {"unknown", touch.unknown}, {"touch", touch.index}, {"next", to_json(touch.next.value())}};
  json["next"].erase("index");  // of a grid that nobody else knows
  return json.dump();
}

// Lines are printed as touches come, so columns cannot be as wide as their content.
std::string table_heading(const RecognitionTask& task) {
  return fmt::format(
      "{:>7}  {:>5}  {:<10}  {:>5}{}  {:>7}  {:>14}  {:>14}  {:>15}  {:>8}  {:>10}  {:>9}  fit",
      "unknown", "touch", "best", "prob.", dropped_cell("dropped", task), "at pose", "x mm", "y mm",
      "theta deg", "error mm", "latency ms", "touch's z");
}

std::string table_line(const LiveTouch& touch, const RecognitionTask& task) {
  const RecognitionStep& step = touch.step;
  const std::array<std::string, 3> pose = pose_cells(pose_text(step));
  const std::string fit = fit_words(step);
  const std::string touch_fit = touch_fit_text(step);
  return fmt::format(
      "{:>7}  {:>5}  {:<10}  {:>5.3f}{}  {:>7}  {:>14}  {:>14}  {:>15}  {:>8}  {:>10.2f}  {:>9}  "
      "{}",
      touch.unknown + 1, touch.index + 1, object_words(step, task), step.confidence(),
      dropped_cell(dropped_text(step), task), share_text(step, task, "-"), pose[0], pose[1],
      pose[2], error_text(step.pose_error_mm()), touch.latency_ms,
      touch_fit.empty() ? "-" : touch_fit,
      (fit.empty() ? "-" : fit) + (step.decision.act ? ", act" : ""));
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

double FrameRate::hz(std::uint64_t frames) {
  const auto now = Clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - since_).count();
  if (elapsed_s >= 1.0) {
    hz_ = static_cast<double>(frames - before_) / elapsed_s;
    before_ = frames;
    since_ = now;
  }
  return hz_;
}

LineFile::LineFile(const std::string& path)
    : path_(path), file_(path == "-" ? stdout : std::fopen(path.c_str(), "we")) {
  if (!file_) {
    refuse_flag("--json", path_, "cannot be made: {}", std::strerror(errno));
  }
}

void LineFile::add(const std::string& line) {
  if (std::fputs((line + "\n").c_str(), file_.get()) < 0 || std::fflush(file_.get()) != 0) {
    throw Error(Fault::system,
                fmt::format("--json {}: cannot be written: {}", path_, std::strerror(errno)));
  }
}

void LineFile::Close::operator()(std::FILE* file) const {
  if (file != stdout) {
    std::fclose(file);
  }
}

}  // namespace palpate::cli
