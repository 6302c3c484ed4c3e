#pragma once

#include <chrono>
#include <cstdio>
#include <optional>
#include <vector>

#include "cli/live_view.hpp"
#include "cli/terminal.hpp"
#include "recognition/live_recognition.hpp"

namespace palpate::cli {

/// Shows on a terminal what `live` knows: as a screen that is redrawn, or, on a terminal whose
/// cursor cannot be moved, as a picture after each touch.
class LiveScreen {
 public:
  /// @param output the terminal; keys are read from standard input
  LiveScreen(std::FILE* output, const SensorDescription& sensor,
             const std::vector<glm::dvec2>& elements_mm, const RecognitionTask& task,
             std::optional<PlanGoal> plan = {});

  /// Shows the state, and beside it the warning unless it is "". Returns true if the key for the
  /// next unknown was pressed.
  bool update(const LiveState& state, const std::string& warning);

 private:
  using Clock = std::chrono::steady_clock;

  void describe(const LiveState& state);
  void place_array(const LiveState& state);
  void measure_rate(const LiveState& state);

  std::FILE* output_;
  const RecognitionTask& task_;
  std::optional<PlanGoal> plan_;
  LiveView view_;
  TerminalColours colours_ = terminal_colours();
  std::optional<Terminal> terminal_;
  std::size_t printed_ = 0;  ///< touches that have a picture, where the cursor cannot be moved
  Clock::time_point rated_ = Clock::now();
  std::uint64_t rated_frames_ = 0;
};

}  // namespace palpate::cli
