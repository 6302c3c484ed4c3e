// The sensor model that `palpate map` writes beside the maps of a folder, and who takes it.

#include <filesystem>

#include "palpate/learned_sensor.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::map_sensor_test {

using nlohmann::json;
using Arguments = std::vector<std::string>;

/// Every test learns a sensor, twice at most: some three seconds of a processor each time.
class MapSensor : public ProgramTest {
 protected:
  MapSensor() {
    for (const char* letter : {"A", "U"}) {
      write_recording(folder_ / (std::string(letter) + ".h5"), sample_training(letter, 30));
    }
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 4));
  }

  /// What recognize prints on standard error, and its record.
  std::pair<std::string, json> recognised(Arguments flags) const {
    flags.insert(flags.begin(), {"recognize", "u.h5", "--json", "r.json", "--maps"});
    const Outcome outcome = palpate(flags);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    json r = json::parse(bytes_of(folder_ / "r.json"))[0];
    r.erase("seconds");
    return {outcome.err, r};
  }

  std::filesystem::path sensor(const std::string& folder) const {
    return folder_ / folder / "sensor.yaml";
  }
};

TEST_F(MapSensor, IsWrittenWithTheMapsAndTakenWithThem) {
  const std::string out = done({"map", "A.h5", "U.h5", "-o", "maps/"});
  EXPECT_NE(out.find("maps/sensor.yaml: learned from 60 touches: "), std::string::npos) << out;
  EXPECT_NE(out.find(" +-"), std::string::npos) << "standard errors of the differences\n" << out;
  EXPECT_NE(out.find(", beyond chance)"), std::string::npos) << out;
  const LearnedSensor learned = read_sensor_model(sensor("maps"));
  EXPECT_EQ(learned.maps.size(), 2u);
  EXPECT_TRUE(learned.table);
  EXPECT_FALSE(learned.fit_scale->stranger_sd);
  EXPECT_NE(out.find("maps/sensor.yaml: \"(none)\" goes by a figure of Palpate's own"),
            std::string::npos)
      << out;

  const auto [said, by_default] = recognised({"maps"});
  EXPECT_EQ(said, "");
  EXPECT_EQ(by_default["sensor_model"], "maps/sensor.yaml");
  const auto [nothing, given] = recognised({"maps", "--sensor-model", "maps/sensor.yaml"});
  EXPECT_EQ(given, by_default);
  EXPECT_EQ(recognised({"maps/A.map.h5"}).second["sensor_model"], "maps/sensor.yaml")
      << "a map named singly";

  // Without it, maps and results are those of Eq. 7.
  const json none = recognised({"maps", "--sensor-model", "none"}).second;
  EXPECT_FALSE(none.contains("sensor_model"));
  done({"map", "A.h5", "U.h5", "-o", "plain/", "--sensor-model", "none"});
  EXPECT_FALSE(std::filesystem::exists(sensor("plain")));
  json plain = recognised({"plain"}).second;
  plain["mode"]["map"] = none["mode"]["map"];
  EXPECT_EQ(plain, none);
  const OccupancyGrid map = read_map(folder_ / "plain/A.map.h5");
  EXPECT_EQ(map.log_odds, read_map(folder_ / "maps/A.map.h5").log_odds);
  EXPECT_TRUE(map.mean_level.empty());

  EXPECT_EQ(palpate({"batch", "u.h5", "--maps", "maps", "-o", "results"}).status, 0);
  EXPECT_EQ(palpate({"merge", "results", "-o", "results.ndjson"}).status, 0);
  EXPECT_EQ(json::parse(bytes_of(folder_ / "results.ndjson"))["sensor_model"], "maps/sensor.yaml");
}

TEST_F(MapSensor, IsLeftOutWhereItDoesNotGoWithWhatIsAsked) {
  done({"map", "A.h5", "U.h5", "-o", "maps/"});
  const auto said_without = [&](const Arguments& flags) {
    const auto [said, r] = recognised(flags);
    EXPECT_FALSE(r.contains("sensor_model"));
    return said;
  };
  EXPECT_NE(said_without({"maps", "--gamma", "0.1"}).find("maps/sensor.yaml is left out: --gamma"),
            std::string::npos);
  EXPECT_NE(said_without({"maps", "--threshold", "1.5"}).find("is left out: its threshold is"),
            std::string::npos);

  done({"map", "A.h5", "-o", "single.map.h5"});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "sensor.yaml"));
  std::filesystem::copy(folder_ / "single.map.h5", folder_ / "maps/other.map.h5");
  EXPECT_NE(said_without({"maps"}).find("was not learned for maps/other.map.h5, and is left out"),
            std::string::npos);
  std::filesystem::remove(folder_ / "maps/other.map.h5");

  std::filesystem::copy(folder_ / "maps", folder_ / "other");
  LearnedSensor another = read_sensor_model(sensor("other"));
  another.temperature *= 1.5;
  write_sensor_model(sensor("other"), another);
  const Outcome unlike =
      palpate({"recognize", "u.h5", "--maps", "maps/A.map.h5", "other/U.map.h5"});
  EXPECT_EQ(unlike.status, 2);
  EXPECT_NE(unlike.err.find("other/sensor.yaml: differs from maps/sensor.yaml"), std::string::npos)
      << unlike.err;

  // One that is another's is no reason to refuse the maps.
  another.maps.clear();
  write_sensor_model(sensor("other"), another);
  const std::string said = said_without({"maps/A.map.h5", "other/U.map.h5", "single.map.h5"});
  EXPECT_NE(said.find("other/sensor.yaml does not say which maps it is for, and is left out"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("maps/sensor.yaml was not learned for single.map.h5, and is left out; build "
                      "the maps of both anew in one folder"),
            std::string::npos)
      << said;
}

