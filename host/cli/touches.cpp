#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <glm/geometric.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/sensor_option.hpp"
#include "cli/text_table.hpp"
#include "io/recording_state.hpp"
#include "model/option_words.hpp"
#include "model/stream_time.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "palpate/touch_detector.hpp"
#include "palpate/virtual_sensor.hpp"
#include "streaming/press_touches.hpp"
#include "streaming/rest_finder.hpp"

namespace palpate::cli {

namespace {

struct TouchesArguments {
  std::string frames;
  std::string output;
  DetectorFlags detector;
  std::optional<double> slide_mm;
  bool unposed = false;
};

/// What the elements read untouched: the recording's baseline where `drift_s` is 0, else found in
/// a pass over the whole stream.
Rest rest_of(Sensor& stream, const TouchDetectorOptions& thresholds,
             std::optional<double> drift_s) {
  const SensorDescription& sensor = stream.description();
  if (drift_s == 0.0) {
    return {.time_s = {0.0}, .readings = {sensor.baseline.begin(), sensor.baseline.end()}};
  }
  RestFinder finder(sensor.valid, thresholds.onset, thresholds.release);
  for (stream.start(); !stream.ended();) {
    if (const std::optional<Frame> frame = stream.next({})) {
      finder.add(*frame);
    }
  }
  return finder.find(drift_s);
}

/// What may have cost touches, each in a sentence.
/// @param backwards frames that are older than the one before, of `all`
std::vector<std::string> frame_findings(const Rest& rest, std::uint64_t backwards,
                                        std::uint64_t all) {
  std::vector<std::string> words;
  if (backwards > 0) {
    words.push_back(
        fmt::format("time runs backwards at {} of its {} frames, each of which ends a touch; write "
                    "the frames in the order of their times",
                    backwards, all));
  }
  if (rest.changes_s) {
    words.push_back(fmt::format(
        "from {:.2f} s on an element drifts by the onset, or is in a press that is slow, cut off "
        "or over {:.3g} s long; record the whole press, and give --drift-s, more than its length",
        *rest.changes_s, rest.window_s));
  }
  return words;
}

/// Watches the presses of a stream for what keeps them from being touches.
class PressWatch {
 public:
  PressWatch(const TouchDetectorOptions& options, bool slides)
      : options_(options), slides_(slides) {}

  /// @param smoothed what the detector judges the frame by
  void add(const Frame& frame, const std::vector<double>& smoothed, bool touching) {
    first_s_ = first_s_.value_or(frame.host_time_s);
    last_s_ = frame.host_time_s;
    for (const double pressure : smoothed) {
      if (pressure > largest_) {
        largest_ = pressure;
        largest_s_ = last_s_ - *first_s_;
      }
    }
    if (!touching) {
      return;
    }
    press_ = press_.value_or(Press{.begin_s = last_s_});
    if (const std::optional<Pose>& pose = frame.T_robot_sensor) {
      press_->first_pose = press_->first_pose.value_or(*pose);
      press_->moved_mm =
          std::max(press_->moved_mm,
                   glm::distance(press_->first_pose->translation_mm, pose->translation_mm));
    }
  }
  /// Takes the end of the press whose frames add() took, and whether it makes touches.
  void end(bool makes_touches) {
    if (!makes_touches && ++missed_ <= most_shown) {
      const std::string press = fmt::format("the press {:.1f} s from its start, of {:.2f} s,",
                                            press_->begin_s - *first_s_, last_s_ - press_->begin_s);
      reasons_.push_back(
          press_->moved_mm >= options_.steady_mm
              ? fmt::format("{} moved by {:.1f} mm ({})", press, press_->moved_mm,
                            slides_ ? "slide further, steadily, or give a smaller --slide"
                                    : "hold the array still, or give --slide MM")
              : fmt::format("{} was never steady for {:g} s (press longer, or give another "
                            "--min-steady-s or --steady)",
                            press, options_.min_steady_s));
    }
    press_.reset();
  }

  /// Presses without a touch.
  std::size_t missed() const { return missed_; }
  /// Why no press made a touch, and what to give, in sentences.
  /// @param unit of the pressures
  std::vector<std::string> reasons(const std::string& unit) const {
    if (missed_ == 0 && largest_ > options_.onset) {
      return {fmt::format(
          "its readings reach {:.3g} {} above their rest, but no two frames of a press lie less "
          "than {:g} s apart by their times (give times in seconds, and more frames)",
          largest_, unit, options_.largest_gap_s)};
    }
    if (missed_ == 0) {
      return {fmt::format(
          "its readings reach {:.3g} {} above their rest, {:.1f} s from its start, and "
          "a touch begins above {:g} (lower --onset, or give --drift-s, more than the longest "
          "press)",
          largest_, unit, largest_s_, options_.onset)};
    }
    std::vector<std::string> words = reasons_;
    if (missed_ > most_shown) {
      words.push_back(fmt::format("and {} more presses make no touch", missed_ - most_shown));
    }
    return words;
  }

