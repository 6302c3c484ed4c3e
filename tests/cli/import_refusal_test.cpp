#include "import_command.hpp"

namespace palpate::import_refusal_test {

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
             "agree; the header there is 'time_ns', 'p0', 'p1'"},
        Case{"no_corner",
             "log.csv",
             frames,
             {"--first-element", "left"},
             "--first-element left: give bottom-left, bottom-right, top-left or top-right: x grows "
             "to the right, y upwards"},
        Case{"no_order", "log.csv", frames, {"--order", "x"}, "--order x: give rows or columns"},
        Case{"an_order_of_a_file",
             "array.csv",
             "x,y\n0,0\n2,0\n",
             {"--array", "array.csv", "--order", "columns"},
             "--order: is for a grid, COLUMNS:ROWS:PITCH; the elements of a file or of a program "
             "have their places"},
        Case{"a_corner_of_a_file",
             "array.csv",
             "x,y\n0,0\n2,0\n",
             {"--array", "array.csv", "--first-element", "top-left"},
             "--first-element: is for a grid, COLUMNS:ROWS:PITCH; the elements of a file or of a "
             "program have their places"},
        Case{
            "no_such_dead_element",
            "log.csv",
            frames,
            {"--dead", "0,2"},
            "--dead 0,2: '2' is no element; count them from 0 to 1 in the order of their readings"},
        Case{"no_element_at_all",
             "log.csv",
             frames,
             {"--dead", "1,"},
             "--dead 1,: '' is no element; count them from 0 to 1 in the order of their readings"},
        Case{"more_columns",
             "log.csv",
             "time,p0,p1,p2\n0,1,2,3\n",
             {},
             "log.csv:1: 3 columns of pressure ('p0' to 'p2') for an array of 2 elements; correct "
             "--array, or name the columns by --pressure-columns; the header there is 'time', "
             "'p0', 'p1', 'p2'"},
        Case{"sorted_as_text",
             "log.csv",
             "time,p10,p2\n0,1,2\n",
             {},
             "log.csv:1: column 'p2' comes after 'p10'; order the columns as the array's elements; "
             "the "
             "header there is 'time', 'p10', 'p2'"},
        Case{"of_one_number",
             "log.csv",
             "time,p1,p01\n0,1,2\n",
             {},
             "log.csv:1: column 'p01' comes after 'p1'; order the columns as the array's elements; "
             "the "
             "header there is 'time', 'p1', 'p01'"},
        Case{"no_pose_known",
             "poses.csv",
             "time,x_mm,y_mm,theta_rad\n0,,,\n0.1,,,\n",
             {"--poses", "poses.csv"},
             "poses.csv: holds no pose; write x, y and theta where they are known"},
        Case{"no_such_columns",
             "log.csv",
             frames,
             {"--pressure-columns", "q"},
             "log.csv:1: no column is called or begins with 'q'; give --pressure-columns names or "
             "numbers of columns, FIRST:LAST, START::STEP or a pattern such as *_fz or p{n}; the "
             "header there is 'time', 'p0', 'p1'"},
        Case{"columns_back_to_front",
             "log.csv",
             frames,
             {"--pressure-columns", "p1:p0"},
             "log.csv:1: column 'p0' comes before 'p1'; give --pressure-columns FIRST:LAST; the "
             "header "
             "there is 'time', 'p0', 'p1'"},
        Case{"times_as_pressures",
             "log.csv",
             frames,
             {"--pressure-columns", "time:p0"},
             "log.csv:1: column 'time', between 'time' and 'p0', holds something else; correct "
             "--pressure-columns FIRST:LAST; the header there is 'time', 'p0', 'p1'"},
        Case{"a_temperature_is_no_time",
             "log.csv",
             "T,p0,p1\n20,1,2\n",
             {"--pressure-columns", "p"},
             "log.csv: its rows are touches, and each needs a pose; give --poses, or --unposed "
             "where the poses are unknown, or for a stream of frames a column 'time' or --rate"},
        Case{"touches_without_their_poses",
             "log.csv",
             "x,y,theta,p0,p1\n0,0,0,1,2\n",
             {},
             "log.csv: its rows are touches, and each needs a pose; give --poses log.csv, or "
             "--unposed where the poses are unknown, or for a stream of frames a column 'time' or "
             "--rate"},
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
             "it, or name it by --time-column; the header there is 'element', 'pressure'"},
        Case{"touches_without_poses",
             "log.csv",
             "p0,p1\n1,2\n",
             {},
             "log.csv: its rows are touches, and each needs a pose; give --poses, or --unposed "
             "where the poses are unknown, or for a stream of frames a column 'time' or --rate"},
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
        Case{"half_a_pose", "poses.csv", "time,x,y,theta\n0,1,,3\n", with_poses,
             "poses.csv:2: a part of the pose is empty: 'y'; write all 3 numbers, or leave all "
             "empty"},
        Case{
            "a_far_pose", "poses.csv", "time,x_m,y_m,theta\n0,2e6,0,0\n", with_poses,
            "poses.csv:2: column 'x_m': 2000000 m is further than any robot gets; check the number "
            "and its unit"},
        Case{
            "no_angle", "poses.csv", "time,x,y\n0,1,2\n", with_poses,
            "poses.csv:1: has no columns 'x', 'y' and 'theta'; rename its columns, or name them by "
            "--pose-columns: X,Y,THETA, or in space X,Y,Z,ROLL,PITCH,YAW or TX,TY,TZ,QX,QY,QZ,QW; "
            "the header there is 'time', 'x', 'y'"},
        Case{"no_rotation", "poses.csv",
             "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0,0,0,0,1,1\n", with_poses,
             "poses.csv:3: the quaternion's length is 1.414, so that it is no rotation; write qx, "
             "qy, qz and qw in this order, of length 1"},
        Case{"a_part_of_a_pose_in_space", "poses.csv",
             "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,,0,0,0,1\n", with_poses,
             "poses.csv:2: a part of the pose is empty: 'tz'; write all 7 numbers, or leave all "
             "empty"},
        Case{"looks_everywhere", "poses.csv",
             "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n0.1,0,0,0,1,0,0,0\n", with_poses,
             "--plane: missing; the sensor's z axis points in unlike directions, so that the poses "
             "do not tell the plane of the touches: give its normal, such as 0,0,1"},
        Case{"a_plane_of_plane_poses",
             "log.csv",
             frames,
             {"--poses", "poses.csv", "--plane", "0,0,1"},
             "--plane 0,0,1: is for poses in space; poses.csv has x, y and theta"},
        Case{
            "an_array_of_one_column",
            "a.txt",
            "1\n2\n",
            {"--array", "a.txt"},
            "a.txt:1: no column is called 'x'; write a row 'x y' in mm for each element; the first "
            "row there is '1'"},
        Case{"a_long_table_with_poses",
             "log.csv",
             "time,element,pressure,x,y,theta\n0,0,1,0,0,0\n0,1,1,0,0,0\n",
             {"--poses", "log.csv"},
             "log.csv: has 2 rows of readings for 1 frames or touches; give the poses in a table "
             "of their own, with a row for each"},
        Case{"a_sideways_array", "poses.csv",
             "time_s,x_mm,y_mm,roll_deg,pitch_deg,yaw_deg\n0,0,0,0,90,0\n", with_poses,
             "poses.csv:2: column 'pitch_deg': the array is turned by 90 degrees out of the xy "
             "plane, which x, y and an angle do not tell; name all columns of the pose by "
             "--pose-columns, such as x,y,z,roll,pitch,yaw"},
        Case{"a_rotation_vector_of_a_tool_that_points_down",
             "poses.csv",
             "time,x,y,z,rx,ry,rz\n0,0,0,5,2.2,2.2,0\n",
             {"--poses", "poses.csv", "--pose-columns", "x,y,rz"},
             "poses.csv:2: column 'rx': the array is turned by 126 degrees out of the xy plane, "
             "which x, y and an angle do not tell; name all columns of the pose by --pose-columns, "
             "such as x,y,z,roll,pitch,yaw"},
        Case{
            "binary",
            "log.csv",
            std::string("\0\1\2", 3),
            {},
            "log.csv: is no text; save the table as CSV in UTF-8; palpate.Recording takes arrays"}),
    [](const auto& test) { return test.param.name; });

