// palpate calibrate on simulated letters, and what takes its sensor model.

#include <algorithm>
#include <map>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::calibrate_test {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using Arguments = std::vector<std::string>;

class CalibrateCommand : public ProgramTest {
 protected:
  CalibrateCommand() {
    for (const char* letter : {"A", "U"}) {
      write_recording(folder_ / (std::string(letter) + ".h5"), sample_training(letter, 24));
    }
  }

  static Arguments with(Arguments flags) {
    flags.insert(flags.begin(), {"calibrate", "A.h5", "U.h5", "-o", "s.yaml"});
    return flags;
  }
  LearnedSensor learned_of_16(const Arguments& flags) const {
    const Outcome outcome = palpate(with(flags));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("16 touches"));
    return read_sensor_model(folder_ / "s.yaml");
  }
  /// Touches of A at one pose, which is no pose.
  void write_unposed(const std::string& file) const {
    Recording recording = sample_training("A", 4);
    recording.T_robot_sensor.assign(4, Pose{});
    write_recording(folder_ / file, recording);
  }
};

TEST_F(CalibrateCommand, WritesASensorModelAndSaysWhatItLearned) {
  const std::string out = done(with({}));
  const LearnedSensor sensor = read_sensor_model(folder_ / "s.yaml");
  EXPECT_EQ(sensor.pressure_unit, "kPa");
  ASSERT_TRUE(sensor.table.has_value());
  EXPECT_EQ(sensor.table->levels(), 7U);
  EXPECT_EQ(sensor.table->layer.of, MapLayer::mean_level);
  EXPECT_TRUE(sensor.table->objects.contains("A") && sensor.table->objects.contains("U"));
  EXPECT_TRUE(sensor.bins);
  EXPECT_THAT(out, HasSubstr("48 touches, 2 objects"));
  for (const auto& [name, value] :
       std::map<std::string, double>{{"noise floor, kPa", sensor.noise},
                                     {"contact threshold, kPa", sensor.classifier.threshold},
                                     {"spread of maps, mm", sensor.spread_mm},
                                     {"temperature", sensor.temperature}}) {
    const std::size_t row = out.find(name);
    ASSERT_NE(row, out.npos) << name << " not in\n" << out;
    EXPECT_THAT(out.substr(row, out.find('\n', row) - row),
                HasSubstr(fmt::format("{:.3g}", value)));
  }
  for (const char* part :
       {"default", "learned", "cross-validation", "Eq. 7", "table, tempered", "accuracy",
        "95 % interval", "log-loss, nats", "calibration error", "\ns.yaml\n"}) {
    EXPECT_THAT(out, HasSubstr(part));
  }
}

TEST_F(CalibrateCommand, LearnsWhatRecognizeAndMapTake) {
  const LearnedSensor sensor = learned_of_16({"--bins=15x15x12", "--frames=0:8"});
  done({"map", "A.h5", "U.h5", "-o", "maps/", "--sensor-model", "s.yaml"});
  const OccupancyGrid map = read_map(folder_ / "maps/A.map.h5");
  EXPECT_EQ(map.spread_mm, sensor.spread_mm);
  EXPECT_NEAR(map.prior, sensor.prior, 1e-12);
  EXPECT_FALSE(map.mean_level.empty());
  write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
  // On bins so wide the touches seem to share no pose, and a table of so few touches is none too
  // sure.
  EXPECT_EQ(record({"u.h5", "--maps", "maps", "--bins", "15x15x12", "--none=0", "--sensor-model",
                    "s.yaml", "--filter=bounded"})["best"],
            "A");

  // The maps serve to calibrate, too.
  const LearnedSensor by_maps = learned_of_16({"--maps=maps", "--bins=15x15x12", "--frames=0:8"});
  EXPECT_EQ(by_maps.classifier.threshold, sensor.classifier.threshold);
  EXPECT_NE(by_maps.table->shared, sensor.table->shared);
}

TEST_F(CalibrateCommand, TakesItsFlags) {
  const LearnedSensor sensor =
      learned_of_16({"--threshold", "3.5", "--ratio", "0.25", "--levels", "3", "--layer",
                     "log_odds", "--frames", "2:10", "--bins", "9x9x8"});
  EXPECT_EQ(sensor.classifier.threshold, 3.5);
  EXPECT_EQ(sensor.classifier.ratio, 0.25);
  EXPECT_EQ(sensor.table->levels(), 3U);
  EXPECT_EQ(sensor.table->layer.of, MapLayer::log_odds);
  EXPECT_EQ(learned_of_16({"--levels=2", "--frames=0:8", "--bins=9x9x8"}).table->levels(), 2U);
}

TEST_F(CalibrateCommand, LearnsForTheBinsThatRecognizeWillHave) {
  const std::string out = done(with({"--bins", "20x10x12", "--y-mm=-5:5", "--theta-deg", "0:180"}));
  EXPECT_THAT(out, HasSubstr("3 touches together"));
  const LearnedSensor sensor = read_sensor_model(folder_ / "s.yaml");
  ASSERT_TRUE(sensor.bins.has_value());
  EXPECT_NEAR(sensor.bins->x_mm, 1.0, 1e-9);
  EXPECT_NEAR(sensor.bins->y_mm, 1.0, 1e-9);
  EXPECT_NEAR(sensor.bins->theta_rad, std::numbers::pi / 12.0, 1e-9);
  done({"map", "A.h5", "-o", "maps/", "--sensor-model", "s.yaml"});
  write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 1));
  const auto said = [&](const char* bins, const char* touch_sd_mm = "0") {
    return palpate({"recognize", "u.h5", "--maps", "maps", "--bins", bins, "--sensor-model",
                    "s.yaml", "--touch-sd-mm", touch_sd_mm, "--filter", "bounded"})
        .err;
  };
  EXPECT_EQ(said("20x20x24"), "");
  EXPECT_THAT(
      said("10x10x24"),
      HasSubstr("bins are 2 x 2 mm x 15 degrees wide, wider than the 1 x 1 mm x 15 degrees"));
  EXPECT_EQ(said("10x10x24", "4"), "") << "the belief is as smooth";
}

