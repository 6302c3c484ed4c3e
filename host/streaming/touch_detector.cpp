#include "palpate/touch_detector.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "model/moved_from.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_track.hpp"
#include "streaming/frame_smoother.hpp"
#include "streaming/steady_phase.hpp"

namespace palpate {

namespace {

// After a release the skin creeps back for a while, which is no drift.
constexpr double rest_s = 0.5;

void require(const char* field, double value, bool in_range, const char* range) {
  if (!std::isfinite(value) || !in_range) {
    throw Error(Fault::input,
                fmt::format("touch detector {} = {}: make it {}", field, value, range));
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
        baseline(std::move(untouched)),
        valid(std::move(alive)),
        smoother(options.smooth_s, options.largest_gap_s),
        phase(options) {}

  std::optional<DetectedTouch> add(const Frame& frame);
  bool take(const Frame& frame);
  void follow_drift(const std::vector<double>& smooth, double elapsed_s);
  void end_phase();
  std::optional<DetectedTouch> end_touch();

  TouchDetectorOptions options;
  std::vector<double> baseline;
  std::vector<std::uint8_t> valid;
  FrameSmoother smoother;
  SteadyPhase phase;                  // steady phase under way
  std::optional<DetectedTouch> best;  // longest finished phase of this touch
  std::vector<double> pressure;       // [e] of the present frame, above the baseline; NaN: Unknown
  std::optional<double> last_s;       // time of the last frame
  std::optional<double> released_s;   // end of the last touch
  bool touching = false;
};

// Subtracts the baseline. Returns false for a frame without a known reading or a finite time.
bool TouchDetector::Impl::take(const Frame& frame) {
  const std::size_t e = frame.values.size();
  if (baseline.empty()) {
    baseline.assign(e, 0.0);
  }
  if (e != baseline.size() || (!valid.empty() && valid.size() != e)) {
    throw Error(Fault::input, fmt::format("a frame has {} values where {} are expected; feed the "
                                          "touch detector the frames of one array",
                                          e, baseline.size()));
  }
  pressure.resize(e);
  bool any_known = false;
  for (std::size_t i = 0; i < e; ++i) {
    const bool known = (valid.empty() || valid[i] != 0) && is_known(frame.values[i]);
    pressure[i] = known ? frame.values[i] - baseline[i] : std::numeric_limits<double>::quiet_NaN();
    any_known = any_known || known;
  }
  return any_known && std::isfinite(frame.host_time_s);
}

std::optional<DetectedTouch> TouchDetector::Impl::add(const Frame& frame) {
  if (!take(frame)) {
    return {};
  }
  const double time_s = frame.host_time_s;
  std::optional<DetectedTouch> ended;
  const double elapsed_s = last_s ? time_s - *last_s : 0.0;
  if (elapsed_s > options.largest_gap_s || elapsed_s < 0.0) {
    ended = end_touch();
    released_s = time_s;
    smoother.reset();
  }
  last_s = time_s;

  const std::vector<double>& smooth = smoother.add(time_s, pressure);
  double largest = 0.0;
  double load = 0.0;
  for (const double p : smooth) {
    largest = std::max(largest, p);
    load += std::max(0.0, p - options.release);
  }
  if (!touching && largest <= options.onset) {
    if (largest < options.release && (!released_s || time_s - *released_s > rest_s)) {
      follow_drift(smooth, elapsed_s);
    }
    return ended;
  }
  if (touching && largest < options.release) {
    released_s = time_s;
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

void TouchDetector::Impl::follow_drift(const std::vector<double>& smooth, double elapsed_s) {
  if (options.drift_s <= 0.0) {
    return;
  }
  const double part = std::clamp(elapsed_s / options.drift_s, 0.0, 1.0);
  for (std::size_t i = 0; i < baseline.size(); ++i) {
    // The bound keeps two frames of -1e38 from becoming the baseline.
    baseline[i] += part * std::max(smooth[i], -options.onset);
  }
}

void TouchDetector::Impl::end_phase() {
  const auto duration = [](const DetectedTouch& touch) { return touch.end_s - touch.begin_s; };
  if (std::optional<DetectedTouch> touch = phase.touch()) {
    if (!best || duration(*touch) > duration(*best)) {
      best = std::move(touch);
    }
  }
  phase.clear();
}

std::optional<DetectedTouch> TouchDetector::Impl::end_touch() {
  end_phase();
  touching = false;
  return std::exchange(best, std::nullopt);
}

TouchDetector::TouchDetector(const TouchDetectorOptions& options, std::vector<double> baseline,
                             std::vector<std::uint8_t> valid)
    : impl_(std::make_unique<Impl>(options, std::move(baseline), std::move(valid))) {
  validate(options);
  if (!impl_->baseline.empty() && !impl_->valid.empty() &&
      impl_->baseline.size() != impl_->valid.size()) {
    throw Error(Fault::input,
                fmt::format("touch detector: {} baseline and {} valid values; make them agree",
                            impl_->baseline.size(), impl_->valid.size()));
  }
  for (std::size_t i = 0; i < impl_->baseline.size(); ++i) {
    const bool alive = impl_->valid.empty() || impl_->valid[i] != 0;
    if (!alive) {
      impl_->baseline[i] = 0.0;
    }
    require("baseline", impl_->baseline[i], is_known(impl_->baseline[i]),
            "a pressure that float32 holds");
  }
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
  detector.released_s.reset();  // the next stream may begin at any time
  return touch;
}

const std::optional<DetectedTouch>& TouchDetector::candidate() const { return impl().best; }
bool TouchDetector::touching() const { return impl().touching; }
const std::vector<double>& TouchDetector::smoothed() const { return impl().smoother.means(); }
const std::vector<double>& TouchDetector::baseline() const { return impl().baseline; }

}  // namespace palpate
