// What `palpate info` says of files, and the tables that `palpate export` makes of them.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include <fmt/format.h>

#include "palpate/learned_sensor.hpp"
#include "support/limits.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::info_test {

class InfoCommand : public ProgramTest {
 protected:
  void expect_info(const char* file, std::initializer_list<const char*> parts) const {
    expect_named(done(std::string("info ") + file), parts);
  }
  void expect_info(const Recording& recording, std::initializer_list<const char*> parts) const {
    write_recording(folder_ / "r.h5", recording);
    expect_info("r.h5", parts);
  }
};

TEST_F(InfoCommand, Recording) {
  expect_info(sample_unknown("A", {{2.0, -3.0}, 1.0}, 6),
              {"r.h5: recording of an unknown object", "touches           6",
               "elements          36", "kPa", "A at x 1.444 mm, y 3.304 mm"});
  Recording recording = sample_training("A", 2);
  recording.T_robot_sensor = {{{-3.5, 2.0}, 0.5}, {{4.0, 8.25}, -1.0}};
  recording.pressure.assign(72, 1.0);
  std::fill(recording.pressure.begin(), recording.pressure.begin() + 10, 16.0);
  expect_info(recording,
              {"recording of A", "9.8 x 9.5 mm: x -4.9 to 4.9, y -4.75 to 4.75 mm",
               "pitch             1.9 mm", "1 to 16 kPa, median 1, 99th percentile 16",
               "in contact        1 touches, more than 2 kPa above 0",
               "x -3.5 to 4 mm, y 2 to 8.25 mm", "theta -1 to 0.5 rad, -57.3 to 28.6 deg"});
  recording.valid.assign(36, 1);
  recording.valid[3] = recording.valid[4] = 0;
  recording.pressure[3] = 4000.0;
  recording.pressure[4] = std::nan("");
  expect_info(recording, {"1 to 16 kPa", "dead readings     2 of 36"});
  recording.rows = "frames";
  recording.pressure_unit = "raw";
  recording.time_s = {1.7e9, 1.7e9 + 2.5};
  recording.elements_mm.resize(72);
  expect_info(recording, {"frames            2", "raw", "positions change per touch", "2.500 s",
                          "not known: raw pressure has no default threshold"});
}

TEST_F(InfoCommand, SuspicionsComeLast) {
  Recording recording = sample_training("A", 9);
  for (Pose& pose : recording.T_robot_sensor) {
    pose.translation_mm *= 1e-3;
    pose.theta_rad *= 180.0 / std::numbers::pi;
  }
  write_recording(folder_ / "r.h5", recording);
  const std::string said = done("info r.h5");
  const std::string findings = said.substr(std::min(said.find("Suspicious:\n"), said.size()));
  expect_named(findings, {"are these metres?\n", "are these degrees?\n"});
  EXPECT_EQ(std::count(findings.begin(), findings.end(), '\n'), 3) << findings;
}

// Streams have offsets, phases of rest, and ramps; without noise, most frames are equal.
TEST_F(InfoCommand, SimulatedStreamsAreNotSuspicious) {
  for (const std::string sensor : {"touches=1,noise=0", "touches=12,noise=0.7"}) {
    done("record -o frames.h5 --sensor simulate:A,object=random,speed=max," + sensor);
    done("touches frames.h5 -o touches.h5");
    for (const char* file : {"info frames.h5", "info touches.h5"}) {
      EXPECT_EQ(done(file).find("Suspicious"), std::string::npos) << sensor;
    }
  }
}

TEST_F(InfoCommand, ClosesRecordingsOnly) {
  write_recording(folder_ / "u.h5", sample_training("A", 1));
  const std::string before = bytes_of(folder_ / "u.h5");
  expect_named(done("info --close u.h5"), {"touches           1"});
  EXPECT_TRUE(bytes_of(folder_ / "u.h5") == before) << "it is closed already";
  write_map(folder_ / "I.map.h5", sample_map("I"));
  expect_refused("info --close I.map.h5", {"I.map.h5", "palpate.map", "recording"});
}

TEST_F(InfoCommand, Map) {
  OccupancyGrid map = sample_map("I", 0.5);
  map.symmetry = 2;
  map.spread_mm = 0.7;
  map.suggested_symmetry = 0;
  write_map(folder_ / "I.map.h5", map);
  expect_info("I.map.h5",
              {"map of I", "65 x 65 of 0.5 mm", "-16.000, -16.000 mm", "0.2000",
               "spread            0.7 mm", "-4.000 to 4.000 nats", "symmetry          2",
               "suggested         full, the symmetry that the map shows"});
}

TEST_F(InfoCommand, Posterior) {
  Posterior posterior;
  posterior.objects = {"A", "I"};
  posterior.lattice.x_mm.count = 2;
  posterior.lattice.y_mm.count = 1;
  posterior.lattice.theta_rad.count = 1;
  posterior.log_likelihood = {-5.0, -7.0, -9.0, -8.0};
  write_posterior(folder_ / "p.h5", posterior);
  expect_info("p.h5", {"posterior over A, I", "2 x 1 x 1", "-5.000 nats at x -5.00 mm",
                       "-8.000 nats at x 5.00 mm"});
  posterior.log_likelihood = {-7.0, -4.0};
  posterior.rest_mass_bound = 3e-4;
  posterior.index = {2, 3};
  write_posterior(folder_ / "p.h5", posterior);
  expect_info("p.h5", {"2 bins; all others hold at most 0.0003 of the belief",
                       "A                 no bin was evaluated", "-4.000 nats at x 5.00 mm"});
}

TEST_F(InfoCommand, SensorModel) {
  LearnedSensor sensor{
      .pressure_unit = "raw",
      .classifier = {.threshold = 15.0, .ratio = 0.15},
      .table = LearnedTable{.level_edges = {40.0}},
      .temperature = 31.5,
      .temperature_growth = 0.75,
      .bins = BinSteps{.x_mm = 0.8, .y_mm = 0.4, .theta_rad = std::numbers::pi / 8.0},
      .fit_scale = FitScale{.mean = -4.5, .sd = 12.25},
      .pose_scale = PoseScale{.factor = 0.75, .map_sd_mm = 0.125}};
  sensor.maps = {{"pen.map.h5", "1a"}, {"mug.map.h5", "2b"}};
  sensor.table->shared.assign(3 * ReadingLayer::nodes, -1.0);
  sensor.table->objects["pen"] = sensor.table->shared;
  write_sensor_model(folder_ / "s.yaml", sensor);
  expect_info(
      "s.yaml",
      {"s.yaml: sensor model", "threshold         15, ratio 0.15",
       "table of 3 levels over log odds; 1 object(s) with numbers of their own",
       "temperature       31.5, and 0.75 more for every further touch",
       "learned on bins   0.8 x 0.4 mm x 22.5 deg",
       "fit scale         z of learned objects -4.5 +- 12.25",
       "learned for       mug.map.h5, pen.map.h5",
       "pose scale        covariances times 0.75, and 0.125 mm of the map along each axis"});
}

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

}  // namespace palpate::info_test