TEST_F(CalibrateCommand, RefusesBinsThatSayNothing) {
  expect_refused(with({"--bins", "auto"}), {"--bins auto", "25x25x16"});
  expect_refused(with({"--bins", "3x3"}), {"--bins"});
  expect_refused(with({"--bins=2000000000x2000000000x360", "--x-mm=-1e6:1e6", "--y-mm=-1e6:1e6"}),
                 {"48 touches", "too long", "--x-mm"});
  expect_refused(with({"--unposed", "--bins", "9x9x9"}), {"known poses"});
  expect_refused(with({"--unposed", "--pivot-mm", "auto"}), {"known poses"});
}

TEST_F(CalibrateCommand, TakesTouchesAtUnknownPoses) {
  done(with({"--unposed", "--frames", "0:12"}));
  EXPECT_FALSE(read_sensor_model(folder_ / "s.yaml").bins.has_value());
  write_unposed("still.h5");
  done({"calibrate", "still.h5", "U.h5", "--unposed", "-o", "s.yaml"});
}

TEST_F(CalibrateCommand, OfOneObjectWarns) {
  const Outcome outcome = palpate({"calibrate", "A.h5", "-o", "s.yaml"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("palpate: touches of one object say nothing"));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_THAT(outcome.out, Not(HasSubstr("cross-validation")));
  EXPECT_EQ(read_sensor_model(folder_ / "s.yaml").temperature, 1.0);
}

TEST_F(CalibrateCommand, RefusesRecordingsThatSayTooLittle) {
  Recording nameless = sample_training("A", 4);
  nameless.object.clear();
  write_recording(folder_ / "nameless.h5", nameless);
  expect_refused({"calibrate", "A.h5", "nameless.h5", "-o", "s.yaml"},
                 {"nameless.h5: attribute 'object' is empty"});
  write_unposed("still.h5");
  for (const Arguments& files : {Arguments{"A.h5", "still.h5"}, Arguments{"still.h5", "A.h5"}}) {
    expect_refused({"calibrate", files[0], files[1], "-o", "s.yaml"},
                   {"still.h5: all touches are at one pose", "--unposed"});
  }
  expect_refused({"calibrate", "A.h5", "--frames", "0:1", "-o", "s.yaml"},
                 {"at least two touches of one object"});
  expect_refused({"calibrate", "A.h5", "A.h5", "-o", "s.yaml"}, {"A.h5: given twice"});
  expect_refused({"calibrate", "missing.h5", "-o", "s.yaml"}, {"missing.h5: no such file"});
  expect_refused(with({"--frames", "0:25"}), {"A.h5: has 24 touches", "--frames 0:25"});
  expect_refused(with({"--threshold", "1000"}), {"above the contact threshold, 1000 kPa"});
}

TEST_F(CalibrateCommand, RefusesValuesOutOfRange) {
  for (const char* levels : {"9", "1", "0"}) {
    expect_refused(with({"--levels", levels}), {"--levels", levels, "2 to 8"});
  }
  expect_refused(with({"--levels", "-3"}), {"--levels", "-3", "whole number"});
  expect_refused(with({"--levels", "2.5"}), {"--levels", "2.5", "whole number"});
  expect_refused(with({"--layer", "other"}), {"--layer", "other", "auto, mean_level or log_odds"});
  expect_refused(with({"--ratio", "1"}), {"--ratio", "below 1"});
  expect_refused(with({"--threshold", "0"}), {"--threshold", "0"});
  expect_refused(with({"--threshold", "nan"}), {"--threshold", "nan"});
  expect_refused({"calibrate", "A.h5"}, {"-o", "required"});
}

TEST_F(CalibrateCommand, RefusesMapsThatItCannotCompareWith) {
  write_map(folder_ / "A.map.h5", sample_map("A"));
  expect_refused(with({"--maps", "A.map.h5"}), {"A.map.h5: has no mean_level",
                                                "--unposed or --sensor-model", "--layer log_odds"});
  write_map(folder_ / "Z.map.h5", sample_map("Z"));
  expect_refused(with({"--maps", "Z.map.h5", "--layer", "log_odds"}), {"or a map of it"});
  expect_refused(with({"--maps", "missing.map.h5"}), {"missing.map.h5", "no such file"});
}

TEST_F(CalibrateCommand, RefusesOutputsThatItCannotWrite) {
  expect_refused({"calibrate", "A.h5", "U.h5", "-o", "nowhere/s.yaml"}, {"nowhere", "not exist"});
  std::filesystem::create_directory(folder_ / "folder");
  expect_refused({"calibrate", "A.h5", "U.h5", "-o", "folder"}, {"folder"});
}

TEST_F(CalibrateCommand, RefusesToOverwriteWhatItReads) {
  expect_refused({"calibrate", "A.h5", "U.h5", "-o", "./U.h5"},
                 {"-o ./U.h5", "RECORDING reads", "overwrite"});
  write_map(folder_ / "A.map.h5", sample_map("A"));
  expect_refused({"calibrate", "A.h5", "U.h5", "-o", "A.map.h5", "--maps", "A.map.h5"},
                 {"-o A.map.h5", "--maps reads"});
}

}  // namespace palpate::calibrate_test
