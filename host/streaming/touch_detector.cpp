#include "palpate/touch_detector.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "model/own_process.hpp"
#include "model/refuse.hpp"
#include "palpate/pose_track.hpp"
#include "streaming/frame_smoother.hpp"
#include "streaming/press_touches.hpp"
#include "streaming/rest_follower.hpp"

namespace palpate {

namespace {

// Beyond this many frames, the sensor's own error exceeds the mean's noise.
constexpr std::size_t most_kept = 512;
/// Consecutive frames of steady load and pose: a candidate for a touch's reading.
class SteadyPhase {
 public:
  explicit SteadyPhase(const TouchDetectorOptions& options) : options_(options) {}

  /// True where a frame of this load and pose continues the phase.
  bool fits(double load, const std::optional<Pose>& T_robot_sensor) const {
    if (frames_ == 0) {
      return true;
    }
    const double mean = load_sum_ / static_cast<double>(frames_);
    // In a light touch, noise is a large part of the load and no sign of change.
    if (std::abs(load - mean) > std::max(options_.steady * mean, options_.release)) {
      return false;
    }
    if (!T_robot_sensor || !first_pose_) {
      return true;
    }
    return glm::distance(T_robot_sensor->translation_mm, first_pose_->translation_mm) <
               options_.steady_mm &&
           std::abs(wrap_angle(T_robot_sensor->theta_rad - first_pose_->theta_rad)) <
               options_.steady_rad;
  }

  /// @param pressure [e] above the baseline; NaN: Unknown
  void add(double time_s, double load, const std::vector<double>& pressure,
           const std::optional<Pose>& T_robot_sensor) {
    load_sum_ += load;
    if (!first_pose_) {
      first_pose_ = T_robot_sensor;
    }
    if (frames_++ % stride_ != 0) {
      return;
    }
    kept_.push_back({time_s, T_robot_sensor});
    pressure_.insert(pressure_.end(), pressure.begin(), pressure.end());
    if (kept_.size() == most_kept) {
      thin();
    }
  }

  /// Returns the reading; none where the phase is too short. An element known in fewer than three
  /// frames is not valid in it.
  std::optional<DetectedTouch> touch() const {
    const std::size_t n = steady_frames();
    if (n < least_frames_of_touch ||
        kept_[n - 1].time_s - kept_[0].time_s < options_.min_steady_s) {
      return {};
    }
    const std::size_t e = pressure_.size() / kept_.size();
    return mean_touch(std::span(kept_).first(n), std::span(pressure_).first(n * e), first_pose_);
  }

  /// Forgets all frames.
  void clear() { *this = SteadyPhase(options_); }

 private:
  // Counts the frames kept before the release, which shows late in the smoothed pressures.
  std::size_t steady_frames() const {
    constexpr std::size_t median_delay = 2;
    if (kept_.size() < median_delay) {
      return 0;
    }
    std::size_t n = kept_.size() - median_delay;
    while (n > 0 && kept_[n - 1].time_s > kept_.back().time_s - options_.smooth_s) {
      --n;
    }
    return n;
  }

  // Drops every second frame kept, and keeps half as many from here on.
  void thin() {
    const std::size_t e = pressure_.size() / kept_.size();
    for (std::size_t i = 0; 2 * i < kept_.size(); ++i) {
      kept_[i] = kept_[2 * i];
      std::copy_n(pressure_.begin() + static_cast<std::ptrdiff_t>(2 * i * e), e,
                  pressure_.begin() + static_cast<std::ptrdiff_t>(i * e));
    }
    kept_.resize(most_kept / 2);
    pressure_.resize(kept_.size() * e);
    stride_ *= 2;
  }

  TouchDetectorOptions options_;
  std::size_t frames_ = 0;
  double load_sum_ = 0.0;
  std::optional<Pose> first_pose_;
  std::size_t stride_ = 1;  ///< one of this many frames is kept
  std::vector<FramePlace> kept_;
  std::vector<double> pressure_;  ///< [kept, e]
};

void require(const char* field, double value, bool in_range, const char* range) {
  if (!std::isfinite(value) || !in_range) {
    refuse(fmt::format("touch detector {} = {}", field, value), "make it {}", range);
  }
}

void validate(const TouchDetectorOptions& o) {
  require("onset", o.onset, o.onset > 0.0, "a pressure above 0");
  require("release", o.release, o.release > 0.0 && o.release <= o.onset,
          "a pressure above 0 and at most the onset");
  require("steady", o.steady, o.steady > 0.0 && o.steady < 1.0, "a part between 0 and 1");
  require("min_steady_s", o.min_steady_s, o.min_steady_s >= 0.0, "seconds, from 0");
  require("steady_mm", o.steady_mm, o.steady_mm > 0.0, "millimetres above 0");
  require("steady_rad", o.steady_rad, o.steady_rad > 0.0, "radians above 0");
  require("smooth_s", o.smooth_s, o.smooth_s >= 0.0, "seconds, from 0");
  require("drift_s", o.drift_s, o.drift_s >= 0.0, "seconds, from 0");
  require("largest_gap_s", o.largest_gap_s, o.largest_gap_s > 0.0, "seconds above 0");
}

}  // namespace

struct TouchDetector::Impl {
  Impl(const TouchDetectorOptions& detector_options, std::vector<double> untouched,
       std::vector<std::uint8_t> alive)
      : options(detector_options),
        rest(std::move(untouched), options.drift_s, options.onset),
        valid(std::move(alive)),
        smoother(options.smooth_s, options.largest_gap_s),
        phase(options) {}

