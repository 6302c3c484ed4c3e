#include "palpate/frame_recorder.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "file_parts.hpp"
#include "numbered_frames.hpp"
#include "palpate/files.hpp"
#include "support/limits.hpp"

namespace palpate::frame_recorder_test {

class FrameRecorderFile : public OneFile {
 protected:
  FrameRecorderFile() : OneFile("stream.h5") {}
};

// Over several saves; RoundTrip.StreamOfFrames has what is read of the sensor.
TEST_F(FrameRecorderFile, ComesBackAsItWasAdded) {
  constexpr std::size_t n = 1000;
  FrameRecorder recorder(path_, sensor_of(3));
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
  for (std::size_t i = 0; i < n; ++i) {
    ASSERT_EQ(read.device_time_s[i], static_cast<double>(i));
    ASSERT_EQ(read.lost_before[i], i % 5 == 0 ? 2u : 0u);
    const Pose& pose = read.T_robot_sensor[i];
    if (i % 2 == 0) {
      ASSERT_EQ(pose.translation_mm, glm::dvec2(static_cast<double>(i), 0.25));
      ASSERT_EQ(pose.theta_rad, -9.0);
    } else {
      ASSERT_TRUE(std::isnan(pose.theta_rad));
    }
  }
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

TEST_F(FrameRecorderFile, WithoutAKnownReadingIsLostAndWithOneHasTheOthersUnknown) {
  SensorDescription sensor = sensor_of(3);
  sensor.valid = {1, 1, 0};  // what a dead element reads does not count
  FrameRecorder recorder(path_, sensor);
  const auto add = [&](std::vector<double> values) {
    Frame frame = frame_of(recorder.frames(), 3);
    frame.values = std::move(values);
    recorder.add(frame);
  };
  add({1.0, 2.0, nan});
  for (const double none : {nan, infinity, -infinity, 1e300, -3.5e38}) {  // the last in float32
    add({none, none, 4.0});
    add({1.0, none, none});
  }
  EXPECT_EQ(recorder.frames(), 6u);
  EXPECT_EQ(recorder.lost(), 5u);
  EXPECT_EQ(recorder.unknown_readings(), 5u);
  recorder.close();
  const Recording read = read_recording(path_);
  ASSERT_EQ(read.size(), 6u);
  EXPECT_EQ(read.lost_before, (std::vector<std::uint64_t>{0, 1, 1, 1, 1, 1}));
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(read.pressure[3 * i], 1.0);
    EXPECT_EQ(std::isnan(read.pressure[3 * i + 1]), i > 0) << i;
  }
}

TEST_F(FrameRecorderFile, RefusesWhatDoesNotFit) {
  FrameRecorder recorder(path_, sensor_of(2));
  expect_named(input_error([&] { recorder.add(frame_of(0, 3)); }), {"3 values", "2 elements"});
  SensorDescription sensor = sensor_of(2);
  sensor.baseline = {1.0};
  expect_named(refusal([&] { FrameRecorder(path_, sensor); }), {"1 baseline"});
  expect_named(refusal([&] { FrameRecorder(path_, {}); }), {"0 elements"});
}

}  // namespace palpate::frame_recorder_test
