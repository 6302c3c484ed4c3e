#include "import_command.hpp"

#include <sys/resource.h>

#include <cmath>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace palpate::import_test {

using testing::ElementsAre;

void expect_pose(const Pose& pose, const Pose& expected) {
  // Interpolation rounds a few times.
  constexpr double tolerance = 1e-12;
  EXPECT_NEAR(pose.translation_mm.x, expected.translation_mm.x, tolerance);
  EXPECT_NEAR(pose.translation_mm.y, expected.translation_mm.y, tolerance);
  EXPECT_NEAR(pose.theta_rad, expected.theta_rad, tolerance);
}

TEST_F(ImportCommand, JoinsFramesWithPosesByTime) {
  expect_named(said("--poses poses.csv --object A"),
               {"o.h5: 3 frames of 2 elements in 0.100 s, 3 with a pose; next: palpate touches "
                "o.h5 -o TOUCHES.h5\n"});
  const Recording r = read_recording(folder_ / "o.h5");
  EXPECT_EQ(r.rows, "frames");
  EXPECT_EQ(r.object, "A");
  EXPECT_EQ(r.pressure_unit, "kPa");
  EXPECT_THAT(r.pressure, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(r.time_s, ElementsAre(0.0, 0.05, 0.1));
  EXPECT_THAT(r.elements_mm, ElementsAre(glm::dvec2(-1.0, 0.0), glm::dvec2(1.0, 0.0)));
  expect_pose(r.T_robot_sensor[0], {{0.0, 5.0}, -1.0});
  expect_pose(r.T_robot_sensor[1], {{5.0, 6.0}, 0.0});
  expect_pose(r.T_robot_sensor[2], {{10.0, 7.0}, 1.0});
}

TEST_F(ImportCommand, ReadingsThatFallUnderLoadAreStoredTimesMinusOne) {
  put("array.csv", "x,y,baseline\n-1,0,7\n1,0,8\n");
  const Recording r = imported("--sign -1 --array array.csv");
  EXPECT_THAT(r.pressure, ElementsAre(-1, -2, -3, -4, -5, -6));
  EXPECT_THAT(r.baseline, ElementsAre(-7, -8));
  expect_refused(command("--sign 2"),
                 {"palpate: --sign 2: give 1, or -1 where readings fall under load\n"});
}

TEST_F(ImportCommand, FramesOutsideThePosesOrInAGapHaveNone) {
  put("poses.csv", "t,x,y,yaw\n0.01,1,2,3\n0.02,1,2,3\n0.07,1,2,3\n0.08,1,2,3\n");
  expect_refused(command("--poses poses.csv --largest-gap-s 0.03"),
                 {"poses.csv: no row of log.csv finds a pose: its times are 0 to 0.1 s, the "
                  "poses' are 0.01 to 0.08 s; check clocks and units, or raise --largest-gap-s"});
  const Recording r = imported("--poses poses.csv --largest-gap-s 0.06");
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(std::isnan(r.T_robot_sensor[i].theta_rad), i != 1) << i;
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
      text += i < 8 || i >= 8 + lost ? fmt::format("{},{},0,0\n", 1.7e9 + i * 0.1, i) : "";
    }
    put("poses.csv", text);
  };
  put_poses(1);
  expect_named(said("--poses poses.csv"), {"201 frames", "201 with a pose; next"});
  put_poses(2);  // 0.3 s, in which 29 frames lie
  expect_named(said("--poses poses.csv"),
               {"172 with a pose, 29 without one as the poses around them are more than 0.25 s "
                "apart (--largest-gap-s); next"});
  expect_named(said("--poses poses.csv --largest-gap-s 0.31"), {"201 with a pose; next"});
  put("log.csv", frames);
  put("poses.csv", "time,x,y,theta_rad\n0,0,5,-1\n0.05,10,7,1\n");
  expect_named(said("--poses poses.csv"),
               {"3 frames", "2 with a pose, poses taken to be in mm and rad; next"});
}

