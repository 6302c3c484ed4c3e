#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/interruption.hpp"
#include "cli/options.hpp"
#include "cli/sensor_option.hpp"
#include "model/printable.hpp"
#include "model/stream_time.hpp"
#include "palpate/error.hpp"
#include "palpate/frame_recorder.hpp"
#include "palpate/sensor.hpp"
#include "palpate/touch_detector.hpp"
#include "palpate/virtual_sensor.hpp"

namespace palpate::cli {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

struct RecordArguments : SensorArguments {
  std::string output;
  std::optional<double> seconds;
  double tare_s = 0.5;
  std::string object;
};

/// Records the sensor's frames until --seconds are over, the sensor ends or a signal interrupts.
/// Those of the tare wait in memory until the baseline is known, so that a tare that fails leaves
/// an older file as it is.
class FrameRecording {
 public:
  /// @param tare_s duration of the tare in seconds; 0: the sensor knows its baseline, or has none
  FrameRecording(const std::string& output, SensorDescription sensor, double tare_s)
      : output_(output), sensor_(std::move(sensor)), tare_s_(tare_s) {
    if (tare_s_ == 0.0) {
      recorder_.emplace(output_, sensor_);
    }
  }

  void record(Sensor& sensor, std::optional<double> seconds, const Interruption& interruption) {
    StreamTime time;
    Clock::time_point heard = Clock::now();
    while (!interruption.requested()) {
      if (const std::optional<Frame> frame = sensor.next(100ms)) {
        heard = Clock::now();
        const double elapsed_s = time.advance(frame->host_time_s);
        if (seconds && elapsed_s >= *seconds) {
          break;
        }
        add(*frame, elapsed_s);
        continue;
      }
      // A silent board ends too, after --seconds, or a script would wait forever.
      const std::chrono::duration<double> silent_s = Clock::now() - heard;
      if (sensor.ended() || (seconds && silent_s.count() > *seconds)) {
        break;
      }
      if (recorder_) {
        recorder_->flush();
      }
    }
  }

  /// Closes the file, and returns its frames and seconds in words. Throws Error where no frame was
  /// recorded or the array was touched during the tare; no recording is left then.
  std::string close(const std::string& sensor) {
    if (!recorder_ && !of_tare_.empty()) {
      end_tare();
    }
    const std::uint64_t frames = recorder_ ? recorder_->frames() : 0;
    if (frames + (recorder_ ? recorder_->unreadable() : 0) == 0) {
      throw Error(Fault::system,
                  fmt::format("sensor {}: no frame came; see palpate sensors", sensor));
    }
    if (frames == 0) {
      refuse("sensor " + sensor,
             "none of its {} frames has both a known reading and a time; check the board and its "
             "connection with palpate sensors",
             recorder_->unreadable());
    }
    recorder_->close();
    return fmt::format(
        "{} frames in {:.3f} s{}, {} lost, {} with a pose{}", frames, elapsed_s_,
        frames > 1 && elapsed_s_ > 0.0
            ? fmt::format(", {:.1f} Hz", static_cast<double>(frames - 1) / elapsed_s_)
            : "",
        recorder_->lost(), recorder_->with_pose(),
        recorder_->unknown_readings() > 0
            ? fmt::format(", {} readings unknown", recorder_->unknown_readings())
            : "");
  }

 private:
  void add(const Frame& frame, double elapsed_s) {
    elapsed_s_ = elapsed_s;
    if (recorder_) {
      recorder_->add(frame);
      return;
    }
    of_tare_.push_back(frame);
    if (elapsed_s_ >= tare_s_) {
      end_tare();
    }
  }

  void end_tare() {
    const bool raw = sensor_.pressure_unit == "raw";
    sensor_.baseline = baseline_of(
        of_tare_, sensor_, raw ? std::nullopt : std::optional(TouchDetectorOptions{}.onset));
    recorder_.emplace(output_, sensor_);
    for (const Frame& frame : of_tare_) {
      recorder_->add(frame);
    }
    of_tare_ = {};
  }

  std::string output_;
  SensorDescription sensor_;
  double tare_s_;
  std::vector<Frame> of_tare_;
  double elapsed_s_ = 0.0;                 ///< at the last frame that was recorded
  std::optional<FrameRecorder> recorder_;  ///< once the baseline is known
};

void record(const RecordArguments& options) {
  CommandFiles files;
  add_sensor_files(options, files);
  files.writes("-o", options.output).prepare();
  if (options.seconds) {
    require_above("--seconds", *options.seconds, 0.0);
  } else if (is_endless_flood(options.sensor)) {
    refuse("sensor " + options.sensor,
           "the simulation has no end and gives more than 10 MB/s, which would fill the disk; give "
           "--seconds, touches=N, or a lower rate or speed");
  }
  require_above("--tare", options.tare_s, 0.0, true);
  if (!is_printable(options.object)) {
    refuse("--object", "give printable text, in UTF-8");
  }
  const OpenSensor opened = open_sensor(options, tell_on_stderr);
  Sensor& sensor = *opened.sensor;
  SensorDescription description = sensor.description();
  if (!options.object.empty()) {
    description.object = options.object;
  }

  const Interruption interruption;
  FrameRecording recording(options.output, description,
                           description.baseline.empty() ? options.tare_s : 0.0);
  sensor.start();
  recording.record(sensor, options.seconds, interruption);
  sensor.stop();
  fmt::print("{}: {}\n", options.output, recording.close(options.sensor));
  report_refused(opened);
}

}  // namespace

void add_record(CLI::App& app) {
  const auto [command, options] =
      add_command<RecordArguments>(app, "record",
                                   "Record the frames of a sensor until Ctrl-C; 'palpate touches' "
                                   "finds the touches in them. After the tare, a kill, a crash or "
                                   "a full disk costs at most the last second of the recording",
                                   record);
  add_sensor_flags(*command, *options, "");
  command
      ->add_option("-o,--output", options->output,
                   "Recording of frames to write (HDF5); replaces an older file")
      ->required();
  command->add_option("--seconds", options->seconds,
                      "Stop after this time, s [default: at Ctrl-C]. Required for a simulation of "
                      "more than 10 MB/s without touches=N");
  command
      ->add_option("--tare", options->tare_s,
                   "Duration of the tare at the start, s: nothing may touch the array, and the "
                   "median of its frames becomes the baseline. If it is touched, or an element has "
                   "no known reading, nothing is recorded and an older file stays. 0: no tare")
      ->capture_default_str();
  command->add_option("--object", options->object, "Label of the touched object");
}

}  // namespace palpate::cli
