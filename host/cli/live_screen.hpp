#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "cli/live_record.hpp"
#include "cli/terminal.hpp"
#include "cli/terminal_canvas.hpp"
#include "palpate/contact.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"
#include "recognition/live_recognition.hpp"

namespace palpate::cli {

/// What `live` shows on a terminal.
struct LiveView {
  std::string object;              ///< the object and its probability
  std::string pose;                ///< T_robot_object in words; "" before the first touch
  std::string next;                ///< the best next touch in words; "" where not planned
  std::string truth;               ///< true object, pose and error; "" where unknown
  std::vector<std::string> notes;  ///< what is wrong with the touches
  std::string sensor;
  double rate_hz = 0.0;
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;
  std::optional<double> latency_ms;
  std::optional<double> worst_latency_ms;
  std::string state;     ///< what happens now, in a few words
  bool warning = false;  ///< draws the state in bold: something is wrong
  std::string keys;      ///< which keys do what

  std::vector<glm::dvec2> elements_mm;  ///< [e] in the sensor frame
  std::vector<std::uint8_t> valid;      ///< empty or [e]
  std::vector<double> pressure;  ///< [e] now, above the baseline; NaN: Unknown; empty: none yet
  double full_scale = 1.0;       ///< pressure of the brightest colour
  std::string pressure_unit;

  std::vector<std::string> labels;
  std::vector<double> identity;  ///< [label] probability; empty before the first touch

  const OccupancyGrid* map = nullptr;  ///< map of the mode's object; null before the first touch
  double evidence_nats = 1.0;          ///< evidence of the strongest colour
  Pose T_object_robot;

  /// Pose and readings of the array on the object: now, or at the last touch.
  std::optional<Pose> T_robot_sensor;
  std::vector<Reading> readings;  ///< [e], with T_robot_sensor
};

/// The view in `rows` lines of at most `columns` characters. Small terminals get no pictures.
std::vector<std::string> draw(const LiveView& view, int columns, int rows, TerminalColours colours);

/// Shows on a terminal what `live` knows: as a screen that is redrawn, or, on a terminal whose
/// cursor cannot be moved, as a picture after each touch.
class LiveScreen {
 public:
  /// @param output the terminal; keys are read from standard input
  /// @param page where else to look; "": nowhere
  LiveScreen(std::FILE* output, const SensorDescription& sensor,
             const std::vector<glm::dvec2>& elements_mm, const RecognitionTask& task,
             std::optional<PlanGoal> plan = {}, const std::string& page = "");

  /// Shows the state, and beside it the warning unless it is "". Returns true if the key for the
  /// next unknown was pressed.
  bool update(const LiveState& state, const std::string& warning);

 private:
  void describe(const LiveState& state);
  void place_array(const LiveState& state);

  std::FILE* output_;
  const RecognitionTask& task_;
  std::optional<PlanGoal> plan_;
  LiveView view_;
  TerminalColours colours_ = terminal_colours();
  std::optional<Terminal> terminal_;
  std::size_t printed_ = 0;  ///< touches that have a picture, where the cursor cannot be moved
  FrameRate rate_;
};

}  // namespace palpate::cli
