// A recording that was cut off is closed for programs other than Palpate.

#include <gtest/gtest.h>

#include "file_parts.hpp"
#include "io/recording_state.hpp"
#include "numbered_frames.hpp"
#include "palpate/files.hpp"
#include "palpate/frame_recorder.hpp"
#include "support/child_process.hpp"
#include "support/limits.hpp"

namespace palpate::recording_closing_test {

constexpr std::size_t elements = 36;

class RecordingClosing : public OneFile {
 protected:
  RecordingClosing() : OneFile("frames.h5") {}

  // A recording of so many frames whose recorder ended without closing it.
  void cut_off(std::size_t frames) const {
    const int status = status_of([&] {
      FrameRecorder recorder(path_, sensor_of(elements));
      for (std::size_t i = 0; i < frames; ++i) {
        recorder.add(frame_of(i, elements));
        if (i % 100 == 0) {
          recorder.flush();
        }
      }
      recorder.flush();
      ::_exit(0);  // before the recorder closes it
    });
    ASSERT_EQ(status, 0);
  }

  // As other programs open a file: for reading or for writing, without SWMR.
  bool opens(unsigned flags = H5F_ACC_RDONLY) const {
    const Hdf5Session session;
    return Hdf5Handle(H5Fopen(path_.c_str(), flags, H5P_DEFAULT), H5Fclose).valid();
  }

  void expect_frames(std::size_t frames) const {
    const Recording recording = read_recording(path_);
    ASSERT_EQ(recording.size(), frames);
    expect_prefix(recording, elements);
  }
};

TEST_F(RecordingClosing, OpensTheFileForOthersAndKeepsEveryRow) {
  for (const std::size_t frames : {1u, 257u, 3001u}) {
    cut_off(frames);
    EXPECT_FALSE(opens());
    EXPECT_FALSE(read_recording(path_).closed);
    EXPECT_EQ(recorder_of(path_), Recorder::gone);
    EXPECT_TRUE(close_recording(path_));
    EXPECT_TRUE(opens());
    EXPECT_TRUE(opens(H5F_ACC_RDWR));
    EXPECT_TRUE(read_recording(path_).closed);
    expect_frames(frames);
    EXPECT_FALSE(close_recording(path_)) << "it is closed already";
  }
}

// The recorder was killed between two datasets, or before it wrote the last times.
TEST_F(RecordingClosing, KeepsWholeRowsOnly) {
  cut_off(1000);
  ASSERT_TRUE(close_recording(path_));
  edit(path_, [](hid_t file) {
    for (const auto& [name, extents] : {std::pair{"pressure", Extents{1010, elements}},
                                        {"sensor_pose", {1007, 3}},
                                        {"lost_before", {1007}},
                                        {"time", {1003}}}) {
      EXPECT_GE(H5Dset_extent(dataset_of(file, name).get(), extents.data()), 0) << name;
    }
  });
  leave_open(path_);
  ASSERT_FALSE(opens());
  EXPECT_TRUE(close_recording(path_));
  expect_frames(1000);
  edit(path_, [](hid_t file) {
    for (const char* name : {"pressure", "sensor_pose", "lost_before", "time"}) {
      const Hdf5Handle space(H5Dget_space(dataset_of(file, name).get()), H5Sclose);
      hsize_t extents[2] = {};
      H5Sget_simple_extent_dims(space.get(), extents, nullptr);
      EXPECT_EQ(extents[0], 1000u) << name;
    }
  });
}

// The recorder was killed within the one write of the baseline.
TEST_F(RecordingClosing, ABaselineThatIsHalfWrittenWasNotTaken) {
  SensorDescription with_baseline = sensor_of(elements);
  with_baseline.valid.assign(elements, 1);
  with_baseline.valid[3] = 0;
  with_baseline.baseline.assign(elements, 1.0);
  FrameRecorder recorder(path_, with_baseline);
  recorder.add(frame_of(0, elements));
  recorder.close();
  const auto unwrite = [&](std::ptrdiff_t first, std::ptrdiff_t count) {
    std::vector<double> baseline(elements, 1.0);
    std::fill_n(baseline.begin() + first, count, nan);
    edit(path_, [&](hid_t file) {
      put_values(dataset_of(file, "baseline"), H5T_NATIVE_DOUBLE, baseline.data());
    });
  };
  unwrite(20, 16);
  EXPECT_TRUE(read_recording(path_).baseline.empty());
  leave_open(path_);
  EXPECT_TRUE(read_recording(path_).baseline.empty());
  EXPECT_TRUE(close_recording(path_));
  EXPECT_TRUE(read_recording(path_).baseline.empty());
  expect_frames(1);
  unwrite(3, 1);
  EXPECT_EQ(read_recording(path_).baseline.size(), elements) << "element 3 is dead";
}

TEST_F(RecordingClosing, WhileItIsRecordedIsRefusedAndCostsNothing) {
  FrameRecorder recorder(path_, sensor_of(elements));
  const auto record_to = [&](std::size_t frames) {
    for (std::size_t i = recorder.frames(); i < frames; ++i) {
      recorder.add(frame_of(i, elements));
    }
  };
  record_to(500);
  recorder.flush();
  EXPECT_EQ(recorder_of(path_), Recorder::there);
  // This process finds the file open in its own HDF5 library.
  EXPECT_FALSE(read_recording(path_).closed);
  const auto close = [&] { close_recording(path_); };
  expect_named(refusal(close), {"recording", "wait"});
  EXPECT_EQ(status_of([&] { refusal(close); }), 0) << "another process is refused as well";
  record_to(1000);
  recorder.close();
  EXPECT_TRUE(read_recording(path_).closed);
  expect_frames(1000);
  EXPECT_EQ(recorder_of(path_), Recorder::gone);
}

TEST_F(RecordingClosing, WhatIsNoRecordingIsLeftAlone) {
  const auto expect_left_alone = [&](const char* named) {
    const std::string before = bytes_of(path_);
    expect_named(input_error([&] { close_recording(path_); }), {named});
    EXPECT_TRUE(bytes_of(path_) == before);
  };
  map_parts().save(path_);
  expect_left_alone("a map");
  cut_off(300);
  std::filesystem::resize_file(path_, 2000);  // damaged besides
  expect_left_alone("");
}

TEST_F(RecordingClosing, NeedsTheRightToWrite) {
  cut_off(300);
  using std::filesystem::perms;
  std::filesystem::permissions(path_, perms::owner_read | perms::others_read);
  std::filesystem::permissions(folder_.path(), perms::owner_all | perms::others_exec);
  EXPECT_EQ(status_of([&] {
              constexpr uid_t nobody = 65534;
              EXPECT_EQ(::setuid(::getuid() == 0 ? nobody : ::getuid()), 0);  // root may all
              expect_named(refusal([&] { close_recording(path_); }), {"permissions"});
            }),
            0);
  expect_frames(300);
}

}  // namespace palpate::recording_closing_test
