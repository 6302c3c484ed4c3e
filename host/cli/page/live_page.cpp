#include "cli/page/live_page.hpp"

#include <cmath>

#include <fmt/format.h>

#include "cli/page/page_json.hpp"
#include "cli/record_table.hpp"
#include "cli/sheet.hpp"
#include "cli/step_words.hpp"
#include "model/option_words.hpp"
#include "palpate/error.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

using namespace std::chrono_literals;

constexpr auto between_frames = 40ms;

nlohmann::ordered_json setup(const SensorDescription& sensor,
                             const std::vector<glm::dvec2>& elements_mm,
                             const RecognitionTask& task, std::optional<PlanGoal> plan) {
  nlohmann::ordered_json json{
      {"sensor", sensor.serial.empty() ? sensor.name : sensor.name + " " + sensor.serial},
      {"pressure_unit", sensor.pressure_unit},
      {"threshold", task.classifier().threshold},
      {"elements_mm", places_json(elements_mm)},
      {"valid", sensor.valid},
      {"labels", task.labels},
      {"live", true}};
  for (int i = 0; i < static_cast<int>(task.hypotheses.size()); ++i) {
    json["maps"].push_back(task.name_of(i));
  }
  if (plan) {
    json["plan"] = goal_word(*plan);
  }
  return json;
}

/// The whole number behind a key, of those from `least` to below `end`.
int number_of(const nlohmann::json& request, const char* key, int least, int end) {
  const double number = request.at(key).get<double>();
  if (!(number >= least && number < end) || number != std::floor(number)) {
    throw Error(Fault::input, fmt::format("{} {}: there is none", key, request.at(key).dump()));
  }
  return static_cast<int>(number);
}

/// What the step says besides its numbers and its decision.
std::vector<std::string> sentences(const RecognitionStep& step, const RecognitionTask& task) {
  StepSentences words = sentences_of(step, task);
  words.findings.insert(words.findings.begin(), words.truth);
  std::erase(words.findings, "");
  return words.findings;
}

/// What the elements said of a touch: "C" In Contact, "n" No Contact, "?" Unknown.
std::string readings_text(const LiveTouch& touch) {
  std::string text;
  for (const Reading reading : touch.readings) {
    text += is_contact(reading) ? 'C' : reading == Reading::unknown ? '?' : 'n';
  }
  return text;
}

}  // namespace

LivePage::LivePage(const PageAddress& address, const SensorDescription& sensor,
                   const std::vector<glm::dvec2>& elements_mm, const RecognitionTask& task,
                   const Recogniser& recogniser, std::optional<PlanGoal> plan)
    : task_(task),
      recogniser_(recogniser),
      plan_(plan),
      server_(address, {.get = [this](const std::string& path) { return get(path); },
                        .act = [this](const nlohmann::json& request) { act(request); }}) {
  server_.feed().set("setup", text_of(setup(sensor, elements_mm, task, plan)));
}

void LivePage::serve(LiveRecognition* recognition) {
  const std::lock_guard lock(mutex_);
  recognition_ = recognition;
}

std::optional<std::string> LivePage::get(const std::string& path) const {
  for (std::size_t i = 0; i < task_.hypotheses.size(); ++i) {
    if (path == fmt::format("/map/{}", i)) {
      return text_of(map_json(task_.hypotheses[i].map));
    }
  }
  return {};
}

void LivePage::act(const nlohmann::json& request) {
  const std::lock_guard lock(mutex_);
  if (recognition_ == nullptr) {
    throw Error(Fault::input, "the stream has not begun, or it is over");
  }
  const std::string what = request.at("do");
  if (what == "next unknown") {
    recognition_->reset();
  } else if (what == "leave out") {
    const int touches = static_cast<int>(recognition_->state().touches);
    recognition_->leave_out(static_cast<std::size_t>(number_of(request, "touch", 0, touches)),
                            request.value("out", true));
  } else if (what == "look at") {
    looked_at_ = number_of(request, "object", -1, static_cast<int>(task_.hypotheses.size()));
    recognition_->between_touches([this] { show_belief(); });
  } else {
    throw Error(Fault::input, fmt::format("'{}' is not one of the page's requests", what));
  }
}

void LivePage::begin_unknown() {
  last_.reset();
  for (const char* event : {"touch", "next", "belief"}) {
    server_.feed().forget(event);
  }
  server_.feed().set("unknown", "{}\n");
}

void LivePage::add(const LiveTouch& touch) {
  last_ = touch.step;
  nlohmann::ordered_json json = to_json(touch, task_);
  json["words"] = sentences(touch.step, task_);
  json["map"] = touch.step.mode.object;
  json["readings"] = readings_text(touch);
  server_.feed().add("touch", text_of(json));
  show_belief();
}

void LivePage::show_belief() {
  if (!last_) {
    return;
  }
  const int object = looked_at_ < 0 ? last_->mode.object : looked_at_.load();
  const PlacedBelief belief = belief_of(recogniser_, object);
  nlohmann::ordered_json json = belief_json(belief);
  json["map"] = object;
  json["chosen"] = looked_at_ >= 0;
  server_.feed().set("belief", text_of(json));
}

void LivePage::plan(const LiveTouch& touch) {
  nlohmann::ordered_json json = to_json(*touch.next);
  json["words"] = next_touch_words(*touch.next, *plan_);
  server_.feed().set("next", text_of(json));
}

void LivePage::update(const LiveState& state, const std::string& warning) {
  const auto now = Clock::now();
  if (now - shown_ < between_frames) {
    return;
  }
  shown_ = now;
  const double counted_s = std::chrono::duration<double>(now - counted_).count();
  if (counted_s >= 1.0) {
    rate_hz_ = static_cast<double>(state.counters.frames - frames_before_) / counted_s;
    frames_before_ = state.counters.frames;
    counted_ = now;
  }
  nlohmann::ordered_json json{{"pressure", pressure_json(state.pressure)},
                              {"touching", state.touching},
                              {"taring", state.taring},
                              {"gone", state.gone},
                              {"unknown", state.unknown},
                              {"touches", state.touches},
                              {"frames", state.counters.frames},
                              {"lost", state.counters.lost},
                              {"without_pose", state.without_pose},
                              {"rate_hz", std::round(rate_hz_)},
                              {"worst_latency_ms", state.worst_latency_ms}};
  if (state.T_robot_sensor) {
    json["pose"] = pose_json(*state.T_robot_sensor);
  }
  if (!warning.empty()) {
    json["warning"] = in_flags(warning);
  }
  server_.feed().set("frame", text_of(json));
}

}  // namespace palpate::cli