  std::optional<DetectedTouch> add(const Frame& frame) {
    if (!take(frame)) {
      return {};
    }
    const double time_s = frame.host_time_s;
    std::optional<DetectedTouch> ended;
    double elapsed_s = last_s ? time_s - *last_s : 0.0;
    if (elapsed_s > options.largest_gap_s || elapsed_s < 0.0) {
      // A press may have gone on; of what was untouched, the next frames tell the drift.
      elapsed_s = touching ? 0.0 : std::min(elapsed_s, options.drift_s - options.smooth_s);
      ended = end_touch();
      rest.forget();
      smoother.reset();
      began_s.reset();
    }
    last_s = time_s;
    began_s = began_s.value_or(time_s);

    const std::vector<double>& smooth = smoother.add(time_s, pressure);
    double largest = 0.0;
    double load = 0.0;
    for (const double p : smooth) {
      largest = std::max(largest, p);
      load += std::max(0.0, p - options.release);
    }
    // A mean of too few frames may exceed the onset by noise.
    const bool settled = time_s - *began_s >= options.smooth_s;
    if (largest < options.release) {
      rest.follow(smooth, elapsed_s);
    } else if (rest.keep(smooth, elapsed_s)) {
      end_phase();  // its pressures, and the smoother's, are above the old rest
      smoother.reset();
      began_s = time_s;
      return ended;
    }
    if (!touching && (largest <= options.onset || !settled)) {
      return ended;
    }
    if (touching && largest < options.release) {
      return end_touch();  // `ended` is none: a gap leaves nothing touched
    }
    touching = true;
    const std::optional<Pose> pose = frame.T_robot_sensor && is_robot_pose(*frame.T_robot_sensor)
                                         ? frame.T_robot_sensor
                                         : std::nullopt;
    if (!phase.fits(load, pose)) {
      end_phase();
    }
    phase.add(time_s, load, pressure, pose);
    return ended;
  }

  // Subtracts the baseline. Returns false for a frame without a known reading or a finite time.
  bool take(const Frame& frame) {
    const std::size_t e = frame.values.size();
    if (rest.rest().empty()) {
      rest.resize(e);
    }
    const std::vector<double>& baseline = rest.rest();
    if (e != baseline.size() || (!valid.empty() && valid.size() != e)) {
      refuse("touch detector",
             "a frame has {} values where {} are expected; give it the frames of one array", e,
             baseline.size());
    }
    pressure.resize(e);
    bool any_known = false;
    for (std::size_t i = 0; i < e; ++i) {
      const bool known = (valid.empty() || valid[i] != 0) && is_known(frame.values[i]);
      pressure[i] =
          known ? frame.values[i] - baseline[i] : std::numeric_limits<double>::quiet_NaN();
      any_known = any_known || known;
    }
    return any_known && std::isfinite(frame.host_time_s);
  }

  void end_phase() {
    const auto duration = [](const DetectedTouch& touch) { return touch.end_s - touch.begin_s; };
    if (std::optional<DetectedTouch> touch = phase.touch()) {
      if (!best || duration(*touch) > duration(*best)) {
        best = std::move(touch);
      }
    }
    phase.clear();
  }

  std::optional<DetectedTouch> end_touch() {
    end_phase();
    touching = false;
    return std::exchange(best, std::nullopt);
  }

  TouchDetectorOptions options;
  RestFollower rest;
  std::vector<std::uint8_t> valid;
  FrameSmoother smoother;
  SteadyPhase phase;                  // steady phase under way
  std::optional<DetectedTouch> best;  // longest finished phase of this touch
  std::vector<double> pressure;       // [e] of the present frame, above the baseline; NaN: Unknown
  std::optional<double> last_s;       // time of the last frame
  std::optional<double> began_s;      // time of the first frame since a gap
  bool touching = false;
};

TouchDetector::TouchDetector(const TouchDetectorOptions& options, std::vector<double> baseline,
                             std::vector<std::uint8_t> valid) {
  validate(options);
  if (!baseline.empty() && !valid.empty() && baseline.size() != valid.size()) {
    refuse("touch detector", "{} baseline and {} valid values; make them agree", baseline.size(),
           valid.size());
  }
  for (std::size_t i = 0; i < baseline.size(); ++i) {
    if (!valid.empty() && valid[i] == 0) {
      baseline[i] = 0.0;
    }
    require("baseline", baseline[i], is_known(baseline[i]), "a pressure that float32 holds");
  }
  impl_ = std::make_unique<Impl>(options, std::move(baseline), std::move(valid));
}

TouchDetector::~TouchDetector() = default;
TouchDetector::TouchDetector(TouchDetector&&) noexcept = default;
TouchDetector& TouchDetector::operator=(TouchDetector&&) noexcept = default;

TouchDetector::Impl& TouchDetector::impl() const { return held_by(impl_, "touch detector"); }

std::optional<DetectedTouch> TouchDetector::add(const Frame& frame) { return impl().add(frame); }

std::optional<DetectedTouch> TouchDetector::finish() {
  Impl& detector = impl();
  std::optional<DetectedTouch> touch = detector.end_touch();
  detector.smoother.reset();
  detector.last_s.reset();
  detector.rest.forget();
  return touch;
}

bool TouchDetector::touching() const { return impl().touching; }
const std::vector<double>& TouchDetector::smoothed() const { return impl().smoother.means(); }
const std::vector<double>& TouchDetector::baseline() const { return impl().rest.rest(); }

}  // namespace palpate
