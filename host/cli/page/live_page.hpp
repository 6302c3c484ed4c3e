#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "cli/page/page_server.hpp"
#include "recognition/live_recognition.hpp"

namespace palpate::cli {

/// Shows in a browser what `live` knows.
class LivePage {
 public:
  /// Serves the page from now on. All outlives the page.
  /// @throws Error where the port cannot be had
  LivePage(const PageAddress& address, const SensorDescription& sensor,
           const std::vector<glm::dvec2>& elements_mm, const RecognitionTask& task,
           const Recogniser& recogniser, std::optional<PlanGoal> plan);

  std::string words() const { return server_.words(); }

  /// Whom the page's buttons ask, from now until nullptr is given.
  void serve(LiveRecognition* recognition);
  /// Shows a touch and the belief after it. For the thread that uses the recogniser.
  void add(const LiveTouch& touch);
  /// Shows that another unknown comes. For the same thread.
  void begin_unknown();
  /// Shows what is planned after a touch.
  void plan(const LiveTouch& touch);
  /// Shows what the array feels now, at most 25 times a second.
  /// @param warning what is wrong beside the state; "": nothing
  void update(const LiveState& state, const std::string& warning);

 private:
  using Clock = std::chrono::steady_clock;

  std::optional<std::string> get(const std::string& path) const;
  void act(const nlohmann::json& request);
  /// Shows where an object's belief lies. For the thread that uses the recogniser.
  void show_belief();

  const RecognitionTask& task_;
  const Recogniser& recogniser_;
  std::optional<PlanGoal> plan_;

  std::optional<RecognitionStep> last_;  ///< of the thread that uses the recogniser alone

  std::atomic<int> looked_at_ = -1;  ///< the hypothesis that was chosen; -1: the mode's
  std::mutex mutex_;
  LiveRecognition* recognition_ = nullptr;

  Clock::time_point shown_{};
  Clock::time_point counted_ = Clock::now();  ///< when the frames of rate_hz_ began
  std::uint64_t frames_before_ = 0;           ///< until then
  double rate_hz_ = 0.0;                      ///< of the frames over a second or more

  PageServer server_;  ///< ends before all that it reads
};

}  // namespace palpate::cli