TEST_F(ImportCommand, RowsMayBeTouchesAtUnknownPoses) {
  expect_named(said("--rows touches --unposed --object A"),
               {"3 touches", "next: palpate map o.h5 -o MAPS/ --unposed"});
  const Recording r = read_recording(folder_ / "o.h5");
  ASSERT_EQ(r.size(), 3u);
  for (const Pose& pose : r.T_robot_sensor) {
    expect_pose(pose, {});
  }
  expect_named(said("--rows touches --unposed"),
               {"next: palpate recognize o.h5 --maps MAPS/ --each-frame"});
  expect_named(said("--unposed"),
               {"0 with a pose; next: palpate touches o.h5 -o TOUCHES.h5 --unposed"});
  expect_refused(command("--unposed --poses poses.csv"),
                 {"--unposed: poses.csv holds the poses; leave one of them out\n"});
}

TEST_F(ImportCommand, FramesNeedNoPoses) {
  expect_named(said(""), {"3 frames", "0 with a pose", "--sensor replay:o.h5 --poses"});
  EXPECT_EQ(bytes_of(folder_ / "o.h5").find("sensor_pose"), std::string::npos);
  expect_named(done("info o.h5"), {"frames           3", "with a pose       0 frames"});
}

TEST_F(ImportCommand, ReadsUnitsFromNamesAndFlags) {
  put("log.csv", "stamp_ns,p0,p1\n1700000000000000000,1,2\n1700000000500000000,3,4\n");
  put("poses.csv", "x_m,y_m,yaw_deg\n0.25,-1,180\n0.5,0,90\n");
  const Recording named = imported("--poses poses.csv");
  EXPECT_THAT(named.time_s, ElementsAre(1.7e9, 1.7e9 + 0.5));
  expect_pose(named.T_robot_sensor[0], {{250.0, -1000.0}, M_PI});
  put("log.csv", "when,p0,p1\n1700000000000,1,2\n1700000000500,3,4\n");
  put("poses.csv", "px,py,heading\n0.25,-1,180\n0.5,0,90\n");
  const Recording given = imported(
      "--poses poses.csv --time-column when --time-unit ms --pose-columns px,py,heading"
      " --pose-unit m,deg --pressure-unit raw");
  EXPECT_EQ(given.pressure_unit, "raw");
  EXPECT_EQ(given.time_s, named.time_s);
  expect_pose(given.T_robot_sensor[1], {{500.0, 0.0}, M_PI / 2.0});
}

TEST_F(ImportCommand, RowsWithoutTimesAreTouchesWithATruth) {
  put("log.csv", "x,y,theta,p0,p1\n1,2,3,4,5\n6,7,8,9,10\n");
  EXPECT_EQ(said("--poses log.csv --truth A,1,2,0.5"),
            "o.h5: 2 touches of 2 elements, poses taken to be in mm and rad; next: palpate "
            "recognize o.h5 --maps MAPS/\n");
  const Recording r = read_recording(folder_ / "o.h5");
  EXPECT_EQ(r.rows, "touches");
  EXPECT_THAT(r.pressure, ElementsAre(4, 5, 9, 10));
  expect_pose(r.T_robot_sensor[1], {{6.0, 7.0}, 8.0});
  EXPECT_EQ(r.truth.value().object, "A");
  expect_pose(r.truth->T_object_robot, {{1.0, 2.0}, 0.5});
  // In the units of the poses.
  put("log.csv", frames);
  put("poses.csv", "time,x_m,y_mm,theta_deg\n0,0,0,0\n0.1,0,0,0\n");
  expect_pose(imported("--poses poses.csv --truth A,0.5,2,90").truth.value().T_object_robot,
              {{500.0, 2.0}, M_PI / 2.0});
}

