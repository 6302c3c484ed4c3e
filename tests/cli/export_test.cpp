#include <cstdlib>

#include <fmt/format.h>

#include "palpate/frame_recorder.hpp"
#include "support/limits.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::export_test {

class ExportCommand : public ProgramTest {
 protected:
  /// Expects the same file after export and the import that the export printed.
  void expect_back(const Recording& written, const Recording& expected) const {
    write_recording(folder_ / "a.h5", written);
    const std::string said = done("export a.h5 -o tables");
    const std::string::size_type at = said.find("; back: palpate ");
    ASSERT_NE(at, said.npos) << said;
    // As it stands, in a shell.
    const std::string back =
        fmt::format("cd '{}' && '{}' {}", folder_.path().string(), program(), said.substr(at + 16));
    ASSERT_EQ(std::system(back.c_str()), 0) << back;
    write_recording(folder_ / "expected.h5", expected);
    EXPECT_TRUE(bytes_of(folder_ / "FILE.h5") == bytes_of(folder_ / "expected.h5"));
  }
  void expect_back(const Recording& written) const { expect_back(written, written); }
};

TEST_F(ExportCommand, TouchesComeBackExactly) {
  Recording touches = sample_unknown("A", {{1.0 / 3.0, -2.0}, 0.1}, 5);
  touches.truth->object = "it's, an A";
  touches.pressure[3] = 1e-300;
  touches.pressure[4] = -1.0 / 3.0;
  expect_back(touches);
  touches.object = "-a mug";
  touches.truth.reset();
  touches.pressure_unit = "raw";
  touches.valid.assign(touches.elements(), 1);
  touches.valid[7] = 0;
  expect_back(touches);
  // Readings that are dead alone.
  touches.valid.assign(touches.pressure.size(), 1);
  touches.valid[40] = 0;
  Recording dead = touches;
  dead.pressure[40] = nan;
  expect_back(touches, dead);
}

TEST_F(ExportCommand, FramesComeBackExactly) {
  Recording stream = sample_training("A", 4);
  stream.rows = "frames";
  stream.time_s = {1.7e9, 1.7e9 + 0.1, 1.7e9 + 0.1, 1.7e9 + 1.0 / 3.0};
  stream.T_robot_sensor[1] = unknown_pose;
  stream.pressure[2] = nan;
  stream.baseline.assign(stream.elements(), 1.0 / 7.0);
  stream.device_time_s = {0.1, nan, 0.2, 0.3};
  stream.lost_before = {0, 3, 0, 1};
  expect_back(stream);
  stream.T_robot_sensor.assign(4, unknown_pose);
  expect_back(stream);
  EXPECT_EQ(bytes_of(folder_ / "tables" / "poses.csv"), "x_mm,y_mm,theta_rad\n,,\n,,\n,,\n,,\n")
      << "the older poses must not stay";
}

TEST_F(ExportCommand, RefusesWhatIsNoTable) {
  write_map(folder_ / "A.map.h5", sample_map("A"));
  expect_refused("export A.map.h5 -o tables",
                 {"A.map.h5: format 'palpate.map' has no tables; give a recording"});
  std::filesystem::create_directory(folder_ / "in");
  write_recording(folder_ / "in" / "poses.csv", sample_training("A", 2));
  expect_refused("export in/poses.csv -o in", {"would overwrite in/poses.csv"});
  Recording hand = sample_training("A", 2);
  hand.elements_mm.resize(hand.pressure.size());
  write_recording(folder_ / "hand.h5", hand);
  const Outcome outcome = palpate("export hand.h5 -o tables");
  EXPECT_EQ(outcome.status, 2);
  expect_named(outcome.err, {"hand.h5: dataset 'elements' changes from row to row"});
}

TEST_F(ExportCommand, AFullDiskLeavesOlderTables) {
  write_recording(folder_ / "a.h5", sample_training("A", 12));
  done("export a.h5 -o tables");
  write_recording(folder_ / "a.h5", sample_training("I", 12));
  const auto before = content_of(folder_.path());
  EXPECT_EQ(palpate("export a.h5 -o tables", {.largest_file_bytes = 2048}).status, 1);
  EXPECT_TRUE(content_of(folder_.path()) == before) << "the folder has changed";
}

}  // namespace palpate::export_test
