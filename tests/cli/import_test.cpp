#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "program.hpp"
#include "sample_files.hpp"

namespace palpate {
namespace {

using Arguments = std::vector<std::string>;

// Three frames of two elements, 2 mm apart.
const std::string frames = "time,p0,p1\n0,1,2\n0.05,3,4\n0.1,5,6\n";
const std::string poses = "time,x_mm,y_mm,theta_rad\n0,0,5,-1\n0.1,10,7,1\n";

class ImportCommand : public ProgramTest {
 protected:
  ImportCommand() {
    put("log.csv", frames);
    put("poses.csv", poses);
  }

  void put(const std::string& name, const std::string& text) const {
    put_bytes(folder_ / name, text);
  }

  static Arguments command(const Arguments& more) {
    Arguments arguments{"import", "log.csv"};
    for (const auto& [flag, value] : {std::pair{"--array", "2:1:2"}, {"-o", "o.h5"}}) {
      if (std::ranges::find(more, flag) == more.end()) {
        arguments.insert(arguments.end(), {flag, value});
      }
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  Recording imported(const Arguments& more = {}) const {
    done(command(more));
    return read_recording(folder_ / "o.h5");
  }

  // Refused with exactly this line.
  void expect_said(const Arguments& more, const std::string& line) const {
    expect_refused(command(more), {"palpate: " + line + "\n"});
  }
};

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
  const std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 1, 2), }";
  const std::vector<float> numbers{1, 2, 3, 4, 5, 6};
  expect_same(std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(header.size()) + '\0' +
                  header + std::string(reinterpret_cast<const char*>(numbers.data()), 24),
              {"--rate", "20"});
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

/// A table that makes no recording, and what is said of it.
struct Case {
  const char* name;
  const char* file;
  std::string text;
  Arguments flags;
  std::string said;

