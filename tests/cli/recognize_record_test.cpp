// The records that other programs rely on: which keys, and what their values mean.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "palpate/pose_error.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::recognize_record_test {

using nlohmann::json;

const Pose true_pose{{2.0, -3.0}, 1.0};

class RecognizeRecord : public ProgramTest {
 protected:
  RecognizeRecord() {
    write_map(folder_ / "A.map.h5", sample_map("A"));
    write_map(folder_ / "I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", true_pose, 6));
  }
};

Pose pose_of(const json& mode) {
  return {{mode.at("x_mm").get<double>(), mode.at("y_mm").get<double>()},
          mode.at("theta_rad").get<double>()};
}

std::vector<std::string> keys_of(const json& object) {
  std::vector<std::string> keys;
  for (const auto& item : object.items()) {
    keys.push_back(item.key());
  }
  return keys;  // in alphabetical order
}

TEST_F(RecognizeRecord, HasTheDocumentedKeysAndTypes) {
  const json r = record({"u.h5", "--maps", "A.map.h5", "I.map.h5"});
  // By bounds, as the automatic bins are many.
  EXPECT_EQ(keys_of(r), (std::vector<std::string>{"T_robot_object",
                                                  "best",
                                                  "bins_evaluated",
                                                  "blocks_bounded",
                                                  "decision",
                                                  "device",
                                                  "dropped_mass",
                                                  "error_mm",
                                                  "fit",
                                                  "identity",
                                                  "identity_bounds",
                                                  "mode",
                                                  "mode_certain",
                                                  "modes",
                                                  "none",
                                                  "recording",
                                                  "refined",
                                                  "refined_error_mm",
                                                  "right",
                                                  "seconds",
                                                  "touch_fit",
                                                  "touches",
                                                  "truth"}));
  EXPECT_EQ(r["recording"], "u.h5");
  EXPECT_EQ(r["touches"], 6);
  EXPECT_TRUE(r["touches"].is_number_integer());
  EXPECT_EQ(r["best"], "A");
  EXPECT_EQ(keys_of(r["identity"]), (std::vector<std::string>{"(none)", "A", "I"}));
  EXPECT_NEAR(
      r["identity"]["A"].get<double>() + r["identity"]["I"].get<double>() + r["none"].get<double>(),
      1.0, 1e-12);  // rounding of three doubles
  const json& mode = r["mode"];
  EXPECT_EQ(keys_of(mode), (std::vector<std::string>{"log_likelihood", "map", "object", "theta_rad",
                                                     "x_mm", "y_mm"}));
  EXPECT_EQ(mode["object"], "A");
  EXPECT_EQ(mode["map"], "A.map.h5");
  EXPECT_LT(mode["log_likelihood"].get<double>(), 0.0);
  ASSERT_EQ(r["T_robot_object"].size(), 3u);
  EXPECT_TRUE(r["right"].is_boolean());
  EXPECT_TRUE(r["right"]);
  EXPECT_TRUE(r["error_mm"].is_number());
  EXPECT_TRUE(r["refined_error_mm"].is_number());
  const json& refined = r["refined"];
  EXPECT_EQ(keys_of(refined), (std::vector<std::string>{"T_robot_object", "covariance", "sd",
                                                        "share", "theta_rad", "x_mm", "y_mm"}));
  EXPECT_EQ(refined["T_robot_object"].size(), 3u);
  EXPECT_EQ(refined["sd"].size(), 3u);
  EXPECT_EQ(keys_of(r["truth"]), (std::vector<std::string>{"T_robot_object", "object"}));
  EXPECT_EQ(r["truth"]["object"], "A");
  ASSERT_EQ(refined["covariance"].size(), 3u);
  for (std::size_t row = 0; row < 3; ++row) {
    ASSERT_EQ(refined["covariance"][row].size(), 3u);
    EXPECT_GT(refined["covariance"][row][row].get<double>(), 0.0);
    EXPECT_EQ(refined["covariance"][row][0], refined["covariance"][0][row]);
  }
  EXPECT_GT(r["seconds"].get<double>(), 0.0);
  EXPECT_EQ(r["device"], "none") << "bounds search on the host";
  EXPECT_EQ(
      record({"u.h5", "--maps", "A.map.h5", "--filter", "bounded", "--device", "0"})["device"],
      "none")
      << "also where one is named";
  const json named = record({"u.h5", "--maps", "A.map.h5", "--bins=5x5x4"});
  EXPECT_NE(done({"devices"}).find(named["device"].get<std::string>()), std::string::npos);
}

