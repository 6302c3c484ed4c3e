#include <algorithm>
#include <cmath>
#include <sstream>

#include <fmt/format.h>

#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::plan_test {

using nlohmann::json;

class PlanCommand : public ProgramTest {
 protected:
  PlanCommand() {
    std::filesystem::create_directory(folder_ / "maps");
    write_map(folder_ / "maps/A.map.h5", sample_map("A"));
    write_map(folder_ / "maps/I.map.h5", sample_map("I"));
    write_recording(folder_ / "u.h5", sample_unknown("A", {{2.0, -3.0}, 1.0}, 6));
    put_bytes(folder_ / "c.csv",
              "x_mm,y_mm,theta_deg\n400,400,0\n0,0,0\n3,-2,45\n-5,4,90\n6,6,135\n");
  }

  std::vector<std::string> command(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"plan", "u.h5", "--maps", "maps", "--bins=15x15x24"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    if (std::ranges::find(more, "--touches=1") == more.end()) {
      arguments.emplace_back("--touches=2");
    }
    if (std::ranges::find(more, "--filter") == more.end()) {
      arguments.emplace_back("--filter=bounded");  // which needs no device
    }
    return arguments;
  }
  json plan(std::vector<std::string> more) const {
    more.insert(more.end(), {"--json", "-"});
    return json::parse(done(command(more)));
  }
};

TEST_F(PlanCommand, ItsHelpListsNoFlagThatItRefuses) {
  const std::string help = done({"plan", "--help"});
  for (const std::string flag : {"--particles", "--resampling", "--augmented", "--seed"}) {
    EXPECT_EQ(help.find("  " + flag + " "), std::string::npos) << flag;
  }
  for (const std::string flag : {"--filter", "--budget-ms"}) {
    EXPECT_NE(help.find("  " + flag + " "), std::string::npos) << flag << ", which a plan reads";
  }
}

TEST_F(PlanCommand, ByBoundsIsThatOfTheHistogram) {
  const auto plan_by = [&](const char* filter) {
    return plan({"--candidates", "c.csv", "--samples=512", "--none", "--filter", filter});
  };
  const json dense = plan_by("histogram");
  const json bounded = plan_by("bounded");
  EXPECT_TRUE(bounded["believed"].contains("dropped_mass"));
  EXPECT_FALSE(dense["believed"].contains("dropped_mass"));
  for (const char* what : {"identity", "pose", "both"}) {
    EXPECT_NEAR(bounded["believed"]["entropy"][what].get<double>(),
                dense["believed"]["entropy"][what].get<double>(), 1e-3);
  }
  const auto gain_of = [](const json& of, int index) {
    for (const json& candidate : of["candidates"]) {
      if (candidate["index"] == index) {
        return candidate["gain"];
      }
    }
    return json();
  };
  for (int index = 0; index < 5; ++index) {
    const json ours = gain_of(bounded, index);
    const json theirs = gain_of(dense, index);
    for (const char* what : {"identity", "pose"}) {
      // Draws of beliefs that are the same; their standard errors leave the drawing out.
      EXPECT_NEAR(ours[what].get<double>(), theirs[what].get<double>(),
                  6.0 * theirs["standard_error"][what].get<double>() + 0.02)
          << index << " " << what;
    }
  }
}

TEST_F(PlanCommand, RanksTheRowsOfATable) {
  const json all = plan({"--candidates", "c.csv"});
  EXPECT_EQ(all["goal"], "both");
  EXPECT_EQ(all["touches"], 2);
  EXPECT_EQ(all["believed"]["best"], "A");
  const json& entropy = all["believed"]["entropy"];
  EXPECT_NEAR(entropy["identity"].get<double>() + entropy["pose"].get<double>(),
              entropy["both"].get<double>(), 1e-12);
  const json& ranked = all["candidates"];
  ASSERT_EQ(ranked.size(), 5U);
  double before = 1e9;
  for (const json& candidate : ranked) {
    const json& gain = candidate["gain"];
    EXPECT_LE(gain["both"].get<double>(), before);
    before = gain["both"];
    EXPECT_NEAR(gain["identity"].get<double>() + gain["pose"].get<double>(), before, 1e-12);
    for (const char* part : {"identity", "pose", "both"}) {
      EXPECT_GE(gain[part].get<double>(), 0.0);
      EXPECT_GE(gain["standard_error"][part].get<double>(), 0.0);
      EXPECT_LT(gain["standard_error"][part].get<double>(), 0.3);
    }
  }
  // The touch 400 mm away tells nothing.
  EXPECT_EQ(ranked.back()["index"], 0);
  EXPECT_NEAR(before, 0.0, 1e-4);
  EXPECT_GT(ranked.front()["gain"]["both"].get<double>(), 0.5);
  for (const json& candidate : ranked) {
    if (candidate["index"] == 2) {
      EXPECT_EQ(candidate["x_mm"], 3.0);
      EXPECT_EQ(candidate["y_mm"], -2.0);
      EXPECT_NEAR(candidate["theta_rad"].get<double>(), std::acos(-1.0) / 4.0, 1e-12);
    }
  }
}