  friend void PrintTo(const Case& value, std::ostream* out) { *out << value.name; }
};

class BadTable : public ImportCommand, public testing::WithParamInterface<Case> {};

TEST_P(BadTable, IsRefusedInOneLine) {
  put(GetParam().file, GetParam().text);
  expect_said(GetParam().flags, GetParam().said);
}

const Arguments with_poses{"--poses", "poses.csv"};

INSTANTIATE_TEST_SUITE_P(
    All, BadTable,
    testing::Values(
        Case{"text",
             "log.csv",
             "time,p0,p1\n0,1,2\n1,3,abc\n",
             {},
             "log.csv:3: column 'p1': 'abc' is not a finite number; correct it, or leave the cell "
             "empty"},
        Case{"no_time",
             "log.csv",
             "time,p0,p1\n,1,2\n",
             {},
             "log.csv:2: column 'time' is empty; write a number"},
        Case{"times_descend",
             "log.csv",
             "time,p0,p1\n2,1,2\n1,1,2\n",
             {},
             "log.csv:3: column 'time': 1 s is earlier than the row before, at 2 s; sort the rows "
             "by time"},
        Case{"nanoseconds",
             "log.csv",
             "time,p0,p1\n1700000000000000000,1,2\n",
             {},
             "log.csv:2: column 'time': 1.7e+18 s is no time; give the unit by --time-unit ms, us "
             "or ns"},
        Case{"two_units",
             "log.csv",
             "time_ns,p0,p1\n1,1,2\n",
             {"--time-unit", "s"},
             "log.csv:1: column 'time_ns' is in ns by its name, in s by --time-unit; make them "
             "agree"},
        Case{"more_columns",
             "log.csv",
             "time,p0,p1,p2\n0,1,2,3\n",
             {},
             "log.csv:1: 3 columns of pressure ('p0' to 'p2') for an array of 2 elements; correct "
             "--array, or name the columns by --pressure-columns"},
        Case{"sorted_as_text",
             "log.csv",
             "time,p10,p2\n0,1,2\n",
             {},
             "log.csv:1: column 'p2' comes after 'p10'; order the columns as the array's elements"},
        Case{"no_such_columns",
             "log.csv",
             frames,
             {"--pressure-columns", "q"},
             "log.csv:1: no column is called or begins with 'q'; give --pressure-columns a prefix "
             "of the columns' names, or FIRST:LAST"},
        Case{"columns_back_to_front",
             "log.csv",
             frames,
             {"--pressure-columns", "p1:p0"},
             "log.csv:1: column 'p0' comes before 'p1'; give --pressure-columns FIRST:LAST"},
        Case{"times_as_pressures",
             "log.csv",
             frames,
             {"--pressure-columns", "time:p0"},
             "log.csv:1: column 'time', between 'time' and 'p0', holds no pressures; correct "
             "--pressure-columns FIRST:LAST"},
        Case{"a_temperature_is_no_time",
             "log.csv",
             "T,p0,p1\n20,1,2\n",
             {"--pressure-columns", "p"},
             "log.csv: its rows are touches, and each needs a pose; give --poses, or for a stream "
             "of frames a column 'time' or --rate"},
        Case{"touches_without_their_poses",
             "log.csv",
             "x,y,theta,p0,p1\n0,0,0,1,2\n",
             {},
             "log.csv: its rows are touches, and each needs a pose; give --poses log.csv, or for a "
             "stream of frames a column 'time' or --rate"},
        Case{"a_bad_cell_in_the_first_row",
             "log.csv",
             "0,1,NA\n1,2,3\n",
             {},
             "log.csv:1: column '3': 'NA' is not a finite number; correct it, or leave the cell "
             "empty; in a header, no cell is a number"},
        Case{"ragged",
             "log.csv",
             "time,p0,p1\n0,1,2\n1,3\n",
             {},
             "log.csv:3: the row has 2 cells, the first row 3; write the same columns in every "
             "row"},
        Case{"header_alone",
             "log.csv",
             "time,p0,p1\n",
             {},
             "log.csv: holds a header and no row; write a row for each frame"},
        Case{"nothing_read",
             "log.csv",
             "time,p0,p1\n0,,\n",
             {},
             "log.csv: holds no reading of a living element; write the pressures"},
        Case{"no_such_element",
             "log.csv",
             "time,element,pressure\n0,2,1\n",
             {},
             "log.csv:2: column 'element': 2 is no element; the array has 2, counted from 0"},
        Case{"element_twice", "log.csv", "frame,element,pressure\n0,1,1\n0,1,1\n", with_poses,
             "log.csv:3: element 1 has two readings in one frame; leave one out"},
        Case{"no_frame",
             "log.csv",
             "element,pressure\n0,1\n",
             {},
             "log.csv:1: a table with a row for each reading needs a column 'time' or 'frame'; add "
             "it, or name it by --time-column"},
        Case{"touches_without_poses",
             "log.csv",
             "p0,p1\n1,2\n",
             {},
             "log.csv: its rows are touches, and each needs a pose; give --poses, or for a stream "
             "of frames a column 'time' or --rate"},
        Case{"frames_without_times",
             "log.csv",
             "p0,p1\n1,2\n",
             {"--rows", "frames"},
             "log.csv: frames need times; add a column 'time', or give --rate"},
        Case{"poses_alone_have_times", "log.csv", "p0,p1\n1,2\n", with_poses,
             "poses.csv: has times, log.csv has none; give both a column 'time' or neither, or "
             "give the frames' --rate"},
        Case{"fewer_poses", "poses.csv", "x,y,theta\n1,2,3\n", with_poses,
             "poses.csv: holds 1 poses without a time for 3 rows of log.csv; write one for each "
             "row, or give both a column 'time'"},
        Case{"a_touch_without_a_pose",
             "poses.csv",
             "time,x,y,theta\n0,1,2,3\n0.05,1,2,3\n",
             {"--poses", "poses.csv", "--rows", "touches"},
             "poses.csv: has no pose for row 2 of log.csv, counted from 0, at 0.1 s, and a touch "
             "needs one; add it, or give --rows frames"},
        Case{"equal_times_of_poses", "poses.csv", "time,x,y,theta\n0,1,2,3\n0,1,2,3\n", with_poses,
             "poses.csv:3: column 'time': 0 s is not later than the row before, at 0 s; sort the "
             "rows by time"},
        Case{"half_a_pose", "poses.csv", "time,x,y,theta\n0,1,,3\n", with_poses,
             "poses.csv:2: a part of the pose is empty; write x, y and theta, or leave all three "
             "empty"},
        Case{
            "a_far_pose", "poses.csv", "time,x_m,y_m,theta\n0,2e6,0,0\n", with_poses,
            "poses.csv:2: column 'x_m': 2000000 m is further than any robot gets; check the number "
            "and its unit"},
        Case{"no_angle", "poses.csv", "time,x,y\n0,1,2\n", with_poses,
             "poses.csv:1: has no columns 'x', 'y' and 'theta'; rename its columns, or give "
             "--pose-columns X,Y,THETA"},
        Case{"an_array_of_one_column",
             "a.txt",
             "1\n2\n",
             {"--array", "a.txt"},
             "a.txt:1: no column is called 'x'; write a row 'x y' in mm for each element"},
        Case{"binary",
             "log.csv",
             std::string("\0\1\2", 3),
             {},
             "log.csv: is no text; save the table as CSV in UTF-8, or one array with numpy.save"}),
    [](const auto& test) { return test.param.name; });

TEST_F(ImportCommand, FlagsNameTheirForm) {
  expect_said({"--pose-unit", "cm,rad"},
              "--pose-unit cm,rad: give mm,rad or mm,deg or m,rad or m,deg");
  expect_said({"--time-unit", "h"}, "--time-unit h: give s, ms, us or ns");
  expect_said({"--pressure-unit", "psi"}, "--pressure-unit psi: give kPa or raw");
  expect_said({"--rows", "rows"}, "--rows rows: give frames or touches");
  expect_said({"--rate", "5"}, "--rate 5: log.csv has times; leave the flag out");
  expect_said({"--rate", "0"}, "--rate 0: give 0.001 to 1000000 Hz");
  expect_said({"--rate", "1e-300"}, "--rate 1e-300: give 0.001 to 1000000 Hz");
  expect_said({"--rate", "1e300"}, "--rate 1e+300: give 0.001 to 1000000 Hz");
  expect_said({"--largest-gap-s", "0"}, "--largest-gap-s 0: must be above 0");
  expect_said({"--pose-columns", "x,y"}, "--pose-columns x,y: give three names, X,Y,THETA");
  expect_said({"--truth", "1,2,3"},
              "--truth 1,2,3: give LABEL,X,Y,THETA, in the units of the poses");
  expect_said({"--truth", ",1,2,3"},
              "--truth ,1,2,3: give LABEL,X,Y,THETA, in the units of the poses");
  expect_said({"--truth", "A,0,1e12,0"},
              "--truth A,0,1e12,0: is further than 1e+09 mm or turned by more than 1e9 rad; check "
              "the numbers and their units, mm, mm and rad");
  expect_said({"--array", "0:1:2"},
              "--array 0:1:2: give COLUMNS:ROWS:PITCH, with 1 to 1024 columns and rows and a pitch "
              "of 0.001 to 1000 mm, or a file");
  expect_said({"-o", "log.csv"},
              "-o log.csv: would overwrite log.csv, which PRESSURES reads; choose another name");
  put("log.csv", "p0,p1\n1,2\n");
  expect_said({"--time-column", "when"},
              "--time-column when: no table has this column; give its name");
  put("log.csv", frames);
  expect_said({"--poses", "poses.csv", "--time-column", "stmap"},
              "--time-column stmap: no table has this column; give its name");
}

// 200,000 frames: 7 MB of text and 6 MB of pressures.
TEST_F(ImportCommand, LongLogsTakeLittleMemory) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer holds memory of its own";
#endif
  const auto largest_kib = [] {
    rusage usage{};
    ::getrusage(RUSAGE_CHILDREN, &usage);
    return usage.ru_maxrss;
  };
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

}  // namespace
}  // namespace palpate
