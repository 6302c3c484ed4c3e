#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "commands.hpp"
#include "input_file.hpp"
#include "interruption.hpp"
#include "options.hpp"
#include "palpate/baseline.hpp"
#include "palpate/error.hpp"
#include "palpate/frame_recorder.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/touch_detector.hpp"
#include "sensor_option.hpp"

namespace palpate::cli {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

struct Options {
  std::string sensor;
  std::string output;
  std::optional<double> seconds;
  std::string poses;
  double tare_s = 0.5;
  std::string object;
};

/// Frames until they are enough, the sensor has ended or somebody interrupts.
class FrameSource {
 public:
  FrameSource(Sensor& sensor, std::optional<double> seconds) : sensor_(sensor), seconds_(seconds) {}

  /// The next frame; none after the last, or where none came for a moment: see done().
  std::optional<Frame> next() {
    std::optional<Frame> frame = sensor_.next(100ms);
    if (!frame) {
      // A board that says nothing must not hold up a script.
      done_ =
          interruption_.requested() || sensor_.ended() ||
          (seconds_ && std::chrono::duration<double>(Clock::now() - heard_).count() > *seconds_);
      return {};
    }
    heard_ = Clock::now();
    first_s_ = first_s_.value_or(frame->host_time_s);
    if (interruption_.requested() || (seconds_ && frame->host_time_s - *first_s_ >= *seconds_)) {
      done_ = true;
      return {};
    }
    return frame;
  }

  bool done() const { return done_; }

 private:
  Interruption interruption_;
  Sensor& sensor_;
  std::optional<double> seconds_;
  Clock::time_point heard_ = Clock::now();
  std::optional<double> first_s_;
  bool done_ = false;
};

/// The stream's first frames, over the time of the tare.
std::vector<Frame> first_frames(FrameSource& source, double tare_s) {
  std::vector<Frame> frames;
  while (!source.done() &&
         (frames.empty() || frames.back().host_time_s - frames.front().host_time_s < tare_s)) {
    if (std::optional<Frame> frame = source.next()) {
      frames.push_back(std::move(*frame));
    }
  }
  return frames;
}

/// What became of the stream.
struct Summary {
  double begin_s = 0.0;
  double end_s = 0.0;
  std::uint64_t posed = 0;

  void count(const Frame& frame) {
    begin_s = begin_s == 0.0 ? frame.host_time_s : begin_s;
    end_s = frame.host_time_s;
    posed += frame.T_robot_sensor ? 1 : 0;
  }
};

void print(const Options& options, const FrameRecorder& recorder, const Summary& summary) {
  const double seconds = summary.end_s - summary.begin_s;
  const std::uint64_t frames = recorder.frames();
  fmt::print("{}: {} frames in {:.3f} s", options.output, frames, seconds);
  if (seconds > 0.0) {
    fmt::print(", {:.1f} Hz", static_cast<double>(frames - 1) / seconds);
  }
  fmt::print(", {} lost, {} with a pose\n", recorder.lost(), summary.posed);
}

void record(const Options& options) {
  require_writable(options.output);
  if (options.seconds) {
    require_above("--seconds", *options.seconds, 0.0);
  }
  require_above("--tare", options.tare_s, 0.0, true);
  if (!is_printable_utf8(options.object)) {
    throw Error(Fault::input, "--object: give printable text, in UTF-8");
  }
  std::unique_ptr<Sensor> sensor = open_sensor(options.sensor);
  PosedSensor* posed = nullptr;
  if (!options.poses.empty()) {
    auto with_poses = std::make_unique<PosedSensor>(std::move(sensor), options.poses);
    posed = with_poses.get();
    sensor = std::move(with_poses);
  }
  SensorDescription description = sensor->description();
  if (!options.object.empty()) {
    description.object = options.object;
  }
  const bool tare = options.tare_s > 0.0 && description.baseline.empty();

  FrameSource source(*sensor, options.seconds);
  sensor->start();
  const std::vector<Frame> first = first_frames(source, tare ? options.tare_s : 0.0);
  if (first.empty()) {
    throw Error(Fault::system,
                fmt::format("sensor {}: no frame came; see palpate sensors", options.sensor));
  }
  if (tare) {
    const bool raw = description.pressure_unit == "raw";
    description.baseline = baseline_of(
        first, description, raw ? std::nullopt : std::optional(TouchDetectorOptions{}.onset));
  }
  FrameRecorder recorder(options.output, description);
  Summary summary;
  const auto add = [&](const Frame& frame) {
    recorder.add(frame);
    summary.count(frame);
  };
  for (const Frame& frame : first) {
    add(frame);
  }
  while (!source.done()) {
    if (const std::optional<Frame> frame = source.next()) {
      add(*frame);
    } else {
      recorder.flush();
    }
  }
  sensor->stop();
  recorder.close();
  print(options, recorder, summary);
  if (posed != nullptr && posed->poses().refused > 0) {
    fmt::print(stderr, "palpate: {} lines were no poses; the first: {}\n", posed->poses().refused,
               posed->poses().first_refused);
  }
}

}  // namespace

void add_record(CLI::App& app) {
  auto* command = app.add_subcommand(
      "record",
      "Record the frames of a sensor until Ctrl-C. Whatever happens meanwhile, the file holds all "
      "but the last second; 'palpate touches' finds the touches in it");
  const auto options = std::make_shared<Options>();
  command->add_option("--sensor", options->sensor, sensor_help)->required();
  command
      ->add_option("-o,--output", options->output,
                   "Recording of frames to write (HDF5); an older file is replaced")
      ->required();
  command->add_option("--seconds", options->seconds, "End after this time, in seconds");
  command->add_option("--poses", options->poses,
                      "File, FIFO or - (standard input) with the sensor's poses, a line each: "
                      "{\"time\": s since 1970, \"x_mm\": mm, \"y_mm\": mm, \"theta_rad\": rad}");
  command
      ->add_option("--tare", options->tare_s,
                   "The array's baseline is read from the first seconds, when nothing touches it; "
                   "0: none")
      ->capture_default_str();
  command->add_option("--object", options->object, "Label of the object that is touched");
  command->callback([options] { record(*options); });
}

}  // namespace palpate::cli
