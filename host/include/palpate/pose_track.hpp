#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/pose.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// True for a pose that a robot can have: |x|, |y| <= 1e9 mm and |theta| <= 1e9 rad, no NaN.
PALPATE_API bool is_robot_pose(const Pose& T_robot_sensor);

/// The sensor's poses T_robot_sensor over time, interpolated linearly, angles the short way round.
///
/// A pose whose time is not later than the last pose's, or later by more than 10 `largest_gap_s`,
/// may be stamped wrongly and is set aside. The next pose in order drops it. Three poses set aside
/// in a row, each later than the one before, join the track instead: the robot paused, or its clock
/// was set. Where the clock went back, they replace the track's poses from their first time on.
class PALPATE_API PoseTrack {
 public:
  /// @param largest_gap_s poses further apart in time are not interpolated, in s
  explicit PoseTrack(double largest_gap_s = 0.1) : largest_gap_s_(largest_gap_s) {}

  /// Adds a pose. Returns false where it is set aside, or dropped: a time that is not finite, or a
  /// pose that is_robot_pose() refuses.
  bool add(double time_s, const Pose& T_robot_sensor);
  /// Ends the track: poses set aside join it where they are later than its last pose, and are
  /// dropped otherwise.
  void end();
  /// Returns the pose at this time; none before the first pose, after the last, or in a larger gap.
  std::optional<Pose> at(double time_s) const;
  /// Returns the time of the last pose; none where the track is empty.
  std::optional<double> last_s() const;
  /// Forgets the poses that at() needs for no time from `time_s` on.
  void forget_before(double time_s);
  std::size_t size() const { return poses_.size(); }  ///< number of poses held

  std::size_t set_aside() const { return aside_.size(); }  ///< poses that are set aside now
  std::uint64_t dropped() const { return dropped_; }       ///< poses that add() and end() dropped
  std::uint64_t set_back() const { return set_back_; }     ///< times the poses' clock went back

 private:
  using TimedPose = std::pair<double, Pose>;  ///< time and T_robot_sensor

  PALPATE_LOCAL void join();
  PALPATE_LOCAL void drop_aside();

  double largest_gap_s_;
  std::deque<TimedPose> poses_;
  std::vector<TimedPose> aside_;
  std::uint64_t dropped_ = 0;
  std::uint64_t set_back_ = 0;
};

/// Adds a robot's poses to the frames of another sensor. Poses are lines of JSON such as
///   {"time": 1700000000.25, "x_mm": 12.5, "y_mm": -3.0, "theta_rad": 0.79}
/// in the order of time (seconds since the Unix epoch, like the frames' host times), from a file, a
/// FIFO or standard input. Other keys and empty lines are ignored.
///
/// A file is read when the sensor is opened; a line that is no pose, or out of order, is an error.
/// A FIFO or standard input is read without blocking; such a line is skipped and counted, and
/// PoseTrack decides which poses count. A frame waits at most 0.2 s for the first pose after it. At
/// most 65,536 poses are read ahead of the frames; while the sensor is unplugged, only the poses of
/// the last second are kept.
class PALPATE_API PosedSensor : public Sensor {
 public:
  static constexpr double usual_gap_s = 0.1;  ///< default of PoseTrack's `largest_gap_s`

  /// Counts of poses since the sensor was opened, and of frames since start().
  struct Poses {
    std::uint64_t read = 0;      ///< poses that joined the track
    std::uint64_t refused = 0;   ///< lines that are no pose, or out of order
    std::string first_refused;   ///< names the first refused line and its fault
    std::uint64_t set_back = 0;  ///< times the poses' clock went back; no line is refused for it
    std::uint64_t frames = 0;    ///< frames with a pose
    std::uint64_t without = 0;   ///< frames without a pose
  };

  /// Called with the fault of a refused line, which it names: once for each kind of fault.
  using Warn = std::function<void(const std::string&)>;

  /// @param poses path of a file or FIFO, or "-": standard input
  /// @param warn called from within next(); may be empty
  /// @throws Error (Fault::input) where `poses` cannot be read, or a line of a file is no pose
  PosedSensor(std::unique_ptr<Sensor> sensor, const std::string& poses,
              double largest_gap_s = usual_gap_s, Warn warn = {});
  ~PosedSensor() override;

  const SensorDescription& description() const override;
  void start() override;
  std::optional<Frame> next(std::chrono::milliseconds timeout) override;
  bool ended() const override;
  bool gone() const override;
  void stop() override;
  SensorCounters counters() const override;

  Poses poses() const;  ///< counts so far

 private:
  struct PALPATE_LOCAL Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