 private:
  struct Press {
    double begin_s = 0.0;
    std::optional<Pose> first_pose = {};
    double moved_mm = 0.0;  ///< from it, at most
  };

  TouchDetectorOptions options_;
  bool slides_ = false;            ///< strokes are cut into touches
  std::optional<double> first_s_;  ///< of the stream
  double last_s_ = 0.0;
  std::optional<Press> press_;  ///< under way
  double largest_ = 0.0;        ///< pressure above the rest
  double largest_s_ = 0.0;      ///< when, from the first frame on
  static constexpr std::size_t most_shown = 3;
  std::size_t missed_ = 0;
  std::vector<std::string> reasons_;  ///< of the first most_shown that were missed
};

/// Appends the touch and a row of `valid` for it, `unposed` at the pose 0; returns false where the
/// touch needs a pose and has none.
bool append(const DetectedTouch& touch, bool unposed, Recording& recording) {
  if (!unposed && !touch.T_robot_sensor) {
    return false;
  }
  recording.valid.insert(recording.valid.end(), touch.valid.begin(), touch.valid.end());
  recording.T_robot_sensor.push_back(unposed ? Pose{} : *touch.T_robot_sensor);
  recording.pressure.insert(recording.pressure.end(), touch.pressure.begin(), touch.pressure.end());
  recording.time_s.push_back(0.5 * (touch.begin_s + touch.end_s));
  return true;
}

std::optional<SetupFinding> clock_of(std::span<const SetupFinding> findings) {
  const auto clock = std::ranges::find(findings, "clock", &SetupFinding::what);
  return clock == findings.end() ? std::nullopt : std::optional(*clock);
}

/// The finding "dropped", where a good part of the presses make no touch.
/// @param touches that were kept
std::optional<SetupFinding> dropped(std::size_t touches, std::size_t without_pose,
                                    std::size_t unsteady,
                                    const std::optional<SetupFinding>& clock) {
  const std::size_t lost = without_pose + unsteady;
  const std::size_t all = touches + lost;
  if (10 * lost <= all) {
    return {};
  }
  std::vector<std::string> reasons;
  if (without_pose > 0) {
    reasons.push_back(fmt::format("{} without a pose", without_pose));
  }
  if (unsteady > 0) {
    reasons.push_back(
        fmt::format("{} that move or are steady for less than `min-steady-s`", unsteady));
  }
  SetupFinding finding{
      "dropped", 0.0,
      fmt::format("{} of {} presses were left out: {}", lost, all, fmt::join(reasons, ", "))};
  if (clock) {
    finding.words +=
        fmt::format("; the clocks differ: import with `{}`", fmt::join(clock->options, "` and `"));
    finding.options = clock->options;
  }
  return finding;
}

/// Where every touch has the same elements dead, keeps one list for all touches: `dead`, which may
/// be empty.
void shorten_valid(Recording& recording, const std::vector<std::uint8_t>& dead) {
  for (std::size_t k = 0; k < recording.valid.size(); ++k) {
    const bool alive = dead.empty() || dead[k % dead.size()] != 0;
    if ((recording.valid[k] != 0) != alive) {
      return;
    }
  }
  recording.valid = dead;
}

/// Closes the recording of frames if it was cut off, so that other programs can open it.
void close_input(const std::string& frames) {
  if (!is_marked_open(frames) || recorder_of(frames) != Recorder::gone) {
    return;
  }
  try {
    if (close_recording(frames)) {
      fmt::print("{}: was cut off; it is closed now, so that other programs can open it\n", frames);
    }
  } catch (const Error& error) {
    // The touches are written: a disk for reading only is no reason to fail.
    tell_on_stderr(fmt::format("{}; only Palpate and SWMR readers can open it", error.what()));
  }
}

void find_touches(const TouchesArguments& options) {
  CommandFiles().reads("FRAMES", options.frames).writes("-o", options.output).prepare();
  if (options.detector.drift_s) {
    require_above("--drift-s", *options.detector.drift_s, 0.0, true);
  }
  if (options.slide_mm) {
    require_above("--slide", *options.slide_mm, 0.0, false);
  }
  const std::unique_ptr<Sensor> stream =
      open_virtual_sensor("replay:" + options.frames + ",speed=max");
  const SensorDescription& sensor = stream->description();
  const TouchDetectorOptions thresholds =
      detector_options(options.detector, sensor.pressure_unit, options.frames);
  TouchDetectorOptions above_rest = thresholds;
  above_rest.drift_s = 0.0;
  TouchDetector detector(above_rest, {}, sensor.valid);
  Recording recording;
  recording.object = sensor.object;
  recording.pressure_unit = sensor.pressure_unit;
  recording.elements_mm = sensor.elements_mm;
  recording.truth = sensor.truth;
  recording.sensor = sensor.name;
  recording.serial = sensor.serial;
  recording.findings = sensor.findings;

  std::uint64_t unknown = 0;
  std::uint64_t unreadable = 0;
  std::size_t without_pose = 0;
  bool touching = false;
  PressWatch watch(thresholds, options.slide_mm.has_value());
  std::optional<StrokeTouches> stroke;
  if (options.slide_mm) {
    stroke.emplace(*options.slide_mm, sensor.valid);
  }
  const auto take = [&](const std::optional<DetectedTouch>& touch) {
    const bool was_touching = std::exchange(touching, detector.touching());
    if (!was_touching || touching) {
      return;
    }
    std::vector<DetectedTouch> found = stroke ? stroke->finish() : std::vector<DetectedTouch>();
    if (found.empty() && touch) {
      found.push_back(*touch);
    }
    watch.end(!found.empty());
    for (const DetectedTouch& one : found) {
      without_pose += append(one, options.unposed, recording) ? 0 : 1;
    }
  };
  const Rest rest = rest_of(*stream, thresholds, options.detector.drift_s);
  if (rest.falls) {
    refuse(options.frames,
           "its readings fall in presses, where Palpate needs readings that rise; import it again "
           "with --sign -1; if it is pressed most of the time, give --drift-s 0 instead");
  }
  StreamTime time;
  std::vector<double> rest_now;
  std::optional<double> last_s;
  std::uint64_t backwards = 0;
  for (stream->start(); !stream->ended();) {
    std::optional<Frame> frame = stream->next({});
    if (!frame) {
      continue;
    }
    if (is_readable(*frame, sensor.valid)) {
      backwards += last_s && frame->host_time_s < *last_s ? 1 : 0;
      last_s = frame->host_time_s;
      rest.at(time.advance(frame->host_time_s), rest_now);
      std::ranges::transform(frame->values, rest_now, frame->values.begin(), std::minus<>{});
    } else {
      ++unreadable;
    }
    unknown += unknown_readings(*frame, sensor.valid);
    const std::optional<DetectedTouch> touch = detector.add(*frame);
    watch.add(*frame, detector.smoothed(), detector.touching());
    if (stroke && detector.touching()) {
      stroke->add(*frame);
    }
    take(touch);
  }
  take(detector.finish());
  const std::optional<SetupFinding> clock = clock_of(sensor.findings);
  if (const auto finding = dropped(recording.size(), without_pose, watch.missed(), clock)) {
    recording.findings.push_back(*finding);
  }
  const std::vector<std::string> findings =
      frame_findings(rest, backwards, stream->counters().frames);

  if (recording.size() == 0) {
    if (without_pose > 0) {
      refuse(options.frames,
             "none of its {} touches has a pose; {}, or keep them for 'palpate map --unposed' with "
             "--unposed",
             without_pose,
             clock ? fmt::format("import again with --{}", fmt::join(clock->options, " --"))
                   : "record again with --poses");
    }
    std::vector<std::string> reasons = findings;
    if (clock) {
      reasons.push_back(in_flags(clock->words));
    }
    const std::vector<std::string> of_presses = watch.reasons(sensor.pressure_unit);
    reasons.insert(reasons.end(), of_presses.begin(), of_presses.end());
    refuse(options.frames, "no touch in its {} frames: {}", stream->counters().frames,
           fmt::format("{}", fmt::join(reasons, "; ")));
  }
  shorten_valid(recording, sensor.valid);
  write_recording(options.output, recording);
  std::uint64_t lost = stream->counters().lost;
  count_lost(lost, unreadable);
  fmt::print(
      "{}: {} touches in {} frames of {}{}{}{}{}{}\n", options.output, recording.size(),
      stream->counters().frames, options.frames, also(without_pose, "without a pose left out"),
      also(watch.missed(), "left out as not steady"),
      clock ? fmt::format(", clocks differ (palpate import --{})", fmt::join(clock->options, " --"))
            : "",
      also(lost, "lost"), also(unknown, "readings unknown"));
  for (const std::string& words : findings) {
    tell_on_stderr(fmt::format("{}: {}", options.frames, words));
  }
  close_input(options.frames);
}

}  // namespace

void add_touches(CLI::App& app) {
  const auto [command, options] = add_command<TouchesArguments>(
      app, "touches",
      "Find the touches in a recording of frames and write them for 'palpate map' and 'palpate "
      "recognize'. A recording that was cut off is closed, as by 'palpate info --close'",
      find_touches);
  add_required(*command, "FRAMES", options->frames,
               "Recording of frames, as 'palpate record' writes it (HDF5)");
  add_required(*command, "-o,--output", options->output,
               "Recording of touches to write (HDF5): per touch, the mean pressures above the "
               "elements' rest in its steady phase");
  add_detector_flags(*command, options->detector,
                     "32, and what comes or goes by less than the onset in 3 s is drift; 0: the "
                     "rest is the recording's baseline");
  command->add_option("--slide", options->slide_mm,
                      "Presses during which the array slides: cut each into touches, one every so "
                      "many millimetres where the array moves steadily, with the pose at its "
                      "middle, mm [default: a press is one touch, where the array stands still]");
  command->add_flag(
      "--unposed", options->unposed,
      "The sensor's poses are unknown: write every touch at the pose 0, for 'palpate map "
      "--unposed', 'palpate calibrate --unposed' and 'palpate recognize --each-frame'");
}

}  // namespace palpate::cli
