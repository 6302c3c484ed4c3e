#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "palpate/pose.hpp"
#include "palpate/sensor.hpp"

namespace palpate {

/// Where the sensor was, by time: poses T_robot_sensor between which it is interpolated, the angle
/// the short way round.
class PoseTrack {
 public:
  /// @param largest_gap_s between two poses further apart in time nothing is known
  explicit PoseTrack(double largest_gap_s = 0.1) : largest_gap_s_(largest_gap_s) {}

  /// Adds a pose; false, and nothing added, unless it is later than all before.
  bool add(double time_s, const Pose& T_robot_sensor);
  /// The pose at this time; none before the first, after the last and in a larger gap.
  std::optional<Pose> at(double time_s) const;
  /// Time of the last pose.
  std::optional<double> last_s() const;
  /// Forgets what is not needed to know the poses from this time on.
  void forget_before(double time_s);
  std::size_t size() const { return poses_.size(); }

 private:
  double largest_gap_s_;
  std::deque<std::pair<double, Pose>> poses_;  ///< time and T_robot_sensor
};

/// Another sensor with the poses of a robot: lines of JSON such as
///   {"time": 1700000000.25, "x_mm": 12.5, "y_mm": -3.0, "theta_rad": 0.79}
/// in the order of time (seconds since the Unix epoch, as the frames' host times), from a file, a
/// FIFO or standard input. Other keys and empty lines are passed over.
///
/// A file is read when the sensor is opened, and a line of it that is no pose is an error. A FIFO
/// or standard input is read as it comes, without waiting: such a line is passed over and counted.
/// A frame is held back until the pose after it has come, at most for 0.2 s.
class PosedSensor : public Sensor {
 public:
  /// What came from the robot.
  struct Poses {
    std::uint64_t read = 0;
    std::uint64_t refused = 0;  ///< lines that are no pose, or one that is not later than another
    std::string first_refused;  ///< what was wrong with the first of them, naming the line
    std::uint64_t frames = 0;   ///< frames with a pose
    std::uint64_t without = 0;  ///< frames without one
  };

  /// @param poses path of a file or FIFO, or "-": standard input
  /// @throws Error (Fault::input) where it cannot be read, or a line of a file is no pose
  PosedSensor(std::unique_ptr<Sensor> sensor, const std::string& poses, double largest_gap_s = 0.1);
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
