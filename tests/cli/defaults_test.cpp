// The lattice that recognize and live take where nobody gives one: about the first touch, over the
// region that the maps and the array make, in bins for the refined pose.

#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>

#include "palpate/balanced_lattice.hpp"
#include "support/program.hpp"
#include "support/sample_files.hpp"

namespace palpate::defaults_test {

using nlohmann::json;
using Arguments = std::vector<std::string>;

/// The maps' cells are twice as wide as usual: automatic bins, as wide as these ask for, are few.
constexpr double cell_mm = 1.0;

class Defaults : public ProgramTest {
 protected:
  Defaults() {
    std::filesystem::create_directory(folder_ / "maps");
    write_maps(cell_mm);
    write_recording(folder_ / "u.h5", unknown_);
  }

  void write_maps(double of_mm) const {
    write_map(folder_ / "maps/A.map.h5", sample_map("A", of_mm));
    write_map(folder_ / "maps/I.map.h5", sample_map("I", of_mm));
  }

  Arguments with(const std::string& recording, const Arguments& flags) const {
    Arguments arguments{recording, "--maps", "maps"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return arguments;
  }
  json u(const Arguments& flags) const { return record(with("u.h5", flags)); }
  json in_scene(const std::string& yaml, Arguments flags = {}) const {
    put_bytes(folder_ / "scene.yaml", yaml);
    flags.insert(flags.end(), {"--scene", "scene.yaml"});
    return u(flags);
  }
  PoseLattice posterior_of(const std::string& recording, Arguments flags = {}) const {
    flags.insert(flags.end(), {"--posterior", "p.h5"});
    record(with(recording, flags));
    return read_posterior(folder_ / "p.h5").lattice;
  }

  Recording unknown_ = sample_unknown("A", {{2.0, -3.0}, 1.0}, 6);
};

void expect_same(const json& a, const json& b) {
  EXPECT_EQ(a["mode"], b["mode"]);
  EXPECT_EQ(a["refined"], b["refined"]);
  EXPECT_EQ(a["identity"], b["identity"]);
}

TEST_F(Defaults, FollowTheMapsTheArrayAndTheFirstTouch) {
  const PoseLattice lattice = posterior_of("u.h5");
  EXPECT_EQ(lattice.pivot_mm, unknown_.T_robot_sensor.front().translation_mm);
  const std::vector<Hypothesis> hypotheses{{.map = sample_map("A", cell_mm)},
                                           {.map = sample_map("I", cell_mm)}};
  const PoseLattice wanted =
      balanced_lattice(touch_region(hypotheses, array_reach_mm(digitacts_array())).lattice,
                       hypotheses)
          .lattice;
  for (const auto axis : {&PoseLattice::x_mm, &PoseLattice::y_mm, &PoseLattice::theta_rad}) {
    EXPECT_EQ((lattice.*axis).lower, (wanted.*axis).lower);
    EXPECT_EQ((lattice.*axis).upper, (wanted.*axis).upper);
    EXPECT_EQ((lattice.*axis).count, (wanted.*axis).count);
  }
}

TEST_F(Defaults, FindAnObjectFarFromTheRobotsOrigin) {
  // T_object_robot of an A whose origin lies at (400, 200) in the robot frame, turned by 40
  // degrees.
  const Pose T_object_robot = inverse(Pose{{400.0, 200.0}, 40.0 * std::numbers::pi / 180.0});
  write_recording(folder_ / "far.h5", sample_unknown("A", T_object_robot, 9));
  for (const Arguments& filter : {Arguments{}, Arguments{"--filter", "particles"}}) {
    const json r = record(with("far.h5", filter));
    EXPECT_EQ(r["best"], "A");
    EXPECT_EQ(r["right"], true);
    if (filter.empty()) {
      // Bins of 0.6 mm; the maps are ideal and the touches are not.
      EXPECT_LT(r["refined_error_mm"].get<double>(), 0.6);
    } else {
      // Motion noise of 1 mm and 0.1 rad at every touch.
      EXPECT_LT(r["error_mm"].get<double>(), 3.0);
    }
  }
  EXPECT_EQ(record(with("far.h5", {"--pivot-mm=0,0"}))["mode"]["map"].is_string(), true);
}

TEST_F(Defaults, GiveTheSameNumbersInAnyRobotFrame) {
  Recording moved = unknown_;
  const Pose T_moved_robot{{-700.0, 250.0}, 0.0};
  for (Pose& pose : moved.T_robot_sensor) {
    pose = T_moved_robot * pose;
  }
  moved.truth->T_object_robot = moved.truth->T_object_robot * inverse(T_moved_robot);
  write_recording(folder_ / "moved.h5", moved);
  const json here = u({});
  const json there = record(with("moved.h5", {}));
  // Places relative to the pivot differ by the rounding of 1,000 mm, 1e-13 mm.
  EXPECT_NEAR(there["identity"]["A"].get<double>(), here["identity"]["A"].get<double>(), 1e-6);
  EXPECT_NEAR(there["refined_error_mm"].get<double>(), here["refined_error_mm"].get<double>(),
              1e-4);
}

TEST_F(Defaults, GiveTheSameNumbersInAnySensorFrame) {
  // Elements and poses of a frame 100 mm beside the array, such as the robot's flange.
  const glm::dvec2 offset_mm{100.0, 0.0};
  Recording of_flange = unknown_;
  for (glm::dvec2& element_mm : of_flange.elements_mm) {
    element_mm += offset_mm;
  }
  for (Pose& pose : of_flange.T_robot_sensor) {
    pose = pose * Pose{-offset_mm, 0.0};
  }
  write_recording(folder_ / "flange.h5", of_flange);
  const json here = u({"--posterior=here.h5", "--filter=bounded"});
  const json there = record(with("flange.h5", {"--posterior=there.h5", "--filter=bounded"}));
  const PoseLattice lattice = read_posterior(folder_ / "here.h5").lattice;
  const PoseLattice flange = read_posterior(folder_ / "there.h5").lattice;
  EXPECT_NEAR(flange.pivot_mm.x, lattice.pivot_mm.x, 1e-9);
  EXPECT_NEAR(flange.pivot_mm.y, lattice.pivot_mm.y, 1e-9);
  for (const auto axis : {&PoseLattice::x_mm, &PoseLattice::y_mm, &PoseLattice::theta_rad}) {
    EXPECT_NEAR((flange.*axis).lower, (lattice.*axis).lower, 1e-9);
    EXPECT_NEAR((flange.*axis).upper, (lattice.*axis).upper, 1e-9);
    EXPECT_EQ((flange.*axis).count, (lattice.*axis).count);
  }
  // Places relative to the pivot differ by the rounding of 100 mm, 1e-14 mm.
  EXPECT_EQ(there["best"], here["best"]);
  EXPECT_NEAR(there["identity"]["A"].get<double>(), here["identity"]["A"].get<double>(), 1e-6);
  for (const char* field : {"x_mm", "y_mm", "theta_rad"}) {
    EXPECT_NEAR(there["refined"][field].get<double>(), here["refined"][field].get<double>(), 1e-4);
  }
}

TEST_F(Defaults, AreWhatAutoAsksFor) {
  const json bare = u({});
  expect_same(u({"--bins", "auto"}), bare);
  expect_same(u({"--pivot-mm", "auto"}), bare);
  expect_same(u({"--bins", "auto", "--pivot-mm", "auto"}), bare);
  expect_same(in_scene("bins: auto\n"), bare);
  expect_same(in_scene("region: {pivot_mm: auto}\n"), bare);
  expect_same(in_scene("bins: [5, 5, 4]\n", {"--bins", "auto"}), bare);
  expect_same(in_scene("region: {pivot_mm: [90, 90]}\n", {"--pivot-mm", "auto"}), bare);
}

TEST_F(Defaults, FineBinsAreHalfAsWide) {
  const PoseLattice usual = posterior_of("u.h5", {"--touches=1", "--filter=bounded"});
  const PoseLattice fine = posterior_of("u.h5", {"--touches=1", "--filter=bounded", "--bins=fine"});
  EXPECT_EQ(fine.x_mm.lower, usual.x_mm.lower);
  EXPECT_EQ(fine.pivot_mm, usual.pivot_mm);
  // Counts round up.
  EXPECT_NEAR(fine.x_mm.count, 2 * usual.x_mm.count, 2);
  EXPECT_NEAR(fine.theta_rad.count, 2 * usual.theta_rad.count, 2);
  expect_same(in_scene("bins: fine\n", {"--touches", "3"}),
              u({"--touches", "3", "--bins", "fine"}));
}

TEST_F(Defaults, GiveWayTogetherToAnyPartOfALattice) {
  const char* const bounded = "--filter=bounded";  // which needs no device
  const auto old = [](Arguments flags) {
    const auto add = [&](const char* flag, const char* value) {
      const std::string name = std::string(flag) + "=";
      if (std::ranges::none_of(flags, [&](const auto& f) { return f.starts_with(name); })) {
        flags.push_back(name + value);
      }
    };
    add("--bins", "25x25x16");
    add("--x-mm", "-10:10");
    add("--y-mm", "-10:10");
    add("--theta-deg", "0:360");
    add("--pivot-mm", "0,0");
    return flags;
  };
  for (const char* flag : {"--bins=25x25x16", "--bins=9x9x8", "--x-mm=-4:9", "--y-mm=-4:9",
                           "--theta-deg=10:80", "--pivot-mm=3,-2", "--pivot-mm=0,0"}) {
    SCOPED_TRACE(flag);
    expect_same(u({flag, bounded}), u(old({flag, bounded})));
  }
  expect_same(in_scene("bins: [9, 9, 8]\n"), u(old({"--bins=9x9x8"})));
  expect_same(in_scene("region: {x_mm: [-4, 9]}\n", {bounded}), u(old({"--x-mm=-4:9", bounded})));
  expect_same(in_scene("region: {pivot_mm: [3, -2]}\n", {bounded}),
              u(old({"--pivot-mm=3,-2", bounded})));
}

TEST_F(Defaults, AnAutomaticPivotGoesWithAnyRegion) {
  const glm::dvec2 pivot_mm = unknown_.T_robot_sensor.front().translation_mm;
  const Arguments region{"--x-mm=-15:15", "--y-mm=-15:15", "--bins=30x30x36", "--filter=bounded"};
  Arguments automatic = region;
  automatic.emplace_back("--pivot-mm=auto");
  Arguments given = region;
  given.push_back(fmt::format("--pivot-mm={},{}", pivot_mm.x, pivot_mm.y));
  const json wanted = u(given);
  expect_same(u(automatic), wanted);
  EXPECT_EQ(in_scene("region: {x_mm: [-15, 15], y_mm: [-15, 15], pivot_mm: auto}\n"
                     "bins: [30, 30, 36]\nfilter: bounded\n")["mode"],
            wanted["mode"]);
}

TEST_F(Defaults, EveryUnknownHasAPivotOfItsOwn) {
  const json frames =
      records(with("u.h5", {"--each-frame", "--frames", "0:3", "--filter=bounded"}));
  ASSERT_EQ(frames.size(), 3u);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    expect_same(frames[i], u({"--frames", fmt::format("{}:{}", i, i + 1), "--filter=bounded",
                              "--posterior=p.h5"}));
    EXPECT_EQ(read_posterior(folder_ / "p.h5").lattice.pivot_mm,
              unknown_.T_robot_sensor[i].translation_mm);
  }
}

TEST_F(Defaults, LiveAndRecognizeGiveTheSameNumbers) {
  for (const char* object : {"random", "-400:-200:30"}) {
    SCOPED_TRACE(object);
    done({"record", "--sensor",
          fmt::format("simulate:A,rate=100,seed=3,object={},touches=5,speed=max", object), "-o",
          "frames.h5"});
    const Outcome live = palpate({"live", "--sensor", "replay:frames.h5,speed=max", "--maps",
                                  "maps", "--json", "live.jsonl"});
    ASSERT_EQ(live.status, 0) << live.err;
    done({"touches", "frames.h5", "-o", "touches.h5"});
    const json trace = record(with("touches.h5", {"--trace"}))["trace"];
    ASSERT_EQ(trace.size(), 5u);
    std::istringstream lines(bytes_of(folder_ / "live.jsonl"));
    for (const json& step : trace) {
      std::string line;
      ASSERT_TRUE(std::getline(lines, line));
      const json touch = json::parse(line);
      EXPECT_EQ(touch["best"], step["best"]);
      // A touch that is evaluated ahead is added in one step: float32 rounds it by some 1e-5 nats.
      for (const char* label : {"A", "I"}) {
        EXPECT_NEAR(touch["identity"][label].get<double>(), step["identity"][label].get<double>(),
                    1e-4);
      }
      for (const char* field : {"x_mm", "y_mm", "theta_rad"}) {
        EXPECT_NEAR(touch["refined"][field].get<double>(), step["refined"][field].get<double>(),
                    1e-4);
      }
    }
    EXPECT_EQ(trace.back()["best"], "A");
  }
}

TEST_F(Defaults, TellOfObjectsFarApartInTheirFrames) {
  EXPECT_EQ(palpate({"recognize", "u.h5", "--maps", "maps", "--json", "r.json"}).err, "");
  OccupancyGrid far = sample_map("I", cell_mm);
  far.origin_mm.x += 60.0;
  write_map(folder_ / "maps/I.map.h5", far);
  const Arguments call{"recognize", "u.h5", "--maps", "maps", "--json", "r.json"};
  const Outcome outcome = palpate(call);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("far apart"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("--x-mm"), std::string::npos) << outcome.err;
  EXPECT_EQ(json::parse(bytes_of(folder_ / "r.json"))[0]["best"], "A");
}

TEST_F(Defaults, RefuseAFirstTouchBeyondEveryRobot) {
  Recording beyond = unknown_;
  beyond.T_robot_sensor.front().translation_mm.x = 1e10;
  write_recording(folder_ / "beyond.h5", beyond);
  expect_refused({"recognize", "beyond.h5", "--maps", "maps"},
                 {"beyond.h5", "first touch", "10000000000", "poses' unit"});
}

}  // namespace palpate::defaults_test
