// The sensor model that `palpate map` writes beside the maps of a folder, and who takes it; maps of
// touches at unknown poses.

#include <cmath>
#include <filesystem>

#include "palpate/learned_sensor.hpp"
#include "palpate/map_builder.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::map_sensor_test {

using nlohmann::json;

/// Learning a sensor takes some three seconds of a processor.
class MapSensor : public ProgramTest {
 protected:
  MapSensor() {
    for (const std::string letter : {"A", "U"}) {
      write_recording(folder_ / (letter + ".h5"), sample_training(letter, 30));
    }
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 4));
  }

  /// What recognize prints on standard error, and its record.
  std::pair<std::string, json> recognised(const std::string& maps) const {
    const std::string said = remarks("recognize u.h5 --json r.json --maps " + maps);
    json r = json::parse(bytes_of(folder_ / "r.json"))[0];
    r.erase("seconds");
    return {said, r};
  }
  /// Expects that recognize leaves the sensor out, and says so.
  void expect_left_out(const std::string& maps, std::initializer_list<const char*> words) const {
    const auto [said, r] = recognised(maps);
    EXPECT_FALSE(r.contains("sensor_model")) << maps;
    expect_named(said, words);
  }

  std::filesystem::path sensor(const std::string& folder) const {
    return folder_ / folder / "sensor.yaml";
  }
};

TEST_F(MapSensor, IsLearnedWithItsMapsAndTakenWithThemAlone) {
  expect_named(done("map A.h5 U.h5 -o maps/ --prior 0.3"),
               {"maps/sensor.yaml: learned from 60 touches: ", " +-", ", beyond chance)",
                "maps/sensor.yaml: \"(none)\" goes by a figure of Palpate's own"});
  const LearnedSensor learned = read_sensor_model(sensor("maps"));
  EXPECT_EQ(learned.maps.size(), 2u);
  EXPECT_TRUE(learned.table);
  EXPECT_FALSE(learned.fit_scale->stranger_sd);

  const auto [said, by_default] = recognised("maps");
  EXPECT_EQ(said, "");
  EXPECT_EQ(by_default["sensor_model"], "maps/sensor.yaml");
  EXPECT_EQ(recognised("maps --sensor-model maps/sensor.yaml").second, by_default);
  EXPECT_EQ(recognised("maps/A.map.h5").second["sensor_model"], "maps/sensor.yaml")
      << "a map named singly";

  // It is learned anew from the touches of the other maps, in whatever order.
  expect_named(done("map A.h5 -o apart/ --prior 0.3"),
               {"no sensor model: it takes 15 touches or more of each of two objects"});
  EXPECT_FALSE(std::filesystem::exists(sensor("apart")));
  done("map U.h5 -o apart/ --prior 0.3");
  EXPECT_TRUE(bytes_of(sensor("apart")) == bytes_of(sensor("maps")));
  // Maps that no longer are what it was learned for take it along.
  expect_named(done("map A.h5 -o apart/ --frames 0:10"), {"apart/sensor.yaml: removed"});
  EXPECT_FALSE(std::filesystem::exists(sensor("apart")));

  // Without it, maps and results are those of Eq. 7.
  const json none = recognised("maps --sensor-model none").second;
  EXPECT_FALSE(none.contains("sensor_model"));
  done("map A.h5 U.h5 -o plain/ --sensor-model none --prior 0.3");
  EXPECT_FALSE(std::filesystem::exists(sensor("plain")));
  json plain = recognised("plain").second;
  plain["mode"]["map"] = none["mode"]["map"];
  EXPECT_EQ(plain, none);
  const OccupancyGrid map = read_map(folder_ / "plain/A.map.h5");
  EXPECT_EQ(map.log_odds, read_map(folder_ / "maps/A.map.h5").log_odds);
  EXPECT_TRUE(map.mean_level.empty());

  remarks("batch u.h5 --maps maps -o results");
  remarks("merge results -o results.ndjson");
  EXPECT_EQ(json::parse(bytes_of(folder_ / "results.ndjson"))["sensor_model"], "maps/sensor.yaml");

  // It is left out where it does not go with what is asked.
  expect_left_out("maps --gamma 0.1", {"maps/sensor.yaml is left out: --gamma"});
  expect_left_out("maps --threshold 1.5", {"is left out: its threshold is"});

  done("map A.h5 -o single.map.h5 --prior 0.3");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "sensor.yaml"));
  std::filesystem::copy(folder_ / "single.map.h5", folder_ / "maps/other.map.h5");
  expect_left_out("maps", {"was not learned for maps/other.map.h5, and is left out"});
  std::filesystem::remove(folder_ / "maps/other.map.h5");

  std::filesystem::copy(folder_ / "maps", folder_ / "other");
  LearnedSensor another = read_sensor_model(sensor("other"));
  another.temperature *= 1.5;
  write_sensor_model(sensor("other"), another);
  expect_refused("recognize u.h5 --maps maps/A.map.h5 other/U.map.h5",
                 {"other/sensor.yaml: differs from maps/sensor.yaml"});

  // One that is another's is no reason to refuse the maps.
  another.maps.clear();
  write_sensor_model(sensor("other"), another);
  expect_left_out("maps/A.map.h5 other/U.map.h5 single.map.h5",
                  {"other/sensor.yaml does not say which maps it is for, and is left out",
                   "maps/sensor.yaml was not learned for single.map.h5, and is left out; build "
                   "the maps of both anew in one folder"});

  // Of earlier maps it is said to stay.
  expect_named(remarks("map A.h5 -o maps/ --sensor-model none"),
               {"maps/sensor.yaml: stays, and was learned for earlier maps"});
  EXPECT_TRUE(std::filesystem::exists(sensor("maps")));
}

