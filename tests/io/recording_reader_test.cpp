#include "io/recording_reader.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>

#include "io/hdf5_process.hpp"
#include "palpate/files.hpp"
#include "scratch_folder.hpp"

namespace palpate::recording_reader_test {

std::atomic<int> forks{0};
const int counted = ::pthread_atfork([] { ++forks; }, nullptr, nullptr);

class RecordingReading : public testing::Test {
 protected:
  RecordingReading() { read_hdf5_in_children(true); }

  static Recording recording(double pressure) {
    Recording recording;
    recording.object = "ring";
    recording.pressure_unit = "raw";
    recording.T_robot_sensor = {{{1.0, 2.0}, 0.5}, {{3.0, 4.0}, -0.5}};
    recording.pressure = {pressure, 1.0, 2.0, 3.0, 4.0, 5.0};
    recording.elements_mm = {{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.5}};
    recording.valid = {1, 0, 1};
    recording.truth = Truth{"ring", {{7.0, 8.0}, 0.25}};
    return recording;
  }

  ScratchFolder folder_;
};

TEST_F(RecordingReading, ReadsWhatReadRecordingDoesInOneChild) {
  ASSERT_EQ(counted, 0);
  for (int i = 0; i < 3; ++i) {
    write_recording(folder_ / std::to_string(i), recording(10.0 * i));
  }
  const int before = forks;
  RecordingReader reader;
  for (int i = 0; i < 3; ++i) {
    const Recording read = reader.read(folder_ / std::to_string(i));
    EXPECT_EQ(forks, before + 1);
    const Recording alone = recording(10.0 * i);
    EXPECT_EQ(read.path, (folder_ / std::to_string(i)).string());
    EXPECT_EQ(read.object, alone.object);
    EXPECT_EQ(read.pressure_unit, alone.pressure_unit);
    EXPECT_EQ(read.rows, "touches");
    EXPECT_EQ(read.pressure, alone.pressure);
    EXPECT_EQ(read.elements_mm, alone.elements_mm);
    EXPECT_EQ(read.valid, alone.valid);
    ASSERT_EQ(read.size(), 2u);
    EXPECT_EQ(read.T_robot_sensor[1].translation_mm, alone.T_robot_sensor[1].translation_mm);
    EXPECT_EQ(read.T_robot_sensor[1].theta_rad, alone.T_robot_sensor[1].theta_rad);
    ASSERT_TRUE(read.truth);
    EXPECT_EQ(read.truth->object, "ring");
    EXPECT_EQ(read.truth->T_object_robot.translation_mm, glm::dvec2(7.0, 8.0));
  }
}

TEST_F(RecordingReading, ABrokenFileIsRefusedInTheSameWordsAndTheNextIsRead) {
  write_recording(folder_ / "sound", recording(1.0));
  const std::string bytes = bytes_of(folder_ / "sound");
  put_bytes(folder_ / "cut", bytes.substr(0, bytes.size() / 2));
  put_bytes(folder_ / "text", "no HDF5");
  RecordingReader reader;
  for (const char* const name : {"cut", "text", "missing"}) {
    const std::string words = input_error([&] { read_recording(folder_ / name); });
    const int before = forks;
    EXPECT_EQ(input_error([&] { reader.read(folder_ / name); }), words);
    EXPECT_EQ(reader.read(folder_ / "sound").size(), 2u) << "after " << name;
    EXPECT_EQ(forks, before) << "at or after " << name;
  }
}

TEST_F(RecordingReading, InAnotherProgramsProcessNothingForks) {
  write_recording(folder_ / "sound", recording(1.0));
  read_hdf5_in_children(false);
  const int before = forks;
  EXPECT_EQ(RecordingReader().read(folder_ / "sound").size(), 2u);
  EXPECT_EQ(forks, before);
  read_hdf5_in_children(true);
}

}  // namespace palpate::recording_reader_test
