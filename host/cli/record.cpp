#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/interruption.hpp"
#include "cli/options.hpp"
#include "cli/sensor_option.hpp"
#include "cli/text_table.hpp"
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
/// an older file as it is. Returns the frames and seconds in words. Throws Error where no frame was
/// recorded or the array was touched during the tare; no recording is left then.
std::string record_frames(Sensor& sensor, SensorDescription description,
                          const RecordArguments& options) {
  const Interruption interruption;
  const bool tared = description.baseline.empty() && options.tare_s > 0.0;
  std::vector<Frame> of_tare;
  std::optional<FrameRecorder> recorder;  // once the baseline is known
  const auto begin = [&] {
    if (tared) {
      const bool raw = description.pressure_unit == "raw";
      description.baseline = baseline_of(
          of_tare, description, raw ? std::nullopt : std::optional(TouchDetectorOptions{}.onset));
    }
    recorder.emplace(options.output, description);
    for (const Frame& frame : std::exchange(of_tare, {})) {
      recorder->add(frame);
    }
  };
  if (!tared) {
    begin();
  }
  sensor.start();
  StreamTime time;
  double elapsed_s = 0.0;  // at the last frame that was recorded
  for (Clock::time_point heard = Clock::now(); !interruption.requested();) {
    if (const std::optional<Frame> frame = sensor.next(100ms)) {
      heard = Clock::now();
      const double now_s = time.advance(frame->host_time_s);
      if (options.seconds && now_s >= *options.seconds) {
        break;
      }
      elapsed_s = now_s;
      if (recorder) {
        recorder->add(*frame);
        continue;
      }
      of_tare.push_back(*frame);
      if (elapsed_s >= options.tare_s) {
        begin();
      }
      continue;
    }
    // A silent board ends too, after --seconds, or a script would wait forever.
    const std::chrono::duration<double> silent_s = Clock::now() - heard;
    if (sensor.ended() || (options.seconds && silent_s.count() > *options.seconds)) {
      break;
    }
    if (recorder) {
      recorder->flush();
    }
  }
  sensor.stop();
  if (!recorder && !of_tare.empty()) {
    begin();
  }
  const std::uint64_t frames = recorder ? recorder->frames() : 0;
  if (frames + (recorder ? recorder->unreadable() : 0) == 0) {
    throw Error(Fault::system,
                fmt::format("sensor {}: no frame came; see palpate sensors", options.sensor));
  }
  if (frames == 0) {
    refuse("sensor " + options.sensor,
           "none of its {} frames has both a known reading and a time; check the board and its "
           "connection with palpate sensors",
           recorder->unreadable());
  }
  recorder->close();
  return fmt::format("{} frames in {:.3f} s{}, {} lost, {} with a pose{}", frames, elapsed_s,
                     frames > 1 && elapsed_s > 0.0
                         ? fmt::format(", {:.1f} Hz", static_cast<double>(frames - 1) / elapsed_s)
                         : "",
                     recorder->lost(), recorder->with_pose(),
                     also(recorder->unknown_readings(), "readings unknown"));
}

void record(const RecordArguments& options) {
  CommandFiles files;
  add_sensor_files(options, files);
  files.writes("-o", options.output).prepare();
  if (options.seconds) {
    require_above("--seconds", *options.seconds, 0.0);
  } else if (is_endless_flood(options.sensor)) {
    refuse("sensor " + options.sensor,
           "the simulation has no end and gives frames as fast as they are taken, which would fill "
           "the disk; give --seconds, touches=N, or a speed");
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
  fmt::print("{}: {}\n", options.output, record_frames(sensor, description, options));
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
  add_required(*command, "-o,--output", options->output,
               "Recording of frames to write (HDF5); replaces an older file");
  command->add_option("--seconds", options->seconds,
                      "Stop after this time, s [default: at Ctrl-C]. Required for a simulation "
                      "at speed=max without touches=N");
  add_with_default(*command, "--tare", options->tare_s,
                   "Duration of the tare at the start, s: nothing may touch the array, and the "
                   "median of its frames becomes the baseline. If it is touched, or an element has "
                   "no known reading, nothing is recorded and an older file stays. 0: no tare");
  command->add_option("--object", options->object, "Label of the touched object");
}

}  // namespace palpate::cli