TEST_F(MapSensor, IsLearnedAnewFromTheTouchesOfTheOtherMaps) {
  const std::string alone = done({"map", "A.h5", "-o", "maps/"});
  EXPECT_NE(alone.find("no sensor model: it takes 15 touches or more of each of two objects"),
            std::string::npos)
      << alone;
  EXPECT_FALSE(std::filesystem::exists(sensor("maps")));
  const std::string joined = done({"map", "U.h5", "-o", "maps/"});
  EXPECT_NE(joined.find("maps/sensor.yaml: learned from 60 touches"), std::string::npos) << joined;
  EXPECT_EQ(read_sensor_model(sensor("maps")).maps.size(), 2u);

  // Maps that no longer are what it was learned for take it along.
  const std::string few = done({"map", "A.h5", "-o", "maps/", "--frames", "0:10"});
  EXPECT_NE(few.find("maps/sensor.yaml: removed"), std::string::npos) << few;
  EXPECT_FALSE(std::filesystem::exists(sensor("maps")));
}

TEST_F(MapSensor, IsTheSameWhateverTheOrderInWhichObjectsCame) {
  const auto add = [&](const std::vector<std::string>& objects, const char* folder) {
    std::vector<std::string> arguments{"map"};
    arguments.insert(arguments.end(), objects.begin(), objects.end());
    arguments.insert(arguments.end(), {"-o", std::string(folder) + "/", "--prior", "0.3"});
    done(arguments);
  };
  add({"A.h5"}, "apart");
  add({"U.h5"}, "apart");
  add({"A.h5", "U.h5"}, "together");
  EXPECT_TRUE(bytes_of(sensor("apart")) == bytes_of(sensor("together")));
}

// On every day the objects lie elsewhere, by more than touches of one day can tell.
TEST_F(MapSensor, IsOfGroupsThatAreLeftOutTogether) {
  Arguments of_labels{"map"};
  Arguments of_recordings{"map"};
  for (std::size_t day = 0; day < 3; ++day) {
    for (const char* letter : {"A", "U"}) {
      Recording touches = part_of(sample_training(letter, 90), 30 * day, 30 * (day + 1));
      for (Pose& pose : touches.T_robot_sensor) {
        pose.translation_mm.x += 0.35 * static_cast<double>(day) - 0.35;
      }
      const std::string name = letter + std::to_string(day) + ".h5";
      write_recording(folder_ / name, touches);
      of_recordings.push_back(name);
      touches.object = std::string(letter) + "@day" + std::to_string(day);
      write_recording(folder_ / ("of_" + name), touches);
      of_labels.push_back("of_" + name);
    }
  }
  const auto map = [&](Arguments arguments, const std::string& folder, const Arguments& flags) {
    arguments.insert(arguments.end(), {"-o", folder + "/"});
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    done(arguments);
    return *read_map(folder_ / folder / "A.map.h5").source;
  };
  const auto learned_mm = [&](const std::string& folder) {
    return read_sensor_model(sensor(folder)).pose_scale.value().map_sd_mm;
  };
  EXPECT_LT(map(of_recordings, "alone", {}).pose_scale->map_sd_mm, 0.15);
  EXPECT_LT(learned_mm("alone"), 0.15);
  const MapSource of_days = map(of_labels, "days", {"--group", "label"});
  EXPECT_GT(of_days.pose_scale->map_sd_mm, 0.2);
  EXPECT_GT(learned_mm("days"), 0.2);
  EXPECT_EQ(of_days.groups.front(), "day0");
  const MapSource of_files =
      map(of_recordings, "files", {"--group", "recording", "--sensor-model", "none"});
  EXPECT_EQ(of_files.pose_scale->map_sd_mm, of_days.pose_scale->map_sd_mm);
  EXPECT_EQ(of_files.groups.front(), "A0.h5");

  expect_refused({"map", "A0.h5", "A1.h5", "-o", "new/", "--group", "label"},
                 {"A0.h5", "'A'", "LABEL@GROUP", "--group recording"});
  expect_refused({"map", "A0.h5", "A1.h5", "U0.h5", "-o", "new/", "--group", "recording"},
                 {"--group recording", "'U'", "'U0.h5'", "two groups or more"});
}

TEST_F(MapSensor, OfEarlierMapsIsSaidToStay) {
  done({"map", "A.h5", "U.h5", "-o", "maps/"});
  const Outcome outcome = palpate({"map", "A.h5", "-o", "maps/", "--sensor-model", "none"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.err.find("maps/sensor.yaml: stays, and was learned for earlier maps"),
            std::string::npos)
      << outcome.err;
  EXPECT_TRUE(std::filesystem::exists(sensor("maps")));
}

TEST_F(MapSensor, OfAnotherHandStays) {
  std::filesystem::create_directory(folder_ / "maps");
  for (const std::string& text :
       {std::string("format: palpate.sensor_model\n"), std::string("x")}) {
    put_bytes(sensor("maps"), text);
    const Outcome outcome = palpate({"map", "A.h5", "U.h5", "-o", "maps/"});
    EXPECT_EQ(outcome.status, 0);
    EXPECT_NE(outcome.err.find("maps/sensor.yaml: was not written by palpate map, and stays"),
              std::string::npos)
        << outcome.err;
    const Outcome recognised = palpate({"recognize", "u.h5", "--maps", "maps", "--touches=1"});
    EXPECT_EQ(recognised.status, text == "x" ? 2 : 0) << recognised.err;
    EXPECT_EQ(outcome.err.find("refuses it until it is mended or moved") != std::string::npos,
              text == "x")
        << outcome.err;
    EXPECT_EQ(bytes_of(sensor("maps")), text);
  }
}

}  // namespace palpate::map_sensor_test