TEST_F(RecognizeRecord, ModeIsNearTheTruth) {
  const json r = record({"u.h5", "--maps", "A.map.h5", "I.map.h5", "--bins", "25x25x48"});
  // A letter's J is some 60 mm^2: half a bin of 0.8 mm along x and y and of 7.5 degrees, doubled
  // because noise may favour a neighbour, is 2 sqrt(0.4^2 + 0.4^2 + 60 (3.75 deg)^2) = 1.5 mm.
  EXPECT_LT(r["error_mm"].get<double>(), 1.5);
  const Pose T_object_robot = pose_of(r["mode"]);
  EXPECT_NEAR(T_object_robot.theta_rad, true_pose.theta_rad, 2 * std::numbers::pi / 48);
}

TEST_F(RecognizeRecord, RefinedPoseLiesBetweenTheBins) {
  const json r = record({"u.h5", "--maps", "A.map.h5", "I.map.h5", "--bins", "64x64x244"});
  const Pose mode = pose_of(r["mode"]);
  const Pose refined = pose_of(r["refined"]);
  EXPECT_NE(refined.translation_mm.x, mode.translation_mm.x);
  EXPECT_LT(std::abs(refined.translation_mm.x - mode.translation_mm.x), 1.0) << "some bins";
  // The error is that of the pose: its body moves by as much.
  const OccupancyGrid map = sample_map("A");
  EXPECT_NEAR(r["refined_error_mm"].get<double>(),
              pose_error_mm(body_of(map), map.symmetry, refined, true_pose), 1e-9);
  EXPECT_LT(r["refined_error_mm"].get<double>(), 0.6) << "two bins";
}

TEST_F(RecognizeRecord, RobotPoseIsTheInverse) {
  const json r = record({"u.h5", "--maps", "A.map.h5"});
  const std::vector<double> inverted = r["T_robot_object"];
  const Pose identity = pose_of(r["mode"]) * Pose{{inverted[0], inverted[1]}, inverted[2]};
  EXPECT_NEAR(identity.translation_mm.x, 0.0, 1e-12);  // rounding
  EXPECT_NEAR(identity.translation_mm.y, 0.0, 1e-12);
  EXPECT_NEAR(wrap_angle(identity.theta_rad, 2 * std::numbers::pi), 0.0, 1e-12);
}

TEST_F(RecognizeRecord, RefinedRobotPoseIsTheInverseAndNearTheTruth) {
  const json r = record({"u.h5", "--maps", "A.map.h5", "--bins", "50x50x90"});
  const std::vector<double> pose = r["refined"]["T_robot_object"];
  const std::vector<double> sd = r["refined"]["sd"];
  const std::vector<double> truth = r["truth"]["T_robot_object"];
  const Pose identity = pose_of(r["refined"]) * Pose{{pose[0], pose[1]}, pose[2]};
  EXPECT_NEAR(identity.translation_mm.x, 0.0, 1e-12);  // rounding
  EXPECT_NEAR(identity.translation_mm.y, 0.0, 1e-12);
  EXPECT_NEAR(wrap_angle(identity.theta_rad, 2 * std::numbers::pi), 0.0, 1e-12);
  EXPECT_GE(pose[2], -std::numbers::pi);
  EXPECT_LT(pose[2], std::numbers::pi);
  for (std::size_t i = 0; i < 3; ++i) {
    // Deviations of a bin's own width at least; four of them miss the truth once in 16,000.
    EXPECT_GE(sd[i], (i < 2 ? 0.4 : 2 * std::numbers::pi / 90) / std::sqrt(12.0) * 0.9) << i;
    EXPECT_NEAR(pose[i], truth[i], 4 * sd[i]) << i;
  }
}

