// A sensor model in recognition, and objects that may lie on their other side.

#include <cmath>
#include <optional>

#include <fmt/ranges.h>

#include "palpate/learned_sensor.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::sensor_model_flag_test {

using nlohmann::json;
using Arguments = std::vector<std::string>;

/// A table that holds Eq. 7 at its nodes.
LearnedTable table_of_equation_7() {
  const ContactModel model{.gamma = 0.1, .prior = 0.2};
  LearnedTable table;
  for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
    for (int i = 0; i < ReadingLayer::nodes; ++i) {
      // What was never sensed is as likely as the prior.
      const double l = ReadingLayer::first_node + 0.5 * i;
      const double log_odds = l < -8.0 ? log_odds_from_probability(*model.prior) : l;
      table.shared.push_back(model.log_likelihood(reading, {log_odds}));
    }
  }
  return table;
}

class SensorModelFlag : public ProgramTest {
 protected:
  SensorModelFlag() {
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/R.map.h5", sample_map("R"));
    write_map(folder_ / "maps/U.map.h5", sample_map("U"));
    write_recording(folder_ / "u.h5", sample_unknown("R", {{2.0, -3.0}, 1.0}, 6));
  }

  void write(const LearnedSensor& sensor) const { write_sensor_model(folder_ / "s.yaml", sensor); }
  static Arguments with(Arguments flags) {
    flags.insert(flags.begin(), {"recognize", "u.h5", "--maps", "maps", "--bins", "15x15x12"});
    return flags;
  }
  json plain(Arguments flags) const {
    // On bins so wide the touches seem to share no pose.
    flags.insert(flags.begin(), {"u.h5", "--maps", "maps", "--bins", "15x15x12"});
    flags.insert(flags.end(), {"--none", "0"});
    json r = record(flags);
    r.erase("seconds");
    r.erase("sensor_model");
    return r;
  }
  json learned(Arguments flags = {}) const {
    flags.insert(flags.end(), {"--sensor-model", "s.yaml"});
    return plain(flags);
  }
  json in_scene(const std::string& keys, Arguments flags = {}) const {
    put_bytes(folder_ / "maps/scene.yaml", keys);
    flags.insert(flags.end(), {"--scene", "maps/scene.yaml"});
    return plain(flags);
  }
};

TEST_F(SensorModelFlag, GivesTheDefaultsOfFlags) {
  write({.classifier = {.threshold = 5.0, .ratio = 0.6},
         .gamma = 0.3,
         .touch_sd = {.mm = 1.0, .rad = 0.0}});
  const std::string by = "--filter=bounded";  // which needs no device
  const json wanted = plain({by, "--threshold=5", "--ratio=0.6", "--gamma=0.3", "--touch-sd-mm=1"});
  EXPECT_EQ(learned({by}), wanted);
  EXPECT_NE(plain({by}), wanted);
  EXPECT_EQ(in_scene("sensor_model: ../s.yaml\n", {by}), wanted) << "beside the scene";
  EXPECT_EQ(learned({by, "--threshold=4", "--touch-sd-mm=0"}),
            plain({by, "--threshold=4", "--ratio=0.6", "--gamma=0.3"}));
  EXPECT_EQ(in_scene("sensor_model: ../s.yaml\nratio: 0.2\ngamma: 0.2\ntouch_sd: {mm: 2}\n", {by}),
            plain({by, "--threshold=5", "--ratio=0.2", "--gamma=0.2", "--touch-sd-mm=2"}));
  EXPECT_EQ(in_scene("sensor_model: none.yaml\n", {by, "--sensor-model", "s.yaml"}), wanted)
      << "the flag overrides the key";
}

TEST_F(SensorModelFlag, TakesTouchesForExactWhereTheFilterCannotDisplaceThem) {
  write({.touch_sd = {.mm = 1.0, .rad = 0.0}});
  const Arguments particles{"--filter=particles", "--particles=2000"};
  EXPECT_EQ(learned(particles), plain(particles));
  EXPECT_NE(learned({"--filter=bounded"}), plain({"--filter=bounded"}));
}

