#include <cmath>

#include "palpate/learned_sensor.hpp"
#include "palpate/simulation.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::map_unposed_test {

/// Presses of an array of 16 x 16 elements, 2 mm apart, that sees a letter whole.
Recording sample_presses(const std::string& shape, int presses, std::uint64_t seed) {
  std::vector<Pose> T_object_sensor = random_poses(presses, seed);
  for (Pose& pose : T_object_sensor) {
    pose.translation_mm *= 0.3;
  }
  Recording recording =
      Simulator(make_shape(shape), {}, grid_array(16, 16, 2.0), seed).touch(T_object_sensor, {});
  recording.T_robot_sensor.assign(recording.size(), {});
  return recording;
}

class MapUnposedCommand : public ProgramTest {
 protected:
  MapUnposedCommand() {
    write_recording(folder_ / "A.h5", sample_presses("A", 6, 1));
    Recording foreign = sample_presses("ring", 1, 2);
    foreign.object = "A";
    write_recording(folder_ / "foreign.h5", foreign);
  }
};

TEST_F(MapUnposedCommand, WritesOneMapAndListsWhatFitsNowhere) {
  // Cells of half of the 2 mm between elements.
  expect_named(done("map A.h5 -o A.map.h5 --unposed"),
               {"A.map.h5: A from 6 presses that fit by 0.", "cells of 1 mm"});
  const OccupancyGrid map = read_map(folder_ / "A.map.h5");
  EXPECT_EQ(map.label, "A");
  EXPECT_NEAR(*map.spread_mm, 1.2, 1e-12);
  EXPECT_FALSE(map.observations.empty());
  EXPECT_FALSE(map.mean_level.empty());
  EXPECT_FALSE(map.mirror);
  expect_named(done("map A.h5 foreign.h5 -o A.map.h5 --unposed --png maps.png"),
               {"A from 6 presses", "foreign.h5: press 0 left out: fits no map (0."});
  EXPECT_TRUE(bytes_of(folder_ / "maps.png").starts_with("\x89PNG"));
}

TEST_F(MapUnposedCommand, SeveralMapsOfALabelAreReadByRecognize) {
  expect_named(done("map A.h5 foreign.h5 -o maps/ --unposed --max-maps 2 --mirror --ros ros"),
               {"maps/A.2.map.h5: A from a press that fits no other"});
  EXPECT_TRUE(read_map(folder_ / "maps/A.1.map.h5").mirror);
  EXPECT_TRUE(read_map(folder_ / "maps/A.2.map.h5").mirror);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "ros/A.2.yaml"));
  const auto recognised = record("foreign.h5 --maps maps/ --bins 25x25x16");
  EXPECT_EQ(recognised["best"], "A");
  EXPECT_EQ(recognised["mode"]["map"], "maps/A.2.map.h5");
  expect_named(remarks("map A.h5 -o maps/ --unposed --max-maps 1"),
               {"maps/A.1.map.h5: an older map of 'A'", "maps/A.2.map.h5: an older map of 'A'"});
}

TEST_F(MapUnposedCommand, SaysWhatLearningASensorTakes) {
  const std::string map = "map A.h5 -o maps/ --unposed";
  expect_named(done(map), {"no sensor model: it takes 10 touches or more of each of two objects"});
  EXPECT_EQ(done(map + " --sensor-model none").find("no sensor model"), std::string::npos);
  expect_named(done(map + " --label B"), {"no sensor model: maps/A.map.h5: stays"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "maps/sensor.yaml"));
}

TEST_F(MapUnposedCommand, RefusesInOneLine) {
  expect_refused("map A.h5 -o new/ --unposed --max-maps 0", {"--max-maps 0", "1 or more"});
  expect_refused("map A.h5 -o A.map.h5 --unposed --max-maps 2",
                 {"--max-maps 2", "--output A.map.h5/"});
  expect_refused("map A.h5 -o new/ --max-maps 2", {"--max-maps 2", "--unposed"});
  expect_refused("map A.h5 -o new/ --unposed --threshold 1000", {"'A'", "no press", "threshold"});
  expect_refused("map A.h5 -o new/ --unposed --sensor-model none.yaml", {"none.yaml"});
}

class MapWithSensorModel : public ProgramTest {
 protected:
  MapWithSensorModel() {
    write_recording(folder_ / "A.h5", sample_training("A", 24));
    write_sensor_model(
        folder_ / "sensor.yaml",
        {.classifier = {.threshold = 4.0, .ratio = 0.2}, .prior = 0.15, .spread_mm = 0.8});
  }

  OccupancyGrid map_with(const std::string& flags) const {
    done("map A.h5 -o A.map.h5 " + flags);
    return read_map(folder_ / "A.map.h5");
  }
};

TEST_F(MapWithSensorModel, TakesItsNumbersAsDefaults) {
  const OccupancyGrid by_model = map_with("--sensor-model sensor.yaml");
  EXPECT_EQ(by_model.prior, 0.15);
  EXPECT_EQ(by_model.spread_mm, 0.8);
  const OccupancyGrid by_flags = map_with("--threshold 4 --ratio 0.2 --prior 0.15 --spread-mm 0.8");
  ASSERT_EQ(by_model.log_odds.size(), by_flags.log_odds.size());
  for (std::size_t k = 0; k < by_flags.log_odds.size(); ++k) {
    EXPECT_NEAR(by_model.log_odds[k], by_flags.log_odds[k],
                2e-3 + 1e-4 * std::abs(by_flags.log_odds[k]));
  }
  EXPECT_TRUE(by_flags.observations.empty());
  EXPECT_EQ(by_model.observations.size(), by_model.log_odds.size());
  EXPECT_EQ(by_model.mean_level.size(), by_model.log_odds.size());
  // Flags come first.
  const OccupancyGrid map =
      map_with("--sensor-model sensor.yaml --prior 0.3 --spread-mm 0.7 --mirror");
  EXPECT_EQ(map.prior, 0.3);
  EXPECT_EQ(map.spread_mm, 0.7);
  EXPECT_TRUE(map.mirror);
}

TEST_F(MapWithSensorModel, RefusesAnotherPressureUnit) {
  write_sensor_model(folder_ / "raw.yaml", {.pressure_unit = "raw"});
  expect_refused("map A.h5 -o new/ --sensor-model raw.yaml",
                 {"raw.yaml", "pressure_unit is raw", "A.h5 has kPa"});
}

}  // namespace palpate::map_unposed_test
