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

#include "palpate/pose.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Whether a robot can be there: x and y within +-1e9 mm, theta within +-1e9 rad, no NaN.
bool is_robot_pose(const Pose& T_robot_sensor);

/// Where the sensor was, by time: poses T_robot_sensor between which it is interpolated, the angle
/// the short way round.
///
/// A pose that is not later than the last, or later by more than 10 of the largest gaps, is set
/// aside at first: it may be stamped wrongly. It is dropped as soon as a pose follows the last one
/// after all. Three such poses in a row, each later than the one before, are another thing: the
/// robot has paused, or its clock was set. They join the track, and where the clock went back, what
/// the track knew of the times from there on is forgotten.
class PoseTrack {
 public:
  /// @param largest_gap_s between two poses further apart in time nothing is known
  explicit PoseTrack(double largest_gap_s = 0.1) : largest_gap_s_(largest_gap_s) {}

  /// Adds a pose; false where it is not of the track, or not yet: set aside or dropped.
  bool add(double time_s, const Pose& T_robot_sensor);
  /// No more poses will come: those that are set aside join the track where they are later than its
  /// last, and are dropped where they are not.
  void end();
  /// The pose at this time; none before the first, after the last and in a larger gap.
  std::optional<Pose> at(double time_s) const;
  /// Time of the last pose.
  std::optional<double> last_s() const;
  /// Forgets what is not needed to know the poses from this time on.
  void forget_before(double time_s);
  std::size_t size() const { return poses_.size(); }

  std::size_t set_aside() const { return aside_.size(); }  ///< poses that are set aside now
  std::uint64_t dropped() const { return dropped_; }       ///< poses that add() and end() dropped
  std::uint64_t set_back() const { return set_back_; }     ///< times the poses' clock went back

 private:
  using TimedPose = std::pair<double, Pose>;  ///< time and T_robot_sensor

  void join();
  void drop_aside();

  double largest_gap_s_;
  std::deque<TimedPose> poses_;
  std::vector<TimedPose> aside_;
  std::uint64_t dropped_ = 0;
  std::uint64_t set_back_ = 0;
};

/// Another sensor with the poses of a robot: lines of JSON such as
///   {"time": 1700000000.25, "x_mm": 12.5, "y_mm": -3.0, "theta_rad": 0.79}
/// in the order of time (seconds since the Unix epoch, as the frames' host times), from a file, a
/// FIFO or standard input. Other keys and empty lines are passed over.
///
/// A file is read when the sensor is opened, and a line of it that is no pose, or out of the order
/// of time, is an error. A FIFO or standard input is read as it comes, without waiting: such a line
/// is passed over and counted, and the track goes on as PoseTrack says. A frame is held back until
/// the pose after it has come, at most for 0.2 s. Poses that no frame asks for yet are left to the
/// FIFO once 65,536 wait; while the board is gone, all but those of the last second are forgotten.
class PosedSensor : public Sensor {
 public:
  static constexpr double usual_gap_s = 0.1;

  /// What came from the robot, and since start() its frames.
  struct Poses {
    std::uint64_t read = 0;
    std::uint64_t refused = 0;   ///< lines that are no pose, or out of the order of time
    std::string first_refused;   ///< what was wrong with the first of them, naming the line
    std::uint64_t set_back = 0;  ///< times the poses' clock went back; their lines are not refused
    std::uint64_t frames = 0;    ///< frames with a pose
    std::uint64_t without = 0;   ///< frames without one
  };

  /// Is told what is wrong with a line, naming it, when it is read: once for each kind of fault.
  using Complaint = std::function<void(const std::string&)>;

  /// @param poses path of a file or FIFO, or "-": standard input
  /// @param complain called from within next(); may be empty
  /// @throws Error (Fault::input) where it cannot be read, or a line of a file is no pose
  PosedSensor(std::unique_ptr<Sensor> sensor, const std::string& poses,
              double largest_gap_s = usual_gap_s, Complaint complain = {});
  ~PosedSensor() override;

  const SensorDescription& description() const override;
  void start() override;
  std::optional<Frame> next(std::chrono::milliseconds timeout) override;
  bool ended() const override;
  bool gone() const override;
  void stop() override;
  SensorCounters counters() const override;

  Poses poses() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
