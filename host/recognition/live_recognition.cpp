#include "recognition/live_recognition.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>
#include <utility>

#include "palpate/pose_track.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

namespace {

using namespace std::chrono_literals;

// A simulation at full speed would fill the memory, and finish() would have to use all of them.
constexpr std::size_t most_jobs = 64;

}  // namespace

LiveRecognition::LiveRecognition(Sensor& sensor, std::vector<glm::dvec2> elements_mm,
                                 Recogniser& recogniser, const RecognitionTask& task,
                                 const LiveOptions& options,
                                 std::function<void(const LiveTouch&)> on_touch)
    : sensor_(sensor),
      description_(sensor.description()),
      elements_mm_(std::move(elements_mm)),
      recogniser_(recogniser),
      task_(task),
      options_(options),
      on_touch_(std::move(on_touch)) {
  reader_ = std::thread([this] { guard(&LiveRecognition::read); });
  believer_ = std::thread([this] { guard(&LiveRecognition::believe); });
}

LiveRecognition::~LiveRecognition() {
  {
    const std::lock_guard lock(mutex_);
    jobs_.clear();
  }
  try {
    finish();
  } catch (...) {
    // Whoever wanted to know has called finish() before.
  }
}

void LiveRecognition::guard(void (LiveRecognition::*work)()) {
  sigset_t all;  // signals are for the thread that can end this one
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_SETMASK, &all, nullptr);
  try {
    (this->*work)();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = failure_ ? failure_ : std::current_exception();
    stop_ = true;
    all_read_ = true;
    jobs_.clear();
  }
  changed_.notify_all();
}

LiveState LiveRecognition::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::vector<double> LiveRecognition::latencies_ms() const {
  const std::lock_guard lock(mutex_);
  return latencies_ms_;
}

bool LiveRecognition::wait_for_end(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, timeout, [&] { return ended_ || failure_; });
}

bool LiveRecognition::failed() const {
  const std::lock_guard lock(mutex_);
  return failure_ != nullptr;
}

void LiveRecognition::reset() {
  between_touches([this] {
    recogniser_.reset();
    used_.clear();
    {
      const std::lock_guard lock(mutex_);
      if (state_.touches == 0) {  // one that was never touched is the same still
        return;
      }
      ++state_.unknown;
      state_.touches = 0;
      state_.last.reset();
    }
    if (options_.on_unknown) {
      options_.on_unknown();
    }
  });
}

void LiveRecognition::leave_out(std::size_t touch, bool out) {
  between_touches([this, touch, out] {
    const auto others = std::ranges::count(used_, false, &UsedTouch::left_out);
    if (touch >= used_.size() || used_[touch].left_out == out || (out && others == 1)) {
      return;
    }
    used_[touch].left_out = out;
    std::vector<Touch> touches;
    for (const UsedTouch& used : used_) {
      if (!used.left_out) {
        touches.push_back(view_of(used.touch));
      }
    }
    recogniser_.reset();
    tell(step_after(touches));
  });
}

void LiveRecognition::between_touches(std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(work));
  }
  changed_.notify_all();
}

void LiveRecognition::finish() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  for (std::thread* thread : {&reader_, &believer_}) {
    if (thread->joinable()) {
      thread->join();
    }
  }
  if (failure_) {
    std::rethrow_exception(std::exchange(failure_, nullptr));
  }
}

void LiveRecognition::read() {
  sensor_.start();
  if (std::optional<TouchDetector> detector = tare()) {
    while (wait_for_room() && !sensor_.ended()) {
      if (const std::optional<Frame> frame = sensor_.next(20ms)) {
        take(*detector, *frame);
      }
    }
    taken_ = Clock::now();
    hand_on(detector->finish());
  }
  sensor_.stop();
  const std::lock_guard lock(mutex_);
  state_.touching = false;
  all_read_ = true;
}

/// Waits until another touch may be found; false where no more shall be read.
bool LiveRecognition::wait_for_room() {
  const bool gone = sensor_.gone();
  std::unique_lock lock(mutex_);
  state_.gone = gone;
  changed_.wait(lock, [&] { return stop_ || jobs_.size() < most_jobs; });
  return !stop_;
}

/// Reads what the array feels untouched, unless the sensor knows; none where that was interrupted.
std::optional<TouchDetector> LiveRecognition::tare() {
  std::vector<double> baseline = description_.baseline;
  std::vector<Frame> frames;
  StreamTime time;
  if (baseline.empty() && options_.tare_s > 0.0) {
    const auto enough = [&] {
      const std::lock_guard lock(mutex_);
      state_.taring = !stop_;
      state_.gone = sensor_.gone();
      return stop_ || sensor_.ended() || (!frames.empty() && time.elapsed_s() >= options_.tare_s);
    };
    while (!enough()) {
      if (std::optional<Frame> frame = sensor_.next(20ms)) {
        time.advance(frame->host_time_s);
        frames.push_back(std::move(*frame));
      }
    }
    {
      const std::lock_guard lock(mutex_);
      state_.taring = false;
      for (const Frame& frame : frames) {
        count(frame);
      }
      state_.counters = counters();
      if (stop_) {
        return {};
      }
    }
    baseline = baseline_of(frames, description_, options_.detector.onset);
  }
  return TouchDetector(options_.detector, std::move(baseline), description_.valid);
}