TEST_F(PlanCommand, IsReproducibleBySeed) {
  const auto gains = [&](const std::string& seed) {
    return plan({"--candidates", "c.csv", "--plan-seed", seed})["candidates"];
  };
  const json once = gains("3");
  EXPECT_EQ(gains("3"), once);
  EXPECT_NE(gains("4"), once);
}

TEST_F(PlanCommand, ARecordingsTouchesAreCandidatesToo) {
  const json ranked = plan({"--candidates", "u.h5"})["candidates"];
  EXPECT_EQ(ranked.size(), 6U);
}

TEST_F(PlanCommand, TheGridLiesAboutTheObject) {
  const json ranked = plan({"--candidates", "grid", "--goal", "pose"})["candidates"];
  EXPECT_GE(ranked.size(), 100U);
  EXPECT_LE(ranked.size(), 300U);
  double before = 1e9;
  for (const json& candidate : ranked) {
    EXPECT_LE(candidate["gain"]["pose"].get<double>(), before);
    before = candidate["gain"]["pose"];
    // A letter of 25 mm about 4 mm from the robot's origin.
    EXPECT_LT(std::hypot(candidate["x_mm"].get<double>(), candidate["y_mm"].get<double>()), 40.0);
  }
}

TEST_F(PlanCommand, PrintsTheTenBest) {
  const std::string out = done(command({"--candidates", "grid"}));
  EXPECT_NE(out.find("touch next at x "), std::string::npos) << out;
  EXPECT_NE(out.find("gain nats"), std::string::npos) << out;
  EXPECT_EQ(std::ranges::count(out.substr(out.find("rank")), '+'), 11) << "standard errors\n"
                                                                       << out;
  EXPECT_NE(out.find("\n  10  "), std::string::npos) << out;
  EXPECT_EQ(out.find("\n  11  "), std::string::npos) << out;
}

TEST_F(PlanCommand, SaysWhatRecognizeSaysOfTheTouches) {
  const std::vector<std::string> few{"u.h5", "--maps", "maps", "--bins=6x6x4"};
  const json record = this->record(few);
  ASSERT_TRUE(record.contains("warnings"));
  std::vector<std::string> with = few;
  with.insert(with.begin(), "plan");
  with.insert(with.end(), {"--candidates", "c.csv"});
  const std::string out = done(with);
  const std::string because = record["decision"]["because"];
  EXPECT_TRUE(out.starts_with("do not act: " + because)) << out;
  for (const json& warning : record["warnings"]) {
    EXPECT_NE(out.find("u.h5: " + warning.get<std::string>()), std::string::npos) << out;
  }
  with.insert(with.end(), {"--json", "-"});
  const json all = json::parse(done(with))["warnings"];
  for (const json& warning : record["warnings"]) {
    EXPECT_NE(std::ranges::find(all, warning), all.end()) << all;
  }
}

TEST_F(PlanCommand, SaysWhatLimitsTheGains) {
  const std::string few = "2 samples cannot show more than 0.69 nats";
  const std::string out = done(command({"--candidates", "c.csv", "--samples=2"}));
  EXPECT_NE(out.find(few), std::string::npos) << out;
  EXPECT_NE(plan({"--candidates", "c.csv", "--samples=2"})["warnings"].dump().find(few),
            std::string::npos);
  // Two touches leave few of these bins, which the next touch still divides.
  const std::string coarse = done(command({"--candidates", "c.csv", "--samples=512"}));
  EXPECT_NE(coarse.find("above what is unknown, which is counted in bins"), std::string::npos)
      << coarse;
  put_bytes(folder_ / "far.csv", "x_mm,y_mm,theta_deg\n400,400,0\n");
  const std::string plain = done(command({"--candidates", "far.csv"}));
  EXPECT_EQ(plain.find("the best gain"), std::string::npos) << plain;
  EXPECT_NE(plain.find("of the pose, counted in bins"), std::string::npos) << plain;
}

TEST_F(PlanCommand, RecommendsNoTouchThatTellsNothing) {
  const std::vector<std::string> one{
      "plan",        "u.h5",         "--maps", "maps/A.map.h5",  "--bins=15x15x24",
      "--touches=2", "--candidates", "c.csv",  "--goal=identity"};
  const std::string out = done(one);
  EXPECT_NE(out.find("no candidate tells anything about the identity"), std::string::npos) << out;
  EXPECT_EQ(out.find("touch next"), std::string::npos) << out;
  std::vector<std::string> to_json = one;
  to_json.insert(to_json.end(), {"--json", "-"});
  const json ranked = json::parse(done(to_json))["candidates"];
  ASSERT_EQ(ranked.size(), 5U);
  double before = 1e9;
  for (const json& candidate : ranked) {
    EXPECT_LE(candidate["gain"]["both"].get<double>(), before);
    before = candidate["gain"]["both"];
  }
  EXPECT_EQ(ranked.back()["index"], 0) << "400 mm away";
}