// Two frames of one time: their poses cannot be told apart by time.
TEST_F(ImportCommand, OneFileHoldsPressuresAndPosesRowByRow) {
  put("log.csv",
      "t,T,x_mm,y_mm,theta_rad,p0,p1\n0,20,1,0,0,1,2\n0,20,2,0,0,3,4\n"
      "0.1,20,3,0,0,5,6\n");
  const Recording r = imported("--poses ./log.csv --pressure-columns P");
  EXPECT_THAT(r.pressure, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(r.time_s, ElementsAre(0.0, 0.0, 0.1));
  expect_pose(r.T_robot_sensor[0], {{1.0, 0.0}, 0.0});
  expect_pose(r.T_robot_sensor[1], {{2.0, 0.0}, 0.0});
  expect_named(said("--pressure-columns P"),
               {"0 with a pose, its columns of poses left out (--poses log.csv); next"});
}

TEST_F(ImportCommand, TheSameReadingsInAnyTable) {
  for (const auto& [text, flags] : {
           std::pair{"0,1,2\n0.05,3,4\n0.1,5,6\n", ""},
           {"Zeit;p0;p1\n0;1;2\n0,05;3;4\n0,1;5;6\n", "--time-column Zeit"},
           {"time,element,pressure\n0,0,1\n0,1,2\n0.05,1,4\n0.05,0,3\n0.1,0,5\n0.1,1,6\n", ""},
           {"time,load,q0,q1\n0,9,1,2\n0.05,9,3,4\n0.1,9,5,6\n", "--pressure-columns q"},
           {"time,a,b,c\n0,1,2,9\n0.05,3,4,9\n0.1,5,6,9\n", "--pressure-columns a:b"},
           {",time,a,b\n0,0,1,2\n1,0.05,3,4\n2,0.1,5,6\n", ""},
           {"1,2\n3,4\n5,6\n", "--rate 20"},
       }) {
    SCOPED_TRACE(text);
    put("log.csv", text);
    const Recording r = imported(flags);
    EXPECT_THAT(r.pressure, ElementsAre(1, 2, 3, 4, 5, 6));
    EXPECT_THAT(r.time_s, ElementsAre(0.0, 0.05, 0.1));
  }
}

TEST_F(ImportCommand, EmptyCellsAreUnknownInFramesAndDeadInTouches) {
  put("log.csv", "time,p0,p1,p2\n0,,2,\n0.1,3,nan,\n");
  const Recording r = imported("--array 3:1:1");
  EXPECT_THAT(r.valid, ElementsAre(1, 1, 0)) << "the last is never read";
  EXPECT_TRUE(std::isnan(r.pressure[0]));
  EXPECT_EQ(r.pressure[1], 2.0);
  EXPECT_TRUE(std::isnan(r.pressure[4]));
  put("log.csv", "x,y,theta,p0,p1\n0,0,0,1,\n0,0,0,2,3\n");
  expect_named(said("--poses log.csv"), {"1 readings unknown or dead"});
  EXPECT_THAT(read_recording(folder_ / "o.h5").valid, ElementsAre(1, 0, 1, 1));
}

TEST_F(ImportCommand, ElementsComeFromAFileAndAreNamedDead) {
  put("array.txt", "# x y in mm\n-1.5 0.5\n1.5 0.25  # the tip\n");
  const Recording plain = imported("--array array.txt");
  EXPECT_THAT(plain.elements_mm, ElementsAre(glm::dvec2(-1.5, 0.5), glm::dvec2(1.5, 0.25)));
  put("array.csv", "x_m,y_m,valid,baseline\n-0.0015,0.0005,1,3\n0.0015,0.00025,0,\n");
  const Recording named = imported("--array array.csv");
  EXPECT_EQ(named.elements_mm, plain.elements_mm);
  EXPECT_THAT(named.valid, ElementsAre(1, 0));
  EXPECT_EQ(named.baseline[0], 3.0);
  EXPECT_THAT(imported("--dead 1").valid, ElementsAre(1, 0));
  put("log.csv", "time,p0,p1,p2\n0,1,2,3\n");
  put("array.csv", "x,y,valid\n0,0,0\n2,0,1\n4,0,1\n");
  EXPECT_THAT(imported("--array array.csv --dead 1").valid, ElementsAre(0, 0, 1));
}

/// A 3 x 2 array whose readings are 1 to 6 in the order in which they are read.
TEST_F(ImportCommand, AGridsReadingsComeInAnyOrder) {
  put("log.csv", "time,a,b,c,d,e,f\n0,1,2,3,4,5,6\n");
  EXPECT_EQ(imported("--array 3:2:2.5").elements_mm,
            (std::vector<glm::dvec2>{
                {-2.5, -1.25}, {0, -1.25}, {2.5, -1.25}, {-2.5, 1.25}, {0, 1.25}, {2.5, 1.25}}));
  // What stands where, seen with x to the right and y upwards: the upper row, then the lower one.
  for (const auto& [flags, expected] : {
           std::pair{"", std::vector<double>{4, 5, 6, 1, 2, 3}},
           {"--first-element top-left", {1, 2, 3, 4, 5, 6}},
           {"--first-element top-right", {3, 2, 1, 6, 5, 4}},
           {"--first-element bottom-right", {6, 5, 4, 3, 2, 1}},
           {"--order columns", {2, 4, 6, 1, 3, 5}},
           {"--order columns --first-element top-left", {1, 3, 5, 2, 4, 6}},
           {"--order columns --first-element top-right", {5, 3, 1, 6, 4, 2}},
       }) {
    const Recording recording = imported(std::string("--array 3x2x2.5 ") + flags);
    std::vector<double> seen(6);
    for (std::size_t e = 0; e < 6; ++e) {
      const glm::dvec2& p = recording.elements_mm[e];
      seen[(p.y > 0.0 ? 0 : 3) + static_cast<std::size_t>(p.x / 2.5 + 1.0)] = recording.pressure[e];
    }
    EXPECT_EQ(seen, expected) << flags;
  }
}

TEST_F(ImportCommand, WholeNumbersSaidToBePressuresAreNoticed) {
  const auto noticed = [&](const char* log, const std::string& flags = "") {
    put("log.csv", log);
    return said(flags).find("whole numbers up to 4095: raw? (--pressure-unit raw)") !=
           std::string::npos;
  };
  EXPECT_TRUE(noticed("time,p0,p1\n0,12,4095\n0.05,,3\n"));
  EXPECT_FALSE(noticed("time,p0,p1\n0,12,4095\n0.05,,3\n", "--pressure-unit raw"));
  EXPECT_FALSE(noticed("time,p0,p1\n0,12,4095\n0.05,0.5,3\n"));
  put("log.csv", frames);
  EXPECT_EQ(said("").find("whole numbers"), std::string::npos) << "of few kPa";
}

/// The largest memory of a command so far.
long largest_kib() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  return usage.ru_maxrss;
}

