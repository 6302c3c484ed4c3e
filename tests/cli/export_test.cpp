#include <cmath>
#include <limits>

#include "palpate/frame_recorder.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::export_test {

class ExportCommand : public ProgramTest {
 protected:
  // The recording after export and the import that the export printed.
  Recording there_and_back(Recording recording) const {
    write_recording(folder_ / "a.h5", recording);
    const std::string said = done({"export", "a.h5", "-o", "tables"});
    const std::string::size_type at = said.find("; back: palpate ");
    EXPECT_NE(at, said.npos) << said;
    done(words_of(said.substr(at + 16)));
    return read_recording(folder_ / "FILE.h5");
  }

 private:
  // The words of a shell's command.
  static std::vector<std::string> words_of(const std::string& command) {
    std::vector<std::string> words(1);
    bool quoted = false;
    for (std::size_t i = 0; i < command.size(); ++i) {
      const char c = command[i];
      if (c == '\'') {
        quoted = !quoted;
      } else if (!quoted && (c == ' ' || c == '\n')) {
        words.emplace_back();
      } else {
        words.back() += !quoted && c == '\\' ? command[++i] : c;
      }
    }
    words.pop_back();
    return words;
  }
};

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void expect_same(const Recording& read, const Recording& written) {
  EXPECT_EQ(read.object, written.object);
  EXPECT_EQ(read.pressure_unit, written.pressure_unit);
  EXPECT_EQ(read.rows, written.rows);
  EXPECT_TRUE(std::ranges::equal(read.pressure, written.pressure, same));
  EXPECT_EQ(read.elements_mm, written.elements_mm);
  EXPECT_EQ(read.valid, written.valid);
  EXPECT_EQ(read.time_s, written.time_s);
  EXPECT_EQ(read.baseline, written.baseline);
  EXPECT_TRUE(std::ranges::equal(read.device_time_s, written.device_time_s, same));
  EXPECT_EQ(read.lost_before, written.lost_before);
  EXPECT_TRUE(std::ranges::equal(
      read.T_robot_sensor, written.T_robot_sensor, [](const Pose& a, const Pose& b) {
        return same(a.translation_mm.x, b.translation_mm.x) &&
               same(a.translation_mm.y, b.translation_mm.y) && same(a.theta_rad, b.theta_rad);
      }));
  ASSERT_EQ(read.truth.has_value(), written.truth.has_value());
  if (read.truth) {
    EXPECT_EQ(read.truth->object, written.truth->object);
    EXPECT_EQ(read.truth->T_object_robot.translation_mm,
              written.truth->T_object_robot.translation_mm);
    EXPECT_EQ(read.truth->T_object_robot.theta_rad, written.truth->T_object_robot.theta_rad);
  }
}

TEST_F(ExportCommand, TouchesComeBackExactly) {
  Recording touches = sample_unknown("A", {{1.0 / 3.0, -2.0}, 0.1}, 5);
  touches.truth->object = "it's, an A";
  touches.pressure[3] = 1e-300;
  touches.pressure[4] = -1.0 / 3.0;
  expect_same(there_and_back(touches), touches);
  touches.object = "-a mug";
  touches.truth.reset();
  touches.pressure_unit = "raw";
  touches.valid.assign(touches.elements(), 1);
  touches.valid[7] = 0;
  expect_same(there_and_back(touches), touches);
}

TEST_F(ExportCommand, DeadReadingsComeBackDead) {
  Recording touches = sample_unknown("A", {}, 3);
  touches.valid.assign(touches.pressure.size(), 1);
  touches.valid[40] = 0;
  const Recording back = there_and_back(touches);
  EXPECT_EQ(back.valid, touches.valid);
  touches.pressure[40] = std::numeric_limits<double>::quiet_NaN();
  expect_same(back, touches);
}

TEST_F(ExportCommand, FramesComeBackExactly) {
  Recording stream = sample_training("A", 4);
  stream.rows = "frames";
  stream.time_s = {1.7e9, 1.7e9 + 0.1, 1.7e9 + 0.1, 1.7e9 + 1.0 / 3.0};
  stream.T_robot_sensor[1] = unknown_pose;
  stream.pressure[2] = std::numeric_limits<double>::quiet_NaN();
  stream.baseline.assign(stream.elements(), 1.0 / 7.0);
  stream.device_time_s = {0.1, std::numeric_limits<double>::quiet_NaN(), 0.2, 0.3};
  stream.lost_before = {0, 3, 0, 1};
  expect_same(there_and_back(stream), stream);
  stream.T_robot_sensor.assign(4, unknown_pose);
  expect_same(there_and_back(stream), stream);
  EXPECT_EQ(bytes_of(folder_ / "tables" / "poses.csv"), "x_mm,y_mm,theta_rad\n,,\n,,\n,,\n,,\n")
      << "the older poses must not stay";
}

TEST_F(ExportCommand, RefusesWhatIsNoTable) {
  write_map(folder_ / "A.map.h5", sample_map("A"));
  expect_refused({"export", "A.map.h5", "-o", "tables"},
                 {"A.map.h5: format 'palpate.map' has no tables; give a recording"});
  Recording hand = sample_training("A", 2);
  hand.elements_mm.resize(hand.pressure.size());
  write_recording(folder_ / "hand.h5", hand);
  const Outcome outcome = palpate({"export", "hand.h5", "-o", "tables"});
  EXPECT_EQ(outcome.status, 2);
  expect_named(outcome.err, {"hand.h5: dataset 'elements' changes from row to row"});
  std::filesystem::create_directory(folder_ / "in");
  write_recording(folder_ / "in" / "poses.csv", sample_training("A", 2));
  expect_refused({"export", "in/poses.csv", "-o", "in"}, {"would overwrite in/poses.csv"});
}

TEST_F(ExportCommand, AFullDiskLeavesOlderTables) {
  write_recording(folder_ / "a.h5", sample_training("A", 12));
  done({"export", "a.h5", "-o", "tables"});
  write_recording(folder_ / "a.h5", sample_training("I", 12));
  const auto before = content_of(folder_.path());
  EXPECT_EQ(palpate({"export", "a.h5", "-o", "tables"}, {.largest_file_bytes = 2048}).status, 1);
  EXPECT_TRUE(content_of(folder_.path()) == before) << "the folder has changed";
}

}  // namespace palpate::export_test
