#include "live_record.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include "options.hpp"
#include "palpate/error.hpp"
#include "printable.hpp"
#include "record_output.hpp"

namespace palpate::cli {

namespace {

double time_s(const LiveTouch& touch) { return 0.5 * (touch.touch.begin_s + touch.touch.end_s); }

}  // namespace

std::string json_line(const LiveTouch& touch, const RecognitionTask& task) {
  const Pose& pose = *touch.touch.T_robot_sensor;
  nlohmann::ordered_json json{{"time", time_s(touch)},
                              {"unknown", touch.unknown},
                              {"touch", touch.index},
                              {"pose",
                               {{"x_mm", pose.translation_mm.x},
                                {"y_mm", pose.translation_mm.y},
                                {"theta_rad", pose.theta_rad}}}};
  json.update(to_json(touch.step, task));
  json["latency_ms"] = touch.latency_ms;
  json["frames_lost"] = touch.frames_lost;
  // A label need not be UTF-8, as JSON must.
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string table_heading() {
  return "unknown  touch  best       probability     x mm     y mm  theta deg  error mm  latency "
         "ms";
}

std::string table_line(const LiveTouch& touch, const RecognitionTask& task) {
  const RecognitionStep& step = touch.step;
  const Pose& T = step.pose();
  return fmt::format("{:>7}  {:>5}  {:<10} {:>11.6f} {:>8.2f} {:>8.2f} {:>10.1f}  {:>8}  {:>10.2f}",
                     touch.unknown + 1, touch.index + 1, printable(task.labels[step.best]),
                     step.identity[step.best], T.translation_mm.x, T.translation_mm.y,
                     degrees(T.theta_rad), error_text(step.pose_error_mm()), touch.latency_ms);
}

std::string summary(const LiveState& state, std::vector<double> latencies_ms,
                    const RecognitionTask& task) {
  std::string text = fmt::format("{} touches, {} frames, {} lost", state.all_touches,
                                 state.counters.frames, state.counters.lost);
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
    const auto middle = latencies_ms.begin() + static_cast<std::ptrdiff_t>(latencies_ms.size() / 2);
    std::nth_element(latencies_ms.begin(), middle, latencies_ms.end());
    text += fmt::format("from frame to estimate: median {:.2f} ms, worst {:.2f} ms\n", *middle,
                        state.worst_latency_ms);
  }
  if (state.last) {
    const RecognitionStep& step = state.last->step;
    const Pose& T = step.pose();
    text += fmt::format("{} ({:.1f} %); {} at x {:.2f} mm, y {:.2f} mm, theta {:.1f} deg\n",
                        printable(task.labels[step.best]), 100.0 * step.identity[step.best],
                        printable(task.labels[task.label_of[step.mode.object]]), T.translation_mm.x,
                        T.translation_mm.y, degrees(T.theta_rad));
  }
  return text;
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