TEST_F(ImportCommand, FlagsNameTheirForm) {
  expect_said({"--pose-unit", "cm,rad"},
              "--pose-unit cm,rad: give mm,rad or mm,deg or m,rad or m,deg");
  expect_said({"--time-unit", "h"}, "--time-unit h: give s, ms, us or ns");
  expect_said({"--pressure-unit", "psi"}, "--pressure-unit psi: give kPa or raw");
  expect_said({"--rows", "rows"}, "--rows rows: give frames or touches");
  expect_said({"--rate", "5"}, "--rate 5: log.csv has times; leave it out");
  expect_said({"--rate", "0"}, "--rate 0: give 0.001 to 1000000 Hz");
  expect_said({"--rate", "1e-300"}, "--rate 1e-300: give 0.001 to 1000000 Hz");
  expect_said({"--rate", "1e300"}, "--rate 1e+300: give 0.001 to 1000000 Hz");
  expect_said({"--largest-gap-s", "0"}, "--largest-gap-s 0: give seconds above 0");
  expect_said({"--plane", "0,0"},
              "--plane 0,0: give auto, or the plane's normal in the robot frame, such as 0,0,1");
  expect_said({"--plane", "0,0,0"},
              "--plane 0,0,0: give auto, or the plane's normal in the robot frame, such as 0,0,1");
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

}  // namespace palpate::import_refusal_test