TEST_F(SensorModelFlag, LowersConfidenceByItsTemperature) {
  const Arguments unsure{"--touches=1"};
  const auto log_odds = [](const json& r) {
    return std::log(r["identity"]["R"].get<double>() / r["identity"]["U"].get<double>());
  };
  const json sure = plain(unsure);
  write({.temperature = 4.0});
  const json tempered = learned(unsure);
  EXPECT_NEAR(log_odds(tempered), log_odds(sure) / 4.0, 1e-9);
  EXPECT_EQ(tempered["mode"], sure["mode"]);
  for (const char* of : {"T_robot_object", "covariance"}) {
    EXPECT_EQ(tempered["refined"][of], sure["refined"][of]);
  }
  write({.temperature = 4.0, .temperature_growth = 1.0});
  EXPECT_NEAR(log_odds(learned({"--touches=2"})), log_odds(plain({"--touches=2"})) / 5.0, 1e-9);
}

TEST_F(SensorModelFlag, TakesATableInThePlaceOfEquation7) {
  write({.table = table_of_equation_7()});
  for (const char* filter : {"histogram", "bounded", "particles"}) {
    const json r = learned({"--filter", filter});
    EXPECT_EQ(r["best"], "R") << filter;
  }
  EXPECT_EQ(palpate({"plan", "u.h5", "--maps", "maps", "--candidates", "u.h5", "--samples=16",
                     "--bins=9x9x8", "--sensor-model", "s.yaml"})
                .status,
            0);
  EXPECT_EQ(palpate({"live", "--sensor", "simulate:R,rate=100,seed=3,touches=2,speed=max", "--maps",
                     "maps", "--bins=9x9x8", "--sensor-model", "s.yaml"})
                .status,
            0);
}

TEST_F(SensorModelFlag, TellsStrangersByHowBadlyTheyFit) {
  const auto none = [&](const FitScale& scale, const char* touches) {
    write({.fit_scale = scale});
    return record({"u.h5", "--maps", "maps", touches, "--sensor-model",
                   "s.yaml"})["identity"]["(none)"]
        .get<double>();
  };
  const auto of_two = [&](std::optional<double> stranger_sd) {
    return none({.shared_sd = 0.1, .stranger_sd = stranger_sd}, "--touches=2");
  };
  EXPECT_GT(of_two(1.0), of_two(8.0)) << "the touches fit well";
  EXPECT_EQ(of_two({}), of_two(4.0));
  const auto of_one = [&](std::optional<SingleFitScale> alone) {
    return none({.shared_sd = 0.1, .stranger_alone = alone}, "--touches=1");
  };
  EXPECT_LT(of_one(SingleFitScale{-8.0, 2.0}), 0.5 * of_one({})) << "the touch fits well";
}

