#include "cli/live_screen.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "cli/planned_touch.hpp"
#include "cli/step_words.hpp"
#include "figures/evidence_scale.hpp"

namespace palpate::cli {

using namespace std::chrono_literals;

LiveScreen::LiveScreen(std::FILE* output, const SensorDescription& sensor,
                       const std::vector<glm::dvec2>& elements_mm, const RecognitionTask& task,
                       std::optional<PlanGoal> plan)
    : output_(output), task_(task), plan_(plan) {
  view_.sensor = sensor.serial.empty() ? sensor.name : sensor.name + " " + sensor.serial;
  view_.elements_mm = elements_mm;
  view_.valid = sensor.valid;
  view_.pressure_unit = sensor.pressure_unit;
  view_.labels = task.labels;
  std::vector<OccupancyGrid> maps;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    maps.push_back(hypothesis.map);
  }
  view_.evidence_nats = evidence_scale(maps).range_nats;
  if (terminal_moves_cursor()) {
    terminal_.emplace(fileno(output), STDIN_FILENO);
    view_.keys = terminal_->has_keys() ? "r: next unknown   Ctrl-C: end" : "Ctrl-C: end";
  }
}

bool LiveScreen::update(const LiveState& state, const std::string& warning) {
  describe(state);
  if (!warning.empty()) {
    view_.warning = true;
    view_.state += "; " + warning;
  }
  measure_rate(state);
  const Terminal::Size size = Terminal::size_of(fileno(output_));
  if (terminal_) {
    terminal_->show(draw(view_, size.columns, size.rows, colours_));
    return terminal_->keys().find('r') != std::string::npos;
  }
  if (state.all_touches != printed_) {
    printed_ = state.all_touches;
    for (const std::string& line : draw(view_, size.columns - 1, size.rows - 1, colours_)) {
      fmt::print(output_, "{}\n", line);
    }
    std::fflush(output_);
  }
  return false;
}

void LiveScreen::describe(const LiveState& state) {
  view_.frames = state.counters.frames;
  view_.lost = state.counters.lost;
  view_.warning = state.gone || state.taring;
  view_.state = state.gone     ? "the board is unplugged; plug it in again to go on"
                : state.taring ? "taring: do not touch the array"
                               : fmt::format("unknown {}, {} touches{}", state.unknown + 1,
                                             state.touches, state.touching ? ", touching" : "");
  if (state.without_pose > 0) {
    view_.warning = true;
    view_.state += fmt::format("; skipped {} touches without a pose", state.without_pose);
  }
  view_.pressure = state.pressure;
  // Most presses are several times as strong as the contact threshold. A touch may widen the scale;
  // a single frame may not, because a reading of 1e38 would leave nothing else to be seen.
  view_.full_scale = std::max(5.0 * task_.classifier().threshold, 1e-6);
  if (state.last) {
    for (const double pressure : state.last->touch.pressure) {
      view_.full_scale = std::max(view_.full_scale, pressure);
    }
  }
  view_.pose.clear();
  view_.truth.clear();
  view_.next.clear();
  view_.notes.clear();
  view_.identity.clear();
  view_.map = nullptr;
  view_.latency_ms.reset();
  view_.T_robot_sensor.reset();
  if (!state.last) {
    return;
  }
  const RecognitionStep& step = state.last->step;
  if (step.contradicted) {
    view_.state += "; no map fits these touches";
    view_.warning = true;
  }
  view_.object = identity_words(step, task_);
  view_.pose = pose_words(pose_text(step));
  view_.truth = truth_words(step, task_);
  if (plan_) {
    view_.next = state.last->next ? next_touch_words(*state.last->next, *plan_) : "planning";
  }
  if (const auto unproven = unproven_sentence(step, task_); !unproven.empty()) {
    view_.notes.push_back(unproven);
  } else if (const std::string dropped = dropped_text(step); !dropped.empty()) {
    view_.state += "; dropped " + dropped;
  }
  if (const auto misfit = misfit_sentence(step, state.touches, task_); !misfit.empty()) {
    view_.notes.push_back(misfit);
    view_.state += step.known ? fmt::format("; known {:.2f}", *step.known) : "";
  } else if (step.fit) {
    view_.state += "; " + fit_words(step);
  }
  if (const std::string surprise = surprise_text(step); !surprise.empty()) {
    view_.state += "; surprise " + surprise;
  }
  if (auto words = single_touch_words(task_, state.touches); !words.empty()) {
    view_.notes.push_back(std::move(words));
  }
  std::ranges::move(warning_words(step), std::back_inserter(view_.notes));
  view_.identity = step.identity;
  view_.map = &task_.hypotheses[step.mode.object].map;
  view_.T_object_robot = step.pose();
  view_.latency_ms = state.last->latency_ms;
  view_.worst_latency_ms = state.worst_latency_ms;
  place_array(state);
}

void LiveScreen::place_array(const LiveState& state) {
  const bool now = state.touching && state.T_robot_sensor;
  view_.T_robot_sensor = now ? state.T_robot_sensor : state.last->touch.T_robot_sensor;
  const std::vector<double>& pressure = now ? state.pressure : state.last->touch.pressure;
  const std::vector<std::uint8_t>& valid = now ? view_.valid : state.last->touch.valid;
  view_.readings.clear();
  if (pressure.size() == view_.elements_mm.size()) {
    view_.readings = task_.classifier().classify({.T_robot_sensor = *view_.T_robot_sensor,
                                                  .elements_mm = view_.elements_mm,
                                                  .pressure = pressure,
                                                  .valid = valid});
  }
}

void LiveScreen::measure_rate(const LiveState& state) {
  const auto now = Clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - rated_).count();
  if (elapsed_s >= 1.0) {
    view_.rate_hz = static_cast<double>(state.counters.frames - rated_frames_) / elapsed_s;
    rated_frames_ = state.counters.frames;
    rated_ = now;
  }
}

}  // namespace palpate::cli