TEST_F(ImportCommand, ALongTableTakesTheMemoryThatIsChecked) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer holds memory of its own";
#endif
  done(command());
  const long before = largest_kib();
  // 2,000 readings at as many times: frames of 4,096 elements each.
  std::string table = "time,element,pressure\n";
  for (int i = 0; i < 2000; ++i) {
    table += fmt::format("{0},{0},0.5\n", i);
  }
  put("log.csv", table);
  done(command("--array 64:64:2"));
  constexpr long checked_kib = 2000 * (4096 * (8 + 1 + 4) + 88) / 1024;
  EXPECT_LT(largest_kib() - before, checked_kib);
}

// 200,000 frames: 7 MB of text and 6 MB of pressures.
TEST_F(ImportCommand, LongLogsTakeLittleMemory) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer holds memory of its own";
#endif
  done(command());
  const long before = largest_kib();
  std::ofstream log(folder_ / "log.csv");
  log << "time,p0,p1,p2,p3\n";
  for (int i = 0; i < 200'000; ++i) {
    log << i * 0.001 << ",0.125,1.25,2.5," << i % 7 << "\n";
  }
  log.close();
  done(command("--array 4:1:2"));
  // The recording takes 72 bytes a row here (pressures, pose and time), and its file as much again,
  // twice; every row of text would be 40 bytes more.
  EXPECT_LT(largest_kib() - before, 64 * 1024);
  EXPECT_EQ(read_recording(folder_ / "o.h5").size(), 200'000u);
}

}  // namespace palpate::import_test
