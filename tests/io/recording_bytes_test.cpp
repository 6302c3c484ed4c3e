#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "palpate/files.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::recording_bytes_test {

class RecordingBytes : public testing::Test {
 protected:
  RecordingBytes() {
    recording_.T_robot_sensor = {{{1.0, 2.0}, 3.0}, {{-4.0, 0.1}, -70.0}, {{5.0, 6.0}, 0.5}};
    recording_.pressure = {0.0, -1.5, 2.25, 1e6, 0.5, 3.0, 7.0, 0.1, 9.0};
    recording_.elements_mm = {{-1.0, 0.1}, {0.0, 0.2}, {1.0, 0.3}};
    write_recording(folder_ / "whole.h5", recording_);
  }

  void expect_whole(const char* file) const {
    EXPECT_EQ(bytes_of(folder_ / file), bytes_of(folder_ / "whole.h5"));
  }

  ScratchFolder folder_;
  Recording recording_;
};

// HDF5 loads a file of the name that it is given for the one in memory, and frees it again.
TEST_F(RecordingBytes, AreTheSameBesideAFileOfTheNameInMemory) {
  const std::filesystem::path here = std::filesystem::current_path();
  put_bytes(folder_ / "palpate", std::string(4 << 20, '?'));
  std::filesystem::current_path(folder_.path());
  write_recording(folder_ / "beside.h5", recording_);
  std::filesystem::current_path(here);
  expect_whole("beside.h5");
}

}  // namespace palpate::recording_bytes_test
