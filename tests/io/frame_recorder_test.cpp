#include "palpate/frame_recorder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "numbered_frames.hpp"
#include "palpate/files.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::frame_recorder_test {

class FrameRecorderFile : public testing::Test {
 protected:
  ScratchFolder folder_;
  std::filesystem::path path_ = folder_ / "stream.h5";
};

TEST_F(FrameRecorderFile, ComesBackAsItWasAdded) {
  SensorDescription sensor = sensor_of(3);
  sensor.pressure_unit = "raw";
  sensor.valid = {1, 0, 1};
  sensor.baseline = {10.0, 0.0, 12.5};
  sensor.object = "A";
  sensor.truth = {.object = "E", .T_object_robot = {{1.0, 2.0}, 3.0}};
  constexpr std::size_t n = 1000;
  FrameRecorder recorder(path_, sensor);
  for (std::size_t i = 0; i < n; ++i) {
    Frame frame = frame_of(i, 3);
    frame.device_time_s = static_cast<double>(i);
    frame.lost_before = i % 5 == 0 ? 2 : 0;
    if (i % 2 == 0) {
      frame.T_robot_sensor = Pose{{static_cast<double>(i), 0.25}, -9.0};
    }
    recorder.add(frame);
  }
  EXPECT_EQ(recorder.frames(), n);
  EXPECT_EQ(recorder.lost(), 2 * n / 5);
  recorder.close();

  const Recording read = read_recording(path_);
  EXPECT_TRUE(read.closed);
  ASSERT_EQ(read.size(), n);
  expect_prefix(read, 3);
  EXPECT_EQ(read.sensor, "Test");
  EXPECT_EQ(read.serial, "7");
  EXPECT_EQ(read.pressure_unit, "raw");
  EXPECT_EQ(read.object, "A");
  EXPECT_EQ(read.elements_mm, sensor.elements_mm);
  EXPECT_EQ(read.valid, sensor.valid);
  EXPECT_EQ(read.baseline, sensor.baseline);
  ASSERT_TRUE(read.truth);
  EXPECT_EQ(read.truth->object, "E");
  EXPECT_EQ(read.truth->T_object_robot.theta_rad, 3.0);
  EXPECT_EQ(read.device_time_s[17], 17.0);
  EXPECT_EQ(read.lost_before[15], 2u);
  EXPECT_EQ(read.lost_before[16], 0u);
  EXPECT_EQ(read.T_robot_sensor[16].translation_mm, glm::dvec2(16.0, 0.25));
  EXPECT_EQ(read.T_robot_sensor[16].theta_rad, -9.0);
  EXPECT_TRUE(std::isnan(read.T_robot_sensor[17].theta_rad));
}

TEST_F(FrameRecorderFile, AppearsOnlyWithFrames) {
  put_bytes(path_, "an older file");
  {
    FrameRecorder recorder(path_, sensor_of(2));
    recorder.flush();
    recorder.close();
  }
  EXPECT_EQ(bytes_of(path_), "an older file");
  FrameRecorder recorder(path_, sensor_of(2));
  recorder.add(frame_of(0, 2));
  recorder.close();
  EXPECT_EQ(read_recording(path_).size(), 1u);
}

TEST_F(FrameRecorderFile, FrameWithAReadingThatIsNoNumberCountsAsLost) {
  SensorDescription sensor = sensor_of(2);
  sensor.valid = {1, 0};
  FrameRecorder recorder(path_, sensor);
  recorder.add(frame_of(0, 2));
  for (const double wrong : {std::nan(""), 1e300}) {  // no number, and none in float32
    Frame frame = frame_of(1, 2);
    frame.values[0] = wrong;
    recorder.add(frame);
  }
  Frame dead = frame_of(2, 2);
  dead.values[1] = std::nan("");
  recorder.add(dead);
  recorder.close();
  const Recording read = read_recording(path_);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(recorder.lost(), 2u);
  EXPECT_EQ(read.lost_before, (std::vector<std::uint64_t>{0, 2}));
}

TEST_F(FrameRecorderFile, UnknownReadingsComeBackAsNaNs) {
  SensorDescription sensor = sensor_of(3);
  sensor.valid = {1, 1, 0};
  FrameRecorder recorder(path_, sensor);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double none : {std::nan(""), inf, -inf, 1e300, -3.5e38}) {
    Frame frame = frame_of(recorder.frames(), 3);
    frame.values[1] = none;
    frame.values[2] = none;  // a dead element's does not count
    recorder.add(frame);
  }
  recorder.add(frame_of(5, 3));
  EXPECT_EQ(recorder.frames(), 6u);
  EXPECT_EQ(recorder.lost(), 0u);
  EXPECT_EQ(recorder.unknown_readings(), 5u);
  recorder.close();
  const Recording read = read_recording(path_);
  ASSERT_EQ(read.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(read.pressure[3 * i], reading(i, 0));
    EXPECT_EQ(std::isnan(read.pressure[3 * i + 1]), i < 5) << i;
  }
  // What was read can be written and read again; touches must be whole.
  write_recording(folder_ / "again.h5", read);
  EXPECT_TRUE(std::isnan(read_recording(folder_ / "again.h5").pressure[1]));
  Recording touches = read;
  touches.rows = "touches";
  touches.T_robot_sensor.assign(6, {});
  expect_named(input_error([&] { write_recording(folder_ / "touches.h5", touches); }),
               {"'pressure'[0, 1]", "nan"});
}

TEST_F(FrameRecorderFile, RefusesWhatDoesNotFit) {
  FrameRecorder recorder(path_, sensor_of(2));
  expect_named(input_error([&] { recorder.add(frame_of(0, 3)); }), {"3 values", "2 elements"});
  SensorDescription sensor = sensor_of(2);
  sensor.baseline = {1.0};
  expect_named(input_error([&] { FrameRecorder(path_, sensor); }), {"stream.h5", "1 baseline"});
  expect_named(input_error([&] { FrameRecorder(path_, {}); }), {"0 elements"});
}

}  // namespace palpate::frame_recorder_test