TEST_F(RecognizeRecord, PrintsThePoseOfItsJson) {
  const std::vector<std::string> call{"u.h5", "--maps", "A.map.h5", "I.map.h5"};
  const json r = record(call);
  std::vector<std::string> shown = call;
  shown.insert(shown.begin(), "recognize");
  const std::string out = done(shown);
  EXPECT_TRUE(out.starts_with("u.h5: do not act: ")) << out;
  EXPECT_NE(out.find("\nrecording  touches  best    prob. "), std::string::npos) << out;
  const std::vector<double> pose = r["refined"]["T_robot_object"];
  const std::vector<double> sd = r["refined"]["sd"];
  for (std::size_t i = 0; i < 3; ++i) {
    const double unit = i < 2 ? 1.0 : 180.0 / std::numbers::pi;
    const std::string cell = fmt::format(" {:.2f}+-{:.2f}", pose[i] * unit, sd[i] * unit);
    EXPECT_NE(out.find(cell), std::string::npos) << cell << " not in\n" << out;
  }
  EXPECT_NE(out.find(fmt::format("  {:.2f} mm off\n", r["refined_error_mm"].get<double>())),
            std::string::npos)
      << out;
}

TEST_F(RecognizeRecord, SaysHowTheDeviceWorksOnlyWhereAskedTo) {
  const std::vector<std::string> call{"recognize", "u.h5", "--maps", "A.map.h5", "--bins=25x25x16"};
  const std::string out = done(call);  // nothing on standard error
  EXPECT_NE(out.find("1 map, 25 x 25 x 16 bins each, on "), std::string::npos) << out;
  EXPECT_EQ(out.find("tiles"), std::string::npos) << out;
  std::vector<std::string> verbose = call;
  verbose.emplace_back("--verbose");
  const Outcome outcome = palpate(verbose);
  EXPECT_EQ(outcome.status, 0);
  for (const char* part : {"device: ", " MiB", "filter: histogram in ", "lattice: x -10 to 10 mm",
                           "pivot 0, 0 mm", "seconds: "}) {
    EXPECT_NE(outcome.err.find(part), std::string::npos) << part << " not in\n" << outcome.err;
  }
  EXPECT_EQ(outcome.out, out);
}

TEST_F(RecognizeRecord, WithoutATruthNothingIsRight) {
  Recording recording = sample_unknown("A", true_pose, 3);
  recording.truth.reset();
  write_recording(folder_ / "u.h5", recording);
  const json r = record({"u.h5", "--maps", "A.map.h5"});
  EXPECT_FALSE(r.contains("right"));
  EXPECT_FALSE(r.contains("error_mm"));
  EXPECT_FALSE(r.contains("refined_error_mm"));
  EXPECT_FALSE(r.contains("truth"));
}

TEST_F(RecognizeRecord, AWrongObjectHasNoPoseError) {
  const json r = record({"u.h5", "--maps", "I.map.h5", "--none", "0"});
  EXPECT_EQ(r["right"], false);
  EXPECT_TRUE(r["error_mm"].is_null());
  EXPECT_TRUE(r["refined_error_mm"].is_null());
}

TEST_F(RecognizeRecord, ALabelWithoutAPoseIsRightWithoutAPoseError) {
  write_recording(folder_ / "known.h5", sample_training("A", 6));
  const json r = record({"known.h5", "--maps", "A.map.h5", "I.map.h5"});
  EXPECT_EQ(r["right"], true);
  EXPECT_TRUE(r["error_mm"].is_null());
}

TEST_F(RecognizeRecord, AMapWithoutAnOccupiedCellHasNoPoseError) {
  OccupancyGrid empty = sample_map("A");
  std::fill(empty.log_odds.begin(), empty.log_odds.end(), -1.0F);
  write_map(folder_ / "empty.map.h5", empty);
  EXPECT_TRUE(
      record({"u.h5", "--maps", "empty.map.h5", "--bins", "10x10x8"})["error_mm"].is_null());
}