// On every day the objects lie elsewhere, by more than touches of one day can tell.
TEST_F(MapSensor, IsOfGroupsThatAreLeftOutTogether) {
  std::string map = "map";
  for (std::size_t day = 0; day < 3; ++day) {
    for (const std::string letter : {"A", "U"}) {
      Recording touches = part_of(sample_training(letter, 90), 30 * day, 30 * (day + 1));
      for (Pose& pose : touches.T_robot_sensor) {
        pose.translation_mm.x += 0.35 * static_cast<double>(day) - 0.35;
      }
      touches.object = letter + "@day" + std::to_string(day);
      const std::string name = letter + std::to_string(day) + ".h5";
      write_recording(folder_ / name, touches);
      map += " " + name;
    }
  }
  done(map + " --group label -o days/");
  const MapSource of_days = *read_map(folder_ / "days/A.map.h5").source;
  EXPECT_GT(of_days.pose_scale->map_sd_mm, 0.2) << "0.15 at most without groups";
  EXPECT_GT(read_sensor_model(sensor("days")).pose_scale.value().map_sd_mm, 0.2);
  EXPECT_EQ(of_days.groups.front(), "day0");

  expect_refused("map A.h5 -o new/ --group label",
                 {"A.h5", "'A'", "LABEL@GROUP", "--group recording"});
  std::filesystem::copy(folder_ / "A.h5", folder_ / "again.h5");
  expect_refused("map A.h5 again.h5 U.h5 -o new/ --group recording",
                 {"--group recording", "'U'", "'U.h5'", "two groups or more"});
}

TEST_F(MapSensor, OfAnotherHandStays) {
  std::filesystem::create_directory(folder_ / "maps");
  for (const auto& [text, status] :
       {std::pair<std::string, int>{"format: palpate.sensor_model\n", 0}, {"x", 2}}) {
    put_bytes(sensor("maps"), text);
    const std::string said = remarks("map A.h5 U.h5 -o maps/");
    expect_named(said, {"maps/sensor.yaml: was not written by palpate map, and stays",
                        status == 0 ? "To recognise with it" : "until it is mended or moved"});
    EXPECT_EQ(palpate("recognize u.h5 --maps maps --touches=1").status, status);
    EXPECT_EQ(bytes_of(sensor("maps")), text);
  }
}

/// Presses without poses.
Recording unposed_presses(const std::string& shape, int presses, std::uint64_t seed) {
  Recording recording = sample_presses(shape, presses, seed);
  recording.T_robot_sensor.assign(recording.size(), {});
  return recording;
}

class MapUnposedCommand : public ProgramTest {
 protected:
  MapUnposedCommand() {
    write_recording(folder_ / "A.h5", unposed_presses("A", 6, 1));
    Recording foreign = unposed_presses("ring", 1, 2);
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

}  // namespace palpate::map_sensor_test