TEST_F(PlanCommand, ShowsTheGoalsGainOnce) {
  put_bytes(folder_ / "one.csv", "x_mm,y_mm,theta_deg\n3,-2,45\n");
  for (const std::string goal : {"identity", "pose"}) {
    const std::string out = done(command({"--candidates", "one.csv", "--goal", goal}));
    const std::size_t begin = out.find("rank");
    const std::string table = out.substr(begin, out.find("\n\n", begin) - begin);
    EXPECT_EQ(table.find(goal + " nats"), table.find(goal)) << out;
    EXPECT_EQ(table.find(goal), table.rfind(goal, table.find('\n'))) << out;
    EXPECT_NE(out.find(", 1 candidate in "), std::string::npos) << out;
  }
}

TEST_F(PlanCommand, SaysThatOneTouchCannotTell) {
  const std::string note = "one touch cannot tell";
  EXPECT_NE(done(command({"--candidates", "c.csv", "--none", "--touches=1"})).find(note),
            std::string::npos);
  EXPECT_EQ(done(command({"--candidates", "c.csv", "--none"})).find(note), std::string::npos);
}

TEST_F(PlanCommand, SaysOnceWhatTheLatticeDoesNotResolve) {
  const std::string err = palpate(command({"--candidates", "c.csv", "--touch-sd-deg", "1"})).err;
  EXPECT_NE(err.find("does not resolve touch-sd of 1 degrees"), std::string::npos) << err;
  EXPECT_EQ(err.find("does not resolve"), err.rfind("does not resolve")) << err;
  EXPECT_EQ(palpate(command({"--candidates", "c.csv"})).err, "");
}

TEST_F(PlanCommand, RefusesBadInputInOneLine) {
  const auto refuse = [&](const std::vector<std::string>& more,
                          const std::vector<std::string>& named) {
    expect_refused(command(more), named);
  };
  refuse({}, {"--candidates"});
  refuse({"--candidates", "none.csv"}, {"none.csv"});
  put_bytes(folder_ / "empty.csv", "x,y,theta\n");
  refuse({"--candidates", "empty.csv"}, {"empty.csv", "no row"});
  put_bytes(folder_ / "space.csv", "tx,ty,tz,qx,qy,qz,qw\n1,2,3,0,0,0,1\n");
  refuse({"--candidates", "space.csv"}, {"space.csv", "poses in space", "give x, y and theta"});
  put_bytes(folder_ / "wrong.csv", "x,y,angle\n1,2,3\n");
  refuse({"--candidates", "wrong.csv"}, {"wrong.csv", "'theta'", "rename its columns"});
  EXPECT_EQ(palpate(command({"--candidates", "wrong.csv"})).err.find("--pose-columns"),
            std::string::npos)
      << "a flag of import";
  put_bytes(folder_ / "nan.csv", "x_mm,y_mm,theta_rad\n1,2,3\nnan,nan,nan\n");
  refuse({"--candidates", "nan.csv"}, {"nan.csv", "pose 1", "unknown"});
  refuse({"--candidates", "grid", "--goal", "all"}, {"--goal all", "identity, pose or both"});
  refuse({"--candidates", "grid", "--samples", "1"}, {"--samples 1"});
  expect_refused(
      {"plan", "u.h5", "--maps", "maps", "--candidates", "grid", "--filter", "particles"},
      {"--filter particles", "histogram"});
}

TEST_F(PlanCommand, LiveShowsTheNextTouch) {
  const std::string sensor = "simulate:A,rate=100,seed=3,object=random,touches=3,speed=max";
  for (const char* filter : {"histogram", "bounded"}) {
    const std::string out = done({"live", "--sensor", sensor, "--maps", "maps", "--bins=9x9x16",
                                  "--plan", "both", "--filter", filter, "--json", "live.jsonl"});
    EXPECT_NE(out.find("touch next at x "), std::string::npos) << out;
    std::istringstream lines(content_of(folder_.path())["live.jsonl"]);
    int touches = 0;
    for (std::string line; std::getline(lines, line); ++touches) {
      const json estimate = json::parse(line);
      EXPECT_TRUE(estimate.contains("best")) << "the estimate does not wait for the plan";
      EXPECT_FALSE(estimate.contains("next"));
      ASSERT_TRUE(std::getline(lines, line));
      const json planned = json::parse(line);
      EXPECT_EQ(planned.at("unknown"), estimate.at("unknown"));
      EXPECT_EQ(planned.at("touch"), estimate.at("touch"));
      const json& next = planned.at("next");
      EXPECT_EQ(next.size(), 4U) << next;
      EXPECT_GT(next["gain"]["both"].get<double>(), 0.1);
      EXPECT_TRUE(next.contains("x_mm") && next.contains("y_mm") && next.contains("theta_rad"));
    }
    EXPECT_EQ(touches, 3);
  }
  expect_refused({"live", "--sensor", "simulate:A,touches=2", "--maps", "maps", "--plan", "all"},
                 {"--plan all", "identity, pose or both"});
  expect_refused({"live", "--sensor", "simulate:A,touches=2", "--maps", "maps", "--plan", "both",
                  "--filter", "particles"},
                 {"--plan both", "histogram"});
}

}  // namespace palpate::plan_test
