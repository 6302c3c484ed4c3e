#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/sensor_option.hpp"
#include "io/recording_state.hpp"
#include "model/elements_that.hpp"
#include "model/option_words.hpp"
#include "model/stream_time.hpp"
#include "palpate/baseline.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "palpate/touch_detector.hpp"
#include "palpate/virtual_sensor.hpp"

namespace palpate::cli {

namespace {

/// Watches a stream for a last touch that does not end, and for the elements that hold it.
class EndlessTouch {
 public:
  /// @param release of the touch detector
  explicit EndlessTouch(double release) : release_(release) {}

  /// Takes a frame that the detector has just taken.
  void add(const Frame& frame, const TouchDetector& detector);

  /// Returns what never releases and the remedy, as a sentence; "" where all touches end. The last
  /// touch counts as endless where it goes on to the end of the stream and over more than half of
  /// the frames. The only touch of a stream, which may just be cut short, counts where it goes over
  /// more than nine tenths.
  std::string complaint(const std::string& pressure_unit, const std::string& remedy) const;

 private:
  double release_;
  StreamTime time_;
  std::uint64_t frames_ = 0;
  std::vector<std::uint64_t> held_;  ///< [e] frames since the element was last below the release
  std::uint64_t touched_ = 0;        ///< frames of the touch under way
  double onset_s_ = 0.0;             ///< its onset, since the first frame
  bool released_before_ = false;     ///< an earlier touch has ended
};

void EndlessTouch::add(const Frame& frame, const TouchDetector& detector) {
  ++frames_;
  time_.advance(frame.host_time_s);
  const std::vector<double>& pressure = detector.smoothed();
  held_.resize(pressure.size(), 0);
  for (std::size_t i = 0; i < pressure.size(); ++i) {
    held_[i] = pressure[i] < release_ ? 0 : held_[i] + 1;
  }
  if (detector.touching()) {
    onset_s_ = touched_ == 0 ? time_.elapsed_s() : onset_s_;
    ++touched_;
  } else {
    released_before_ = released_before_ || touched_ > 0;
    touched_ = 0;
  }
}

std::string EndlessTouch::complaint(const std::string& pressure_unit,
                                    const std::string& remedy) const {
  const double part = released_before_ ? 0.5 : 0.9;
  if (static_cast<double>(touched_) <= part * static_cast<double>(frames_)) {
    return "";
  }
  std::vector<std::size_t> held;
  for (std::size_t i = 0; i < held_.size(); ++i) {
    if (held_[i] >= touched_) {
      held.push_back(i);
    }
  }
  const std::string below =
      fmt::format("below {:.4g} {} from {:.2f} s on", release_, pressure_unit, onset_s_);
  // Where most elements are held, the whole array reads too much.
  if (held.empty() || 2 * held.size() > held_.size()) {
    return fmt::format("the array never reads {}, so that its touch does not end; {}", below,
                       remedy);
  }
  return fmt::format(
      "{} {}, so that the touch does not end; mark broken elements dead in 'valid', or {}",
      elements_that(held, "never reads", "never read"), below, remedy);
}

/// Seconds of the tare where a recording has no baseline, as in `palpate record`.
constexpr double usual_tare_s = 0.5;

struct TouchesArguments {
  std::string frames;
  std::string output;
  DetectorFlags detector;
  std::optional<double> tare_s;
  bool unposed = false;
};

/// Returns the baseline: by --tare, else as the recording holds it, else by a tare as of `palpate
/// record`.
std::vector<double> baseline_for(const TouchesArguments& options, Sensor& stream,
                                 const TouchDetectorOptions& detector) {
  const SensorDescription& sensor = stream.description();
  if (!options.tare_s && !sensor.baseline.empty()) {
    return sensor.baseline;
  }
  const double tare_s = options.tare_s.value_or(usual_tare_s);
  if (tare_s == 0.0) {
    return {};
  }
  std::vector<Frame> frames;
  StreamTime time;
  stream.start();
  while (!stream.ended() && (frames.empty() || time.elapsed_s() < tare_s)) {
    if (std::optional<Frame> frame = stream.next({})) {
      time.advance(frame->host_time_s);
      frames.push_back(std::move(*frame));
    }
  }
  stream.stop();
  try {
    return baseline_of(frames, sensor, detector.onset);
  } catch (const Error& error) {
    refuse(options.frames, "{}, or give another --tare; 0: no baseline", error.what());
  }
}

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

/// Counts of a stream's presses, and why some make no touch.
struct Presses {
  std::size_t all = 0;
  std::size_t without_pose = 0;
  std::size_t unsteady = 0;
};

std::optional<SetupFinding> clock_of(std::span<const SetupFinding> findings) {
  const auto clock = std::ranges::find(findings, "clock", &SetupFinding::what);
  return clock == findings.end() ? std::nullopt : std::optional(*clock);
}

/// The finding "dropped", where a good part of the presses make no touch.
std::optional<SetupFinding> dropped(const Presses& presses,
                                    const std::optional<SetupFinding>& clock) {
  const std::size_t lost = presses.without_pose + presses.unsteady;
  if (10 * lost <= presses.all) {
    return {};
  }
  std::vector<std::string> reasons;
  if (presses.without_pose > 0) {
    reasons.push_back(fmt::format("{} without a pose", presses.without_pose));
  }
  if (presses.unsteady > 0) {
    reasons.push_back(
        fmt::format("{} that move or are steady for less than `min-steady-s`", presses.unsteady));
  }
  return SetupFinding{"dropped", 0.0,
                      fmt::format("{} of {} presses were left out: {}{}", lost, presses.all,
                                  fmt::join(reasons, ", "),
                                  clock ? fmt::format("; the clocks differ: import with `{}`",
                                                      fmt::join(clock->options, "` and `"))
                                        : ""),
                      clock ? clock->options : std::vector<std::string>{}};
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
    fmt::print(stderr, "palpate: {}; only Palpate and SWMR readers can open it\n", error.what());
  }
}

void find_touches(const TouchesArguments& options) {
  CommandFiles files;
  files.reads("FRAMES", options.frames);
  files.writes("-o", options.output);
  files.prepare();
  if (options.tare_s) {
    require_above("--tare", *options.tare_s, 0.0, true);
  }
  const std::unique_ptr<Sensor> stream =
      open_virtual_sensor("replay:" + options.frames + ",speed=max");
  const SensorDescription& sensor = stream->description();
  const TouchDetectorOptions thresholds =
      detector_options(options.detector, sensor.pressure_unit, options.frames);
  TouchDetector detector(thresholds, baseline_for(options, *stream, thresholds), sensor.valid);
  EndlessTouch endless(thresholds.release);
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
  Presses presses;
  bool touching = false;
  const auto take = [&](const std::optional<DetectedTouch>& touch) {
    const bool was_touching = std::exchange(touching, detector.touching());
    presses.unsteady += was_touching && !touching && !touch ? 1 : 0;
    presses.without_pose += touch && !append(*touch, options.unposed, recording) ? 1 : 0;
  };
  stream->start();
  while (!stream->ended()) {
    if (const std::optional<Frame> frame = stream->next({})) {
      unknown += unknown_readings(*frame, sensor.valid);
      unreadable += is_readable(*frame, sensor.valid) ? 0 : 1;
      take(detector.add(*frame));
      endless.add(*frame, detector);
    }
  }
  take(detector.finish());
  presses.all = recording.size() + presses.without_pose + presses.unsteady;
  const std::optional<SetupFinding> clock = clock_of(sensor.findings);
  if (const auto finding = dropped(presses, clock)) {
    recording.findings.push_back(*finding);
  }
  const bool tared = options.tare_s.value_or(sensor.baseline.empty() ? usual_tare_s : 0.0) > 0.0;
  const std::string complaint = endless.complaint(
      sensor.pressure_unit, tared ? "raise --onset" : "give --tare, or raise --onset");

  if (recording.size() == 0) {
    if (presses.without_pose > 0) {
      refuse(options.frames,
             "none of its {} touches has a pose; {}, or keep them for 'palpate map --unposed' with "
             "--unposed",
             presses.without_pose,
             clock ? fmt::format("import again with --{}", fmt::join(clock->options, " --"))
                   : "record again with --poses");
    }
    if (!complaint.empty() || clock) {
      refuse(options.frames, "no touch in its {} frames: {}", stream->counters().frames,
             complaint.empty() ? in_flags(clock->words) : complaint);
    }
    refuse(options.frames, "no touch in its {} frames; lower --onset or --min-steady-s{}",
           stream->counters().frames,
           tared ? ", or give --tare 0 where the readings have a baseline of 0" : "");
  }
  shorten_valid(recording, sensor.valid);
  write_recording(options.output, recording);
  fmt::print("{}: {} touches in {} frames of {}", options.output, recording.size(),
             stream->counters().frames, options.frames);
  if (presses.without_pose > 0) {
    fmt::print(", {} without a pose left out", presses.without_pose);
  }
  if (presses.unsteady > 0) {
    fmt::print(", {} left out as not steady", presses.unsteady);
  }
  if (clock) {
    fmt::print(", clocks differ (palpate import --{})", fmt::join(clock->options, " --"));
  }
  std::uint64_t lost = stream->counters().lost;
  count_lost(lost, unreadable);
  if (lost > 0) {
    fmt::print(", {} lost", lost);
  }
  if (unknown > 0) {
    fmt::print(", {} readings unknown", unknown);
  }
  fmt::print("\n");
  if (!complaint.empty()) {
    fmt::print(stderr, "palpate: {}: {}\n", options.frames, complaint);
  }
  close_input(options.frames);
}

}  // namespace

void add_touches(CLI::App& app) {
  auto* command = app.add_subcommand(
      "touches",
      "Find the touches in a recording of frames and write them for 'palpate map' and 'palpate "
      "recognize'. A recording that was cut off is closed, as by 'palpate info --close'");
  const auto options = std::make_shared<TouchesArguments>();
  command
      ->add_option("FRAMES", options->frames,
                   "Recording of frames, as 'palpate record' writes it (HDF5)")
      ->required();
  command
      ->add_option("-o,--output", options->output,
                   "Recording of touches to write (HDF5): per touch, the mean pressures above the "
                   "baseline in its steady phase")
      ->required();
  add_detector_flags(*command, options->detector);
  command->add_option(
      "--tare", options->tare_s,
      "Seconds at the start in which nothing may touch the array and its baseline is read; 0: no "
      "baseline [default: the recording's baseline, or 0.5 where it has none]");
  command->add_flag("--unposed", options->unposed,
                    "The sensor's poses are unknown: write every touch at the pose 0, for 'palpate "
                    "map --unposed', 'palpate calibrate --unposed' and 'palpate recognize "
                    "--each-frame'");
  command->callback([options] { find_touches(*options); });
}

}  // namespace palpate::cli