TEST_F(SensorModelFlag, SaysWhereBinsAreWiderThanItsOwn) {
  const auto said = [&](const Arguments& command, const std::string& bins) {
    Arguments arguments = command;
    arguments.insert(arguments.end(), {"--maps=maps", "--sensor-model=s.yaml", "--bins=" + bins});
    const Outcome outcome = palpate(arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.err;
  };
  const Arguments recognize{"recognize", "u.h5", "--filter=bounded"};
  const Arguments with_device{"batch", "u.h5", "-o", "d", "--filter=histogram"};
  const Arguments on_host{"batch", "u.h5", "-o", "h", "--filter=bounded"};
  write({.bins = BinSteps{1.0, 1.0, 0.5}});
  for (const Arguments& command : {recognize, with_device, on_host}) {
    SCOPED_TRACE(fmt::format("{}", fmt::join(command, " ")));
    EXPECT_NE(said(command, "10x10x15").find("calibrate with --bins 10x10x15"), std::string::npos);
  }
  std::filesystem::remove_all(folder_ / "d");
  std::filesystem::remove_all(folder_ / "h");
  for (const Arguments& command : {recognize, with_device, on_host}) {
    SCOPED_TRACE(fmt::format("{}", fmt::join(command, " ")));
    EXPECT_EQ(said(command, "20x20x15"), "");
  }
}

TEST_F(SensorModelFlag, IsRefusedInOneLine) {
  expect_refused(with({"--sensor-model", "no.yaml"}), {"no.yaml", "no such file"});
  expect_refused(with({"--sensor-model", "u.h5"}),
                 {"u.h5", "is a recording or another HDF5 file, and no sensor model"});
  write({.pressure_unit = "raw"});
  expect_refused(with({"--sensor-model", "s.yaml"}), {"s.yaml", "pressure_unit = raw", "kPa"});
  write({.table = table_of_equation_7()});
  const Arguments model{"--sensor-model", "s.yaml"};
  for (const char* flag : {"--gamma", "--prior"}) {
    expect_refused(with({"--sensor-model", "s.yaml", flag, "0.1"}),
                   {flag, "the table of s.yaml takes its place"});
  }
  for (const std::string key : {"gamma", "prior"}) {
    put_bytes(folder_ / "scene.yaml", "sensor_model: s.yaml\n" + key + ": 0.1\n");
    expect_refused(with({"--scene", "scene.yaml"}), {"scene.yaml: " + key, "takes its place"});
  }
  expect_refused(with({"--sensor-model", "s.yaml", "--json", "s.yaml"}),
                 {"--json s.yaml", "--sensor-model reads"});
  LearnedTable of_levels = table_of_equation_7();
  of_levels.layer.of = MapLayer::mean_level;
  write({.table = of_levels});
  expect_refused(with({"--sensor-model", "s.yaml"}), {"map 'R'", "no mean level"});
}

TEST_F(SensorModelFlag, MirroredObjectsAreFound) {
  const json usual = plain({"--filter=bounded"});
  EXPECT_FALSE(usual["mode"].contains("mirrored"));
  const Arguments region{"u.h5",       "--bins", "15x15x12", "--scene",
                         "scene.yaml", "--none", "0",        "--filter=bounded"};
  put_bytes(folder_ / "scene.yaml",
            "objects: [{map: maps/R.map.h5, mirror: true}, {map: maps/U.map.h5}]\n");
  const json same = record(region);
  EXPECT_EQ(same["best"], "R");
  EXPECT_EQ(same["mode"]["mirrored"], false);
  EXPECT_EQ(same["mode"]["x_mm"], usual["mode"]["x_mm"]);
  EXPECT_EQ(same["error_mm"], usual["error_mm"]);

  // The map of the mirrored R: the unknown is its mirror image.
  OccupancyGrid map = mirror_image(sample_map("R"));
  map.mirror = true;
  write_map(folder_ / "maps/R.map.h5", map);
  const json mirrored = plain({"--filter=bounded"});
  EXPECT_EQ(mirrored["mode"]["mirrored"], true);
  EXPECT_EQ(mirrored["mode"]["map"], "maps/R.map.h5");
  EXPECT_EQ(mirrored["mode"]["x_mm"], usual["mode"]["x_mm"]);
  EXPECT_EQ(mirrored["right"], true);
  EXPECT_TRUE(mirrored["error_mm"].is_null());
  const Outcome table = palpate(with({"--png", "sheets"}));
  EXPECT_NE(table.out.find("R mirrored"), std::string::npos) << table.out << table.err;
  EXPECT_NE(table.out.find("2 maps and 1 mirrored"), std::string::npos) << table.out;

  put_bytes(folder_ / "scene.yaml",
            "objects: [{map: maps/R.map.h5, mirror: false}, {map: maps/U.map.h5}]\n");
  EXPECT_FALSE(record(region)["mode"].contains("mirrored"));
}

}  // namespace palpate::sensor_model_flag_test