TEST_F(RecognizeRecord, TraceTellsTheSameAfterEveryTouch) {
  const json whole = record({"u.h5", "--maps", "A.map.h5", "I.map.h5", "--trace"});
  ASSERT_EQ(whole["trace"].size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    json step = whole["trace"][i];
    if (step["best"] == "(none)") {
      step.erase("warnings");  // of what else may explain touches of no object
    }
    EXPECT_EQ(keys_of(step), (std::vector<std::string>{
                                 "T_robot_object", "best", "bins_evaluated", "blocks_bounded",
                                 "decision", "dropped_mass", "error_mm", "fit", "identity",
                                 "identity_bounds", "mode", "mode_certain", "modes", "none",
                                 "refined", "refined_error_mm", "right", "touch_fit"}));
    const json r =
        record({"u.h5", "--maps", "A.map.h5", "I.map.h5", "--touches", std::to_string(i + 1)});
    for (const char* key : {"best", "T_robot_object", "right", "error_mm"}) {
      EXPECT_EQ(step[key], r[key]) << key << " after touch " << i + 1;
    }
    // Two floats per bin, added in another order; see PoseHistogram.
    EXPECT_NEAR(step["mode"]["log_likelihood"].get<double>(),
                r["mode"]["log_likelihood"].get<double>(), 1e-4);
    EXPECT_NEAR(step["identity"]["A"].get<double>(), r["identity"]["A"].get<double>(), 1e-4);
  }
  EXPECT_EQ(whole["trace"].back()["mode"], whole["mode"]);
  EXPECT_EQ(whole["trace"].back()["identity"], whole["identity"]);
}

TEST_F(RecognizeRecord, EachFrameIsAnUnknownOfItsOwn) {
  const json all =
      records({"u.h5", "--maps", "A.map.h5", "I.map.h5", "--each-frame", "--frames", "2:5"});
  ASSERT_EQ(all.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(all[i]["frame"], i + 2) << "the index in the file";
    EXPECT_EQ(all[i]["touches"], 1);
    const std::string frames = std::to_string(i + 2) + ":" + std::to_string(i + 3);
    const json alone = record({"u.h5", "--maps", "A.map.h5", "I.map.h5", "--frames", frames});
    EXPECT_EQ(all[i]["mode"], alone["mode"]);
    EXPECT_EQ(all[i]["identity"], alone["identity"]);
    EXPECT_FALSE(alone.contains("frame"));
  }
}

TEST_F(RecognizeRecord, RecordingsAreUnknownsOfTheirOwnInTheirOrder) {
  write_recording(folder_ / "i.h5", sample_unknown("I", true_pose, 6));
  const json all = records({"i.h5", "u.h5", "--maps", "A.map.h5", "I.map.h5", "--none", "0"});
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0]["recording"], "i.h5");
  EXPECT_EQ(all[0]["best"], "I");
  EXPECT_EQ(all[1]["recording"], "u.h5");
  EXPECT_EQ(all[1]["best"], "A");
  EXPECT_EQ(all[1]["mode"], record({"u.h5", "--maps", "A.map.h5", "I.map.h5"})["mode"])
      << "the first unknown must not colour the second";
}

TEST_F(RecognizeRecord, MapsOfOneLabelAddUp) {
  const std::vector<std::string> one_touch{"--frames", "0:1", "--bins", "9x9x8"};
  const auto recognized = [&](std::vector<std::string> maps) {
    maps.insert(maps.begin(), {"u.h5", "--maps"});
    maps.insert(maps.end(), one_touch.begin(), one_touch.end());
    return record(maps)["identity"];
  };
  OccupancyGrid second = sample_map("E");
  write_map(folder_ / "E.map.h5", second);
  const json apart = recognized({"A.map.h5", "E.map.h5", "I.map.h5"});
  second.label = "A";
  write_map(folder_ / "E.map.h5", second);
  const json together = recognized({"A.map.h5", "E.map.h5", "I.map.h5"});
  EXPECT_EQ(keys_of(together), (std::vector<std::string>{"A", "I"}))
      << "no object fits such wide bins, and all would be strangers";
  EXPECT_GT(apart["E"].get<double>(), 1e-3) << "one touch leaves all three possible";
  EXPECT_NEAR(together["A"].get<double>(), apart["A"].get<double>() + apart["E"].get<double>(),
              1e-12);  // rounding
}

