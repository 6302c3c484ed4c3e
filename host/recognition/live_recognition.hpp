#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "model/stream_time.hpp"
#include "palpate/sensor.hpp"
#include "palpate/touch_detector.hpp"
#include "recognition/recogniser.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/touch_plan.hpp"

namespace palpate {

/// A touch of a stream and what was believed after it.
struct LiveTouch {
  DetectedTouch touch;
  std::vector<Reading> readings = {};  ///< [e] what its elements said
  std::size_t unknown = 0;             ///< the unknown's number, from 0
  std::size_t index = 0;               ///< the touch's number on that unknown, from 0
  RecognitionStep step;
  double latency_ms = 0.0;        ///< from taking the frame that ended the touch to its estimate
  std::uint64_t frames_lost = 0;  ///< up to that frame
  std::vector<std::size_t> left_out = {};  ///< touches of the unknown that the belief leaves out
  std::optional<PlannedTouch> next = {};   ///< the best of a grid, where the options ask for it
};

/// What is known of a stream at one moment.
struct LiveState {
  std::vector<double> pressure;  ///< [e] above the baseline, NaN: Unknown; empty before the first
                                 ///< frame
  std::optional<Pose> T_robot_sensor;
  SensorCounters counters;
  bool taring = false;
  bool touching = false;
  bool gone = false;
  std::size_t unknown = 0;
  std::size_t touches = 0;       ///< on this unknown
  std::size_t all_touches = 0;   ///< with a pose, on every unknown
  std::size_t without_pose = 0;  ///< touches that were passed over
  std::uint64_t unknown_readings = 0;
  std::uint64_t frames_back = 0;   ///< frames that are older than the one before
  std::uint64_t frames_below = 0;  ///< in which an element reads below its rest by the onset
  std::optional<LiveTouch> last;
  double worst_latency_ms = 0.0;
};

struct LiveOptions {
  TouchDetectorOptions detector;
  double tare_s = 0.5;                  ///< where the sensor knows no baseline
  std::optional<double> reset_after_s;  ///< after so long without contact another unknown comes
  /// Plans the next touch by this goal after each estimate and after on_touch. Not for particles.
  std::optional<PlanGoal> plan = {};
  /// Called with a touch and its plan as soon as the plan is there, on the thread of on_touch.
  std::function<void(const LiveTouch&)> on_plan = {};
  /// Called when another unknown comes, on the thread of on_touch.
  std::function<void()> on_unknown = {};
};

/// Recognises what a sensor's stream touches, from construction on. One thread reads frames and
/// finds touches; another updates the belief, so that a slow update loses no frame. The first
/// thread waits while 64 touches wait for the second.
class LiveRecognition {
 public:
  /// Sensor, recogniser and task must outlive this object; nothing else may use sensor and
  /// recogniser meanwhile.
  /// @param elements_mm [e] in the sensor frame
  /// @param on_touch called after each estimate, before `next` is planned, on another thread than
  /// the constructor's
  LiveRecognition(Sensor& sensor, std::vector<glm::dvec2> elements_mm, Recogniser& recogniser,
                  const RecognitionTask& task, const LiveOptions& options,
                  std::function<void(const LiveTouch&)> on_touch);
  /// Ends at once.
  ~LiveRecognition();
  LiveRecognition(const LiveRecognition&) = delete;
  LiveRecognition& operator=(const LiveRecognition&) = delete;

  LiveState state() const;
  /// LiveTouch::latency_ms of every touch so far.
  std::vector<double> latencies_ms() const;
  /// Waits for at most `timeout`. Returns true once the stream has ended and all its touches are
  /// used, or something has failed.
  bool wait_for_end(std::chrono::milliseconds timeout);
  /// Whether finish() will throw.
  bool failed() const;
  /// The touches to come are of another unknown.
  void reset();
  /// Leaves a touch of this unknown out of the belief, or takes it in again, and calls on_touch
  /// with the belief of the others, as it was after the last touch. Does nothing where there is no
  /// such touch, or no other is left.
  void leave_out(std::size_t touch, bool out);
  /// Calls this on the thread of on_touch, before the touch that comes next, also after the
  /// stream's end.
  void between_touches(std::function<void()> work);
  /// Stops reading and uses the touches that were read, the touch under way included.
  /// @throws Error if the sensor or the device has failed; what `on_touch` has thrown
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  /// A touch of the unknown, which people may take for a bad one.
  struct UsedTouch {
    DetectedTouch touch;
    std::uint64_t frames_lost = 0;
    std::vector<Reading> readings = {};
    bool left_out = false;
  };

  void read();
  std::optional<TouchDetector> tare();
  void count(const Frame& frame);
  /// What is_readable() refuses is lost, too.
  SensorCounters counters() const;
  void take(TouchDetector& detector, const Frame& frame);
  void hand_on(const std::optional<DetectedTouch>& touch);
  bool wait_for_room();
  void believe();
  void use(UsedTouch touch, Clock::time_point taken);
  /// Takes more touches of the unknown into the belief.
  RecognitionStep step_after(std::span<const Touch> touches);
  /// Takes the result after the last touch to whoever waits for it, and plans the next.
  void tell(RecognitionStep step);
  /// The best next touch of a grid about the belief, with the array of this touch.
  PlannedTouch plan(const DetectedTouch& touch) const;
  Touch view_of(const DetectedTouch& touch) const;
  /// Runs a thread's work and keeps what it throws.
  void guard(void (LiveRecognition::*work)());

  Sensor& sensor_;  ///< of the reading thread alone
  const SensorDescription description_;
  std::vector<glm::dvec2> elements_mm_;
  Recogniser& recogniser_;
  const RecognitionTask& task_;
  LiveOptions options_;
  std::function<void(const LiveTouch&)> on_touch_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;  ///< touches for the belief, and work between them
  LiveState state_;
  std::vector<double> latencies_ms_;
  bool stop_ = false;      ///< read no more
  bool all_read_ = false;  ///< no job will be added by the stream
  bool ended_ = false;     ///< nothing is left to do
  std::exception_ptr failure_;

  // Only the reading thread uses these.
  Clock::time_point taken_;
  StreamTime time_;
  std::uint64_t unreadable_ = 0;
  std::optional<double> last_frame_s_;
  std::optional<double> last_contact_s_;  ///< of time_
  bool was_touching_ = false;

  std::vector<UsedTouch> used_;  ///< of the unknown; of the believing thread alone

  std::thread reader_;
  std::thread believer_;
};

}  // namespace palpate
