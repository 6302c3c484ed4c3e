// palpate calibrate on simulated letters, and what takes its sensor model.

#include <algorithm>
#include <numbers>

#include <fmt/format.h>

#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::calibrate_test {

class CalibrateCommand : public ProgramTest {
 protected:
  CalibrateCommand() {
    for (const std::string letter : {"A", "U"}) {
      write_recording(folder_ / (letter + ".h5"), sample_training(letter, 24));
    }
  }

  /// What the command says of A and U.
  std::string said(const std::string& flags = "") const { return done(calibrate_ + flags); }
  LearnedSensor learned_of_16(const std::string& flags) const {
    const Outcome outcome = palpate(calibrate_ + flags);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    expect_named(outcome.out, {"16 touches"});
    return learned();
  }
  LearnedSensor learned() const { return read_sensor_model(folder_ / "s.yaml"); }
  /// Touches of A at one pose, which is no pose.
  void write_unposed(const std::string& file) const {
    Recording recording = sample_training("A", 4);
    recording.T_robot_sensor.assign(4, Pose{});
    write_recording(folder_ / file, recording);
  }

  const std::string calibrate_ = "calibrate A.h5 U.h5 -o s.yaml ";
};

TEST_F(CalibrateCommand, WritesASensorModelAndSaysWhatItLearned) {
  const std::string out = said();
  const LearnedSensor sensor = learned();
  EXPECT_EQ(sensor.pressure_unit, "kPa");
  ASSERT_TRUE(sensor.table.has_value());
  EXPECT_EQ(sensor.table->levels(), 7U);
  EXPECT_EQ(sensor.table->layer.of, MapLayer::mean_level);
  EXPECT_TRUE(sensor.table->objects.contains("A") && sensor.table->objects.contains("U"));
  EXPECT_TRUE(sensor.bins);
  for (const auto& [name, value] : {std::pair{"noise floor, kPa", sensor.noise},
                                    {"contact threshold, kPa", sensor.classifier.threshold},
                                    {"spread of maps, mm", sensor.spread_mm},
                                    {"temperature", sensor.temperature}}) {
    const std::size_t row = out.find(name);
    ASSERT_NE(row, out.npos) << name << " not in\n" << out;
    expect_named(out.substr(row, out.find('\n', row) - row),
                 {fmt::format("{:.3g}", value).c_str()});
  }
  expect_named(out, {"48 touches, 2 objects", "default", "learned", "cross-validation", "Eq. 7",
                     "table, tempered", "accuracy", "95 % interval", "log-loss, nats",
                     "calibration error", "\ns.yaml\n"});
}

TEST_F(CalibrateCommand, LearnsWhatRecognizeAndMapTake) {
  const LearnedSensor sensor = learned_of_16("--bins=15x15x12 --frames=0:8");
  done("map A.h5 U.h5 -o maps/ --sensor-model s.yaml");
  write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
  // On bins so wide the touches seem to share no pose, and a table of so few touches is none too
  // sure.
  EXPECT_EQ(record("u.h5 --maps maps --bins 15x15x12 --none=0 --sensor-model s.yaml "
                   "--filter=bounded")["best"],
            "A");

  // The maps serve to calibrate, too.
  const LearnedSensor by_maps = learned_of_16("--maps=maps --bins=15x15x12 --frames=0:8");
  EXPECT_EQ(by_maps.classifier.threshold, sensor.classifier.threshold);
  EXPECT_NE(by_maps.table->shared, sensor.table->shared);
}

TEST_F(CalibrateCommand, TakesItsFlags) {
  const LearnedSensor sensor = learned_of_16(
      "--threshold 3.5 --ratio 0.25 --levels 3 --layer log_odds --frames 2:10 --bins 9x9x8");
  EXPECT_EQ(sensor.classifier.threshold, 3.5);
  EXPECT_EQ(sensor.classifier.ratio, 0.25);
  EXPECT_EQ(sensor.table->levels(), 3U);
  EXPECT_EQ(sensor.table->layer.of, MapLayer::log_odds);
  EXPECT_EQ(learned_of_16("--levels=2 --frames=0:8 --bins=9x9x8").table->levels(), 2U);
}

