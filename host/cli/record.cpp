#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "command_files.hpp"
#include "commands.hpp"
#include "input_file.hpp"
#include "interruption.hpp"
#include "options.hpp"
#include "palpate/baseline.hpp"
#include "palpate/error.hpp"
#include "palpate/frame_recorder.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/touch_detector.hpp"
#include "palpate/virtual_sensor.hpp"
#include "sensor_option.hpp"
#include "stream_time.hpp"

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
    const double elapsed_s = time_.advance(frame->host_time_s);
    if (interruption_.requested() || (seconds_ && elapsed_s >= *seconds_)) {
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
  StreamTime time_;
  bool done_ = false;
};

/// What stood under a recording's name before it: kept beside it until the recording is known to be
/// wanted. A process that is killed leaves both.
class OlderFile {
 public:
  explicit OlderFile(std::filesystem::path file)
      : file_(std::move(file)), kept_(file_.string() + fmt::format(".before-{}", ::getpid())) {
    existed_ = ::access(file_.c_str(), F_OK) == 0;
    // Some file systems have no links.
    is_kept_ = existed_ && ::link(file_.c_str(), kept_.c_str()) == 0;
  }
  ~OlderFile() { let_go(); }
  OlderFile(const OlderFile&) = delete;
  OlderFile& operator=(const OlderFile&) = delete;

  /// Takes the recording away.
  void restore() {
    std::error_code ignored;
    if (is_kept_) {
      std::filesystem::rename(kept_, file_, ignored);
      is_kept_ = false;
    } else if (!existed_) {
      std::filesystem::remove(file_, ignored);
    }
  }
  /// The recording has taken its place.
  void let_go() {
    std::error_code ignored;
    if (is_kept_) {
      std::filesystem::remove(kept_, ignored);
      is_kept_ = false;
    }
  }

 private:
  std::filesystem::path file_;
  std::filesystem::path kept_;
  bool existed_ = false;
  bool is_kept_ = false;
};

/// A recording under way. The frames of the tare are saved like all others, and the baseline is
/// stored when it is known.
class RecordingUnderWay {
 public:
  /// @param tare_s over which the baseline is taken; 0: it is known, or there is none
  RecordingUnderWay(const std::string& output, const SensorDescription& sensor, double tare_s)
      : sensor_(sensor), tare_s_(tare_s), older_(output), recorder_(std::in_place, output, sensor) {
    if (taring()) {
      recorder_->expect_baseline();
    } else {
      older_.let_go();
    }
  }

  void add(const Frame& frame) {
    recorder_->add(frame);
    time_.advance(frame.host_time_s);
    posed_ += frame.T_robot_sensor ? 1 : 0;
    if (taring()) {
      first_.push_back(frame);
      if (time_.elapsed_s() >= tare_s_) {
        end_tare();
      }
    }
  }
  void flush() { recorder_->flush(); }
  bool empty() const { return recorder_->frames() + recorder_->lost() == 0; }

  /// Throws Error where the array was touched during the tare: there is no recording then.
  void close() {
    if (taring() && !first_.empty()) {
      end_tare();
    }
    recorder_->close();
  }

  void print_summary(const std::string& output) const {
    const double seconds = time_.elapsed_s();
    const std::uint64_t frames = recorder_->frames();
    fmt::print("{}: {} frames in {:.3f} s", output, frames, seconds);
    if (seconds > 0.0) {
      fmt::print(", {:.1f} Hz", static_cast<double>(frames - 1) / seconds);
    }
    fmt::print(", {} lost, {} with a pose", recorder_->lost(), posed_);
    if (recorder_->unknown_readings() > 0) {
      fmt::print(", {} readings unknown", recorder_->unknown_readings());
    }
    fmt::print("\n");
  }

 private:
  bool taring() const { return tare_s_ > 0.0; }

  void end_tare() {
    const bool raw = sensor_.pressure_unit == "raw";
    std::vector<double> baseline;
    try {
      baseline = baseline_of(first_, sensor_,
                             raw ? std::nullopt : std::optional(TouchDetectorOptions{}.onset));
    } catch (...) {
      recorder_.reset();
      older_.restore();
      throw;
    }
    recorder_->set_baseline(std::move(baseline));
    older_.let_go();
    tare_s_ = 0.0;
    first_ = {};
  }

  SensorDescription sensor_;
  double tare_s_;
  std::vector<Frame> first_;  ///< of the tare
  StreamTime time_;
  std::uint64_t posed_ = 0;
  OlderFile older_;
  std::optional<FrameRecorder> recorder_;
};

void record(const Options& options) {
  CommandFiles files;
  add_sensor_files(options.sensor, options.poses, files);
  files.writes("-o", options.output);
  files.require_distinct();
  require_writable(options.output);
  if (options.seconds) {
    require_above("--seconds", *options.seconds, 0.0);
  } else if (is_endless_flood(options.sensor)) {
    throw Error(Fault::input,
                fmt::format("sensor {}: frames without an end at this speed would fill the disk; "
                            "give --seconds, touches=N or a lower speed",
                            options.sensor));
  }
  require_above("--tare", options.tare_s, 0.0, true);
  if (!is_printable_utf8(options.object)) {
    throw Error(Fault::input, "--object: give printable text, in UTF-8");
  }
  std::unique_ptr<Sensor> sensor = open_sensor(options.sensor);
  PosedSensor* posed = nullptr;
  if (!options.poses.empty()) {
    auto with_poses = std::make_unique<PosedSensor>(
        std::move(sensor), options.poses, PosedSensor::usual_gap_s,
        [](const std::string& problem) { fmt::print(stderr, "palpate: {}\n", problem); });
    posed = with_poses.get();
    sensor = std::move(with_poses);
  }
  SensorDescription description = sensor->description();
  if (!options.object.empty()) {
    description.object = options.object;
  }

  FrameSource source(*sensor, options.seconds);
  RecordingUnderWay recording(options.output, description,
                              description.baseline.empty() ? options.tare_s : 0.0);
  sensor->start();
  while (!source.done()) {
    if (const std::optional<Frame> frame = source.next()) {
      recording.add(*frame);
    } else {
      recording.flush();
    }
  }
  sensor->stop();
  if (recording.empty()) {
    throw Error(Fault::system,
                fmt::format("sensor {}: no frame came; see palpate sensors", options.sensor));
  }
  recording.close();
  recording.print_summary(options.output);
  if (posed != nullptr) {
    report_refused(posed->poses());
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
  command->add_option(
      "--seconds", options->seconds,
      "End after this time, in seconds. A simulation that gives more than 10 MB a "
      "second, by rate=, array= and speed=, needs it, unless its touches= are given");
  command->add_option("--poses", options->poses, poses_help);
  command
      ->add_option("--tare", options->tare_s,
                   "The array's baseline is read from the first seconds, when nothing touches it; "
                   "they are recorded, too. 0: none")
      ->capture_default_str();
  command->add_option("--object", options->object, "Label of the object that is touched");
  command->callback([options] { record(*options); });
}

}  // namespace palpate::cli