TEST_F(RecognizeRecord, BestIsTheLargestSumThoughTheModeBeAnother) {
  // Two equal maps named B share what one named A has alone: their sum wins, the mode may not.
  for (const char* name : {"b1.map.h5", "b2.map.h5"}) {
    OccupancyGrid copy = sample_map("A");
    copy.label = "B";
    write_map(folder_ / name, copy);
  }
  const json r = record({"u.h5", "--maps", "A.map.h5", "b1.map.h5", "b2.map.h5", "--none", "0"});
  EXPECT_NEAR(r["identity"]["B"].get<double>(), 2.0 / 3.0, 1e-9);  // rounding
  EXPECT_EQ(r["best"], "B");
  EXPECT_EQ(r["mode"]["object"], "A") << "ties go to the first object";
  EXPECT_EQ(r["right"], false);
}

TEST_F(RecognizeRecord, FileHoldsWhatStandardOutputWould) {
  json printed = records({"u.h5", "--maps", "A.map.h5", "--trace"});
  const std::string out =
      done({"recognize", "u.h5", "--maps", "A.map.h5", "--trace", "--json", "r.json"});
  json stored = json::parse(bytes_of(folder_ / "r.json"));
  for (json* list : {&printed, &stored}) {
    list->at(0).erase("seconds");
  }
  EXPECT_EQ(printed, stored);
  EXPECT_NE(out.find("1 of 1 right"), std::string::npos) << out;
}

TEST_F(RecognizeRecord, AFileNameThatIsNotUtf8StillGivesJson) {
  const std::string name = "u\xff.h5";
  std::filesystem::rename(folder_ / "u.h5", folder_ / name);
  EXPECT_EQ(record({name, "--maps", "A.map.h5"})["recording"], "u\xef\xbf\xbd.h5");
}

TEST_F(RecognizeRecord, PosteriorIsTheRecordsSource) {
  const json r = record({"u.h5", "--maps", "I.map.h5", "A.map.h5", "--touches", "2", "--bins",
                         "7x6x5", "--posterior", "p.h5", "--none", "0"});
  const Posterior p = read_posterior(folder_ / "p.h5");
  EXPECT_EQ(p.objects, (std::vector<std::string>{"I", "A"}));
  EXPECT_EQ(p.lattice.x_mm.count, 7);
  EXPECT_EQ(p.lattice.y_mm.count, 6);
  EXPECT_EQ(p.lattice.theta_rad.count, 5);
  EXPECT_EQ(p.lattice.x_mm.lower, -10.0);
  EXPECT_EQ(p.lattice.theta_rad.upper, 2 * std::numbers::pi);
  const auto bins = static_cast<std::size_t>(p.lattice.bins());
  ASSERT_EQ(p.log_likelihood.size(), 2 * bins);
  const auto most = std::max_element(p.log_likelihood.begin(), p.log_likelihood.end());
  const auto index = static_cast<std::size_t>(most - p.log_likelihood.begin());
  EXPECT_EQ(r["mode"]["object"], p.objects[index / bins]);
  const Pose T_object_robot = p.lattice.T_object_robot(static_cast<std::int64_t>(index % bins));
  EXPECT_DOUBLE_EQ(r["mode"]["x_mm"].get<double>(), T_object_robot.translation_mm.x);
  EXPECT_DOUBLE_EQ(r["mode"]["y_mm"].get<double>(), T_object_robot.translation_mm.y);
  EXPECT_DOUBLE_EQ(r["mode"]["theta_rad"].get<double>(), T_object_robot.theta_rad);
  EXPECT_DOUBLE_EQ(r["mode"]["log_likelihood"].get<double>(), *most);
  double mass[2] = {};
  for (std::size_t k = 0; k < p.log_likelihood.size(); ++k) {
    mass[k / bins] += std::exp(p.log_likelihood[k] - *most);
  }
  // The device sums in floats.
  EXPECT_NEAR(r["identity"]["A"].get<double>(), mass[1] / (mass[0] + mass[1]), 1e-5);
}

TEST_F(RecognizeRecord, TheSameCallGivesTheSameRecord) {
  json first = record({"u.h5", "--maps", "A.map.h5", "I.map.h5", "--trace"});
  json second = record({"u.h5", "--maps", "A.map.h5", "I.map.h5", "--trace"});
  first.erase("seconds");
  second.erase("seconds");
  EXPECT_EQ(first, second);
}

}  // namespace palpate::recognize_record_test