void LiveRecognition::count(const Frame& frame) {
  unreadable_ += is_readable(frame, description_.valid) ? 0 : 1;
  state_.unknown_readings += unknown_readings(frame, description_.valid);
  state_.frames_back += last_frame_s_ && frame.host_time_s < *last_frame_s_ ? 1 : 0;
  last_frame_s_ = std::isfinite(frame.host_time_s) ? frame.host_time_s : last_frame_s_;
}

SensorCounters LiveRecognition::counters() const {
  SensorCounters all = sensor_.counters();
  count_lost(all.lost, unreadable_);
  return all;
}

void LiveRecognition::take(TouchDetector& detector, const Frame& frame) {
  taken_ = Clock::now();
  const std::optional<DetectedTouch> touch = detector.add(frame);
  const bool touching = detector.touching();
  const bool below = std::ranges::any_of(detector.smoothed(),
                                         [&](double p) { return p < -options_.detector.onset; });
  const std::vector<double>& baseline = detector.baseline();
  {
    const std::lock_guard lock(mutex_);
    state_.pressure.resize(frame.values.size());
    for (std::size_t i = 0; i < frame.values.size(); ++i) {
      const double value = frame.values[i];
      state_.pressure[i] = is_known(value) ? value - (baseline.empty() ? 0.0 : baseline[i])
                                           : std::numeric_limits<double>::quiet_NaN();
    }
    count(frame);
    state_.T_robot_sensor = frame.T_robot_sensor && is_robot_pose(*frame.T_robot_sensor)
                                ? frame.T_robot_sensor
                                : std::nullopt;
    state_.touching = touching;
    state_.frames_below += below ? 1 : 0;
    state_.counters = counters();
  }
  hand_on(touch);
  const double now_s = time_.advance(frame.host_time_s);
  if (touching) {
    if (!was_touching_ && options_.reset_after_s && last_contact_s_ &&
        now_s - *last_contact_s_ > *options_.reset_after_s) {
      reset();
    }
    last_contact_s_ = now_s;
  }
  was_touching_ = touching;
}

void LiveRecognition::hand_on(const std::optional<DetectedTouch>& touch) {
  if (!touch) {
    return;
  }
  if (!touch->T_robot_sensor) {
    const std::lock_guard lock(mutex_);
    ++state_.without_pose;
    return;
  }
  between_touches([this, used = UsedTouch{*touch, counters().lost}, taken = taken_]() mutable {
    use(std::move(used), taken);
  });
}

void LiveRecognition::believe() {
  std::unique_lock lock(mutex_);
  for (;;) {
    // Work may be asked for after the stream's end, until finish().
    changed_.wait(lock, [&] { return !jobs_.empty() || (all_read_ && (stop_ || !ended_)); });
    if (jobs_.empty()) {
      ended_ = true;
      changed_.notify_all();
      if (stop_) {
        break;
      }
      continue;
    }
    std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    changed_.notify_all();
    job();
    lock.lock();
  }
}

Touch LiveRecognition::view_of(const DetectedTouch& touch) const {
  return {.T_robot_sensor = *touch.T_robot_sensor,
          .elements_mm = elements_mm_,
          .pressure = touch.pressure,
          .valid = touch.valid};
}

RecognitionStep LiveRecognition::step_after(std::span<const Touch> touches) {
  return take_step(recogniser_, task_, touches,
                   partial_truth(description_.object, description_.truth));
}

void LiveRecognition::use(UsedTouch touch, Clock::time_point taken) {
  const Touch view = view_of(touch.touch);
  RecognitionStep step = step_after(std::span(&view, 1));
  touch.readings = recogniser_.evidence().back().readings;
  used_.push_back(std::move(touch));
  const double latency_ms = std::chrono::duration<double, std::milli>(Clock::now() - taken).count();
  {
    const std::lock_guard lock(mutex_);
    ++state_.touches;
    ++state_.all_touches;
    state_.worst_latency_ms = std::max(state_.worst_latency_ms, latency_ms);
    latencies_ms_.push_back(latency_ms);
  }
  tell(std::move(step));
}

void LiveRecognition::tell(RecognitionStep step) {
  const UsedTouch& last = used_.back();
  LiveTouch result{.touch = last.touch,
                   .readings = last.readings,
                   .step = std::move(step),
                   .frames_lost = last.frames_lost};
  for (std::size_t i = 0; i < used_.size(); ++i) {
    if (used_[i].left_out) {
      result.left_out.push_back(i);
    }
  }
  {
    const std::lock_guard lock(mutex_);
    result.unknown = state_.unknown;
    result.index = state_.touches - 1;
    result.latency_ms = latencies_ms_.back();
    state_.last = result;
  }
  on_touch_(result);
  if (!options_.plan) {
    return;
  }
  result.next = plan(result.touch);
  {
    const std::lock_guard lock(mutex_);
    state_.last->next = result.next;
  }
  if (options_.on_plan) {
    options_.on_plan(result);
  }
}

PlannedTouch LiveRecognition::plan(const DetectedTouch& touch) const {
  const std::vector<glm::dvec2> living_mm = living_elements(view_of(touch));
  const PlanOptions options;
  const std::vector<PoseSample> samples =
      recogniser_.filter().sample(options.samples, options.seed);
  const std::vector<Pose> candidates =
      candidate_grid(samples, task_, living_mm, touch.T_robot_sensor->theta_rad);
  return rank_touches(recogniser_, task_, candidates, living_mm, *options_.plan, options).front();
}

}  // namespace palpate
