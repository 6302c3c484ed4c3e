#include <sys/resource.h>

#include <cmath>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "import_command.hpp"

namespace palpate::import_test {

void expect_pose(const Pose& pose, const Pose& expected) {
  // Interpolation rounds a few times.
  constexpr double tolerance = 1e-12;
  EXPECT_NEAR(pose.translation_mm.x, expected.translation_mm.x, tolerance);
  EXPECT_NEAR(pose.translation_mm.y, expected.translation_mm.y, tolerance);
  EXPECT_NEAR(pose.theta_rad, expected.theta_rad, tolerance);
}

bool is_unknown(const Pose& pose) { return std::isnan(pose.theta_rad); }

TEST_F(ImportCommand, JoinsFramesWithPosesByTime) {
  expect_named(done(command({"--poses", "poses.csv", "--object", "A"})),
               {"o.h5: 3 frames of 2 elements in 0.100 s, 3 with a pose; next: palpate touches "
                "o.h5 -o TOUCHES.h5\n"});
  const Recording r = read_recording(folder_ / "o.h5");
  EXPECT_EQ(r.rows, "frames");
  EXPECT_EQ(r.object, "A");
  EXPECT_EQ(r.pressure_unit, "kPa");
  EXPECT_EQ(r.pressure, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(r.time_s, (std::vector<double>{0.0, 0.05, 0.1}));
  EXPECT_EQ(r.elements_mm, (std::vector<glm::dvec2>{{-1.0, 0.0}, {1.0, 0.0}}));
  expect_pose(r.T_robot_sensor[0], {{0.0, 5.0}, -1.0});
  expect_pose(r.T_robot_sensor[1], {{5.0, 6.0}, 0.0});
  expect_pose(r.T_robot_sensor[2], {{10.0, 7.0}, 1.0});
}

TEST_F(ImportCommand, ReadingsThatFallUnderLoadAreStoredTimesMinusOne) {
  put("array.csv", "x,y,baseline\n-1,0,7\n1,0,8\n");
  const Recording r = imported({"--sign", "-1", "--array", "array.csv"});
  EXPECT_EQ(r.pressure, (std::vector<double>{-1, -2, -3, -4, -5, -6}));
  EXPECT_EQ(r.baseline, (std::vector<double>{-7, -8}));
  expect_said({"--sign", "2"}, "--sign 2: give 1, or -1 where readings fall under load");
}

TEST_F(ImportCommand, FramesOutsideThePosesOrInAGapHaveNone) {
  put("poses.csv", "t,x,y,yaw\n0.01,1,2,3\n0.02,1,2,3\n0.07,1,2,3\n0.08,1,2,3\n");
  for (const auto& [gap, posed] : {std::pair{"0.03", false}, {"0.06", true}}) {
    if (posed) {
      const Recording r = imported({"--poses", "poses.csv", "--largest-gap-s", gap});
      EXPECT_TRUE(is_unknown(r.T_robot_sensor[0]));
      EXPECT_FALSE(is_unknown(r.T_robot_sensor[1]));
      EXPECT_TRUE(is_unknown(r.T_robot_sensor[2]));
    } else {
      expect_said({"--poses", "poses.csv", "--largest-gap-s", gap},
                  "poses.csv: no row of log.csv finds a pose: its times are 0 to 0.1 s, the "
                  "poses' are 0.01 to 0.08 s; check clocks and units, or raise --largest-gap-s");
    }
  }
}

// Frames at 100 Hz and poses at 10 Hz, of which one is lost; the steps of the poses round to both
// sides of 0.1 s.
TEST_F(ImportCommand, TheLargestGapFollowsThePoses) {
  std::string log = "time,p0,p1\n";
  for (int i = 0; i <= 200; ++i) {
    log += fmt::format("{},1,2\n", 1.7e9 + i * 0.01);
  }
  put("log.csv", log);
  const auto put_poses = [&](int lost) {
    std::string text = "time,x_mm,y_mm,theta_rad\n";
    for (int i = 0; i <= 20; ++i) {
      if (i < 8 || i >= 8 + lost) {
        text += fmt::format("{},{},0,0\n", 1.7e9 + i * 0.1, i);
      }
    }
    put("poses.csv", text);
  };
  put_poses(1);
  const std::string whole = done(command({"--poses", "poses.csv"}));
  expect_named(whole, {"201 frames", "201 with a pose; next"});
  put_poses(2);  // 0.3 s, in which 29 frames lie
  expect_named(done(command({"--poses", "poses.csv"})),
               {"172 with a pose, 29 without one as the poses around them are more than 0.25 s "
                "apart (--largest-gap-s); next"});
  expect_named(done(command({"--poses", "poses.csv", "--largest-gap-s", "0.31"})),
               {"201 with a pose; next"});
}

TEST_F(ImportCommand, FramesAfterTheLastPoseLieInNoGap) {
  put("poses.csv", "time,x,y,theta_rad\n0,0,5,-1\n0.05,10,7,1\n");
  expect_named(done(command({"--poses", "poses.csv"})),
               {"3 frames", "2 with a pose, poses taken to be in mm and rad; next"});
}

TEST_F(ImportCommand, RowsMayBeTouchesAtUnknownPoses) {
  expect_named(done(command({"--rows", "touches", "--unposed", "--object", "A"})),
               {"3 touches", "next: palpate map o.h5 -o MAPS/ --unposed"});
  const Recording r = read_recording(folder_ / "o.h5");
  ASSERT_EQ(r.size(), 3u);
  for (const Pose& pose : r.T_robot_sensor) {
    expect_pose(pose, {});
  }
  expect_named(done(command({"--rows", "touches", "--unposed"})),
               {"next: palpate recognize o.h5 --maps MAPS/ --each-frame"});
  expect_named(done(command({"--unposed"})),
               {"0 with a pose; next: palpate touches o.h5 -o TOUCHES.h5 --unposed"});
  expect_said({"--unposed", "--poses", "poses.csv"},
              "--unposed: poses.csv holds the poses; leave one of them out");
}

TEST_F(ImportCommand, FramesNeedNoPoses) {
  expect_named(done(command({})), {"3 frames", "0 with a pose", "--sensor replay:o.h5 --poses"});
  const std::string bytes = bytes_of(folder_ / "o.h5");
  EXPECT_EQ(bytes.find("sensor_pose"), bytes.npos);
  expect_named(done({"info", "o.h5"}), {"frames           3", "with a pose       0 frames"});
  expect_refused({"map", "o.h5", "-o", "m.h5"}, {"rows = frames"});
}

TEST_F(ImportCommand, ReadsUnitsFromNamesAndFlags) {
  put("log.csv", "stamp_ns,p0,p1\n1700000000000000000,1,2\n1700000000500000000,3,4\n");
  put("poses.csv", "x_m,y_m,yaw_deg\n0.25,-1,180\n0.5,0,90\n");
  const Recording named = imported({"--poses", "poses.csv"});
  EXPECT_EQ(named.time_s, (std::vector<double>{1.7e9, 1.7e9 + 0.5}));
  expect_pose(named.T_robot_sensor[0], {{250.0, -1000.0}, M_PI});
  put("log.csv", "when,p0,p1\n1700000000000,1,2\n1700000000500,3,4\n");
  put("poses.csv", "px,py,heading\n0.25,-1,180\n0.5,0,90\n");
  const Recording given = imported({"--poses", "poses.csv", "--time-column", "when", "--time-unit",
                                    "ms", "--pose-columns", "px,py,heading", "--pose-unit", "m,deg",
                                    "--pressure-unit", "raw"});
  EXPECT_EQ(given.pressure_unit, "raw");
  EXPECT_EQ(given.time_s, named.time_s);
  expect_pose(given.T_robot_sensor[1], {{500.0, 0.0}, M_PI / 2.0});
}

TEST_F(ImportCommand, RowsWithoutTimesAreTouches) {
  put("log.csv", "x,y,theta,p0,p1\n1,2,3,4,5\n6,7,8,9,10\n");
  const std::string said = done(command({"--poses", "log.csv", "--truth", "A,1,2,0.5"}));
  EXPECT_EQ(said,
            "o.h5: 2 touches of 2 elements, poses taken to be in mm and rad; next: palpate "
            "recognize o.h5 --maps MAPS/\n");
  const Recording r = read_recording(folder_ / "o.h5");
  EXPECT_EQ(r.rows, "touches");
  EXPECT_EQ(r.pressure, (std::vector<double>{4, 5, 9, 10}));
  expect_pose(r.T_robot_sensor[1], {{6.0, 7.0}, 8.0});
  ASSERT_TRUE(r.truth);
  EXPECT_EQ(r.truth->object, "A");
  expect_pose(r.truth->T_object_robot, {{1.0, 2.0}, 0.5});
}

TEST_F(ImportCommand, TruthIsInTheUnitsOfThePoses) {
  put("poses.csv", "time,x_m,y_mm,theta_deg\n0,0,0,0\n0.1,0,0,0\n");
  const Recording r = imported({"--poses", "poses.csv", "--truth", "A,0.5,2,90"});
  ASSERT_TRUE(r.truth);
  expect_pose(r.truth->T_object_robot, {{500.0, 2.0}, M_PI / 2.0});
}

// Two frames of one time: their poses cannot be told apart by time.
TEST_F(ImportCommand, OneFileHoldsPressuresAndPosesRowByRow) {
  put("log.csv",
      "t,T,x_mm,y_mm,theta_rad,p0,p1\n0,20,1,0,0,1,2\n0,20,2,0,0,3,4\n"
      "0.1,20,3,0,0,5,6\n");
  const Recording r = imported({"--poses", "./log.csv", "--pressure-columns", "P"});
  EXPECT_EQ(r.pressure, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(r.time_s, (std::vector<double>{0.0, 0.0, 0.1}));
  expect_pose(r.T_robot_sensor[0], {{1.0, 0.0}, 0.0});
  expect_pose(r.T_robot_sensor[1], {{2.0, 0.0}, 0.0});
  expect_named(done(command({"--pressure-columns", "P"})),
               {"0 with a pose, its columns of poses left out (--poses log.csv); next"});
}

TEST_F(ImportCommand, TheSameReadingsInAnyTable) {
  const Recording wide = imported();
  const auto expect_same = [&](const std::string& text, const Arguments& more) {
    put("log.csv", text);
    const Recording r = imported(more);
    EXPECT_EQ(r.pressure, wide.pressure) << text;
    EXPECT_EQ(r.time_s, wide.time_s) << text;
  };
  expect_same("0,1,2\n0.05,3,4\n0.1,5,6\n", {});
  expect_same("Zeit;p0;p1\n0;1;2\n0,05;3;4\n0,1;5;6\n", {"--time-column", "Zeit"});
  expect_same("time,element,pressure\n0,0,1\n0,1,2\n0.05,1,4\n0.05,0,3\n0.1,0,5\n0.1,1,6\n", {});
  expect_same("time,load,q0,q1\n0,9,1,2\n0.05,9,3,4\n0.1,9,5,6\n", {"--pressure-columns", "q"});
  expect_same("time,a,b,c\n0,1,2,9\n0.05,3,4,9\n0.1,5,6,9\n", {"--pressure-columns", "a:b"});
  expect_same(",time,a,b\n0,0,1,2\n1,0.05,3,4\n2,0.1,5,6\n", {});
  expect_same("1,2\n3,4\n5,6\n", {"--rate", "20"});
}

TEST_F(ImportCommand, EmptyCellsAreUnknownInFrames) {
  put("log.csv", "time,p0,p1,p2\n0,,2,\n0.1,3,nan,\n");
  done({"import", "log.csv", "--array", "3:1:1", "-o", "o.h5"});
  const Recording r = read_recording(folder_ / "o.h5");
  EXPECT_EQ(r.valid, (std::vector<std::uint8_t>{1, 1, 0})) << "the last is never read";
  EXPECT_TRUE(std::isnan(r.pressure[0]));
  EXPECT_EQ(r.pressure[1], 2.0);
  EXPECT_TRUE(std::isnan(r.pressure[4]));
}

TEST_F(ImportCommand, EmptyCellsAreDeadReadingsInTouches) {
  put("log.csv", "x,y,theta,p0,p1\n0,0,0,1,\n0,0,0,2,3\n");
  expect_named(done(command({"--poses", "log.csv"})), {"1 readings unknown or dead"});
  EXPECT_EQ(read_recording(folder_ / "o.h5").valid, (std::vector<std::uint8_t>{1, 0, 1, 1}));
}

TEST_F(ImportCommand, ElementsComeFromAFile) {
  put("array.txt", "# x y in mm\n-1.5 0.5\n1.5 0.25  # the tip\n");
  const Recording plain = imported({"--array", "array.txt"});
  EXPECT_EQ(plain.elements_mm, (std::vector<glm::dvec2>{{-1.5, 0.5}, {1.5, 0.25}}));
  put("array.csv", "x_m,y_m,valid,baseline\n-0.0015,0.0005,1,3\n0.0015,0.00025,0,\n");
  const Recording named = imported({"--array", "array.csv"});
  EXPECT_EQ(named.elements_mm, plain.elements_mm);
  EXPECT_EQ(named.valid, (std::vector<std::uint8_t>{1, 0}));
  EXPECT_EQ(named.baseline[0], 3.0);
}

TEST_F(ImportCommand, AGridCountsRowByRow) {
  put("log.csv", "time,a,b,c,d,e,f\n0,1,2,3,4,5,6\n");
  done({"import", "log.csv", "--array", "3:2:2.5", "-o", "o.h5"});
  EXPECT_EQ(read_recording(folder_ / "o.h5").elements_mm,
            (std::vector<glm::dvec2>{
                {-2.5, -1.25}, {0, -1.25}, {2.5, -1.25}, {-2.5, 1.25}, {0, 1.25}, {2.5, 1.25}}));
}

/// The largest memory of a command so far.
long largest_kib() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return usage.ru_maxrss;
}

// 200,000 frames: 7 MB of text and 6 MB of pressures.
/// A 3 x 2 array whose readings are 1 to 6 in the order in which they are read.
TEST_F(ImportCommand, AGridsReadingsComeInAnyOrder) {
  put("log.csv", "time,a,b,c,d,e,f\n0,1,2,3,4,5,6\n");
  // What stands where, seen with x to the right and y upwards: the upper row, then the lower one.
  const auto seen = [&](const Arguments& flags) {
    Arguments arguments{"import", "log.csv", "--array", "3x2x2.5", "-o", "o.h5"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    done(arguments);
    const Recording recording = read_recording(folder_ / "o.h5");
    std::vector<double> places(6);
    for (std::size_t e = 0; e < 6; ++e) {
      const glm::dvec2& p = recording.elements_mm[e];
      const auto column = static_cast<std::size_t>(p.x / 2.5 + 1.0);
      places[(p.y > 0.0 ? 0 : 3) + column] = recording.pressure[e];
    }
    return places;
  };
  using testing::ElementsAre;
  EXPECT_THAT(seen({}), ElementsAre(4, 5, 6, 1, 2, 3));
  EXPECT_THAT(seen({"--first-element", "top-left"}), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(seen({"--first-element", "top-right"}), ElementsAre(3, 2, 1, 6, 5, 4));
  EXPECT_THAT(seen({"--first-element", "bottom-right"}), ElementsAre(6, 5, 4, 3, 2, 1));
  EXPECT_THAT(seen({"--order", "columns"}), ElementsAre(2, 4, 6, 1, 3, 5));
  EXPECT_THAT(seen({"--order", "columns", "--first-element", "top-left"}),
              ElementsAre(1, 3, 5, 2, 4, 6));
  EXPECT_THAT(seen({"--order", "columns", "--first-element", "top-right"}),
              ElementsAre(5, 3, 1, 6, 4, 2));
}

TEST_F(ImportCommand, ElementsAreNamedDead) {
  EXPECT_EQ(imported({"--dead", "1"}).valid, (std::vector<std::uint8_t>{1, 0}));
  put("log.csv", "time,p0,p1,p2\n0,1,2,3\n");
  put("array.csv", "x,y,valid\n0,0,0\n2,0,1\n4,0,1\n");
  EXPECT_EQ(imported({"--array", "array.csv", "--dead", "1"}).valid,
            (std::vector<std::uint8_t>{0, 0, 1}));
}

TEST_F(ImportCommand, WholeNumbersSaidToBePressuresAreNoticed) {
  put("log.csv", "time,p0,p1\n0,12,4095\n0.05,,3\n");
  EXPECT_NE(done(command({})).find("whole numbers up to 4095: raw? (--pressure-unit raw)"),
            std::string::npos);
  EXPECT_EQ(done(command({"--pressure-unit", "raw"})).find("whole numbers"), std::string::npos);
  put("log.csv", "time,p0,p1\n0,12,4095\n0.05,0.5,3\n");
  EXPECT_EQ(done(command({})).find("whole numbers"), std::string::npos);
  put("log.csv", frames);
  EXPECT_EQ(done(command({})).find("whole numbers"), std::string::npos) << "of few kPa";
}

TEST_F(ImportCommand, LongLogsTakeLittleMemory) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer holds memory of its own";
#endif
  done(command({}));
  const long before = largest_kib();
  {
    std::ofstream log(folder_ / "log.csv");
    log << "time,p0,p1,p2,p3\n";
    for (int i = 0; i < 200'000; ++i) {
      log << i * 0.001 << ",0.125,1.25,2.5," << i % 7 << "\n";
    }
  }
  done({"import", "log.csv", "--array", "4:1:2", "-o", "o.h5"});
  // The recording takes 72 bytes a row here (pressures, pose and time), and its file as much again,
  // twice; every row of text would be 40 bytes more.
  EXPECT_LT(largest_kib() - before, 64 * 1024);
  EXPECT_EQ(read_recording(folder_ / "o.h5").size(), 200'000u);
}

// 2,000 readings at as many times: frames of 4,096 elements each.
TEST_F(ImportCommand, ALongTableTakesTheMemoryThatIsChecked) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer holds memory of its own";
#endif
  done(command({}));
  const long before = largest_kib();
  std::string log = "time,element,pressure\n";
  for (int i = 0; i < 2000; ++i) {
    log += std::to_string(i) + "," + std::to_string(i) + ",0.5\n";
  }
  put("log.csv", log);
  done({"import", "log.csv", "--array", "64:64:2", "-o", "o.h5"});
  constexpr long checked_kib = 2000 * (4096 * (8 + 1 + 4) + 88) / 1024;
  EXPECT_LT(largest_kib() - before, checked_kib);
}

}  // namespace palpate::import_test