TEST_F(CalibrateCommand, LearnsForTheBinsThatRecognizeWillHave) {
  expect_named(said("--bins 20x10x12 --y-mm=-5:5 --theta-deg 0:180"), {"3 touches together"});
  const BinSteps bins = learned().bins.value();
  EXPECT_NEAR(bins.x_mm, 1.0, 1e-9);
  EXPECT_NEAR(bins.y_mm, 1.0, 1e-9);
  EXPECT_NEAR(bins.theta_rad, std::numbers::pi / 12.0, 1e-9);
}

TEST_F(CalibrateCommand, TakesTouchesAtUnknownPosesAndOfOneObject) {
  said("--unposed --frames 0:12");
  EXPECT_FALSE(learned().bins.has_value());
  write_unposed("still.h5");
  done("calibrate still.h5 U.h5 --unposed -o s.yaml");
  const Outcome outcome = palpate("calibrate A.h5 -o s.yaml");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_named(outcome.err, {"palpate: touches of one object say nothing"});
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
  EXPECT_EQ(outcome.out.find("cross-validation"), std::string::npos) << outcome.out;
  EXPECT_EQ(learned().temperature, 1.0);
}

TEST_F(CalibrateCommand, RefusesInOneLine) {
  Recording nameless = sample_training("A", 4);
  nameless.object.clear();
  write_recording(folder_ / "nameless.h5", nameless);
  write_unposed("still.h5");
  write_map(folder_ / "A.map.h5", sample_map("A"));
  std::filesystem::create_directory(folder_ / "folder");
  const std::pair<std::string, std::vector<std::string>> cases[] = {
      // Flags.
      {calibrate_ + "--bins auto", {"--bins auto", "25x25x16"}},
      {calibrate_ + "--bins 3x3", {"--bins"}},
      {calibrate_ + "--unposed --bins 9x9x9", {"known poses"}},
      {calibrate_ + "--unposed --pivot-mm auto", {"known poses"}},
      {calibrate_ + "--group recording", {"likelihood table", "of two groups with --group"}},
      {calibrate_ + "--frames 0:25", {"A.h5: has 24 touches", "--frames 0:25"}},
      {calibrate_ + "--threshold 0", {"--threshold", "0"}},
      {calibrate_ + "--ratio 1", {"--ratio", "below 1"}},
      {calibrate_ + "--levels 9", {"--levels", "9", "2 to 8"}},
      {calibrate_ + "--levels 1", {"--levels", "1", "2 to 8"}},
      {calibrate_ + "--levels -3", {"--levels", "-3", "whole number"}},
      {calibrate_ + "--layer other", {"--layer", "other", "auto, mean_level or log_odds"}},
      {"calibrate A.h5", {"-o", "required"}},
      // Recordings.
      {"calibrate A.h5 nameless.h5 -o s.yaml", {"nameless.h5: attribute 'object' is empty"}},
      {"calibrate A.h5 still.h5 -o s.yaml", {"still.h5: all touches are at one pose", "--unposed"}},
      {"calibrate A.h5 A.h5 -o s.yaml", {"A.h5: given twice"}},
      // Maps.
      {calibrate_ + "--maps A.map.h5",
       {"A.map.h5: has no mean_level", "--unposed or --sensor-model", "--layer log_odds"}},
      // Outputs.
      {"calibrate A.h5 U.h5 -o nowhere/s.yaml", {"nowhere", "not exist"}},
      {"calibrate A.h5 U.h5 -o folder", {"folder"}},
      {"calibrate A.h5 U.h5 -o ./U.h5", {"-o ./U.h5", "RECORDING reads", "overwrite"}},
      {"calibrate A.h5 U.h5 -o A.map.h5 --maps A.map.h5", {"-o A.map.h5", "--maps reads"}}};
  for (const auto& [command, named] : cases) {
    expect_refused(command, named);
  }
}

}  // namespace palpate::calibrate_test
