"""`palpate import` reads tables as laboratories write them: each case is a table of the shape that its name
says, the flags that it takes, the recording that it makes and what the command says of it. What it refuses,
it names by place and field, in one line and without a file."""

import dataclasses
import math
import pathlib
import subprocess
from typing import Any

import numpy
import pytest
from conftest import run

import palpate

NAN = math.nan
PRESSURES = "time,p0,p1\n0,1,2\n0.1,3,4\n"
READINGS = [[1, 2], [3, 4]]
DOWN = 0.5**0.5  # of a quaternion of a quarter turn
Files = dict[str, "str | bytes"]  #: by their names; a text alone is that of log.csv


@dataclasses.dataclass
class Case:
    files: "Files | str | bytes"
    flags: list[str]
    readings: Any = None
    times: Any = None
    poses: Any = None
    said: list[str] = dataclasses.field(default_factory=list)
    array: str = "2:1:2"


def poses(header: str, *rows: str) -> Files:
    text = "time," + header + "\n" + "".join(f"{i / 10},{row}\n" for i, row in enumerate(rows))
    return {"log.csv": PRESSURES, "poses.csv": text}


WITH_POSES = ["--poses", "poses.csv"]
# The same two poses in every form: the array looks along z, at (10, 20) mm, turned by 0 and by a quarter.
TWO_POSES = [[10, 20, 0], [10, 20, math.pi / 2]]
MATRIX_ROWS = ("1,0,0,10,0,1,0,20,0,0,1,5", "0,-1,0,10,1,0,0,20,0,0,1,5")
MATRIX_COLUMNS = ("1,0,0,0,0,1,0,0,0,0,1,0,.01,.02,.005,1", "0,1,0,0,-1,0,0,0,0,0,1,0,.01,.02,.005,1")
UR = ",".join(f"actual_TCP_pose_{i}" for i in range(6))
LIBFRANKA = ",".join(f"O_T_EE[{i}]" for i in range(16))

READ = {
    # Poses.
    "roll_pitch_yaw": Case(poses("x,y,z,roll_deg,pitch_deg,yaw_deg", "10,20,5,0,0,0", "10,20,5,0,0,90"), WITH_POSES,
        poses=TWO_POSES,
        said=["poses.csv: its poses are x, y, z and angles about the fixed axes xyz one after another (--euler), "
        "columns 'x' to 'yaw_deg', in mm and deg"]),
    "a_tool_that_points_down": Case(poses("x,y,z,roll_deg,pitch_deg,yaw_deg", "10,20,5,180,0,0", "10,20,5,180,0,90"),
        WITH_POSES, poses=TWO_POSES, said=["the array looks against the plane's normal"]),
    "other_axes": Case(poses("a,b,c,rz,ry,rx", "10,20,5,0,0,180", "10,20,5,90,0,180"),
        [*WITH_POSES, "--pose-columns", "a:rx", "--euler", "ZYX", "--pose-unit", "mm,deg"], poses=TWO_POSES,
        said=["angles about the moving axes ZYX"]),
    "angles_of_names_turn_about_their_axes": Case(poses("x,y,z,yaw,pitch,roll", "10,20,5,0,0,0",
        f"10,20,5,{math.pi / 2},0,0"), [*WITH_POSES, "--euler", "ZYX"], poses=TWO_POSES),
    "angles_called_as_a_vector": Case(poses("x,y,z,rx,ry,rz", "10,20,5,180,0,0", "10,20,5,180,0,90"),
        [*WITH_POSES, "--euler", "xyz", "--pose-unit", "mm,deg"], poses=TWO_POSES),
    "a_vector_whose_columns_are_named_otherwise": Case(poses("x,y,z,roll,pitch,yaw", f"10,20,5,{math.pi},0,0",
        f"10,20,5,{math.pi / 2**.5},{math.pi / 2**.5},0"), [*WITH_POSES, "--euler", "vector"], poses=TWO_POSES),
    "rotation_vector": Case(poses("x,y,z,rx,ry,rz", "10,20,5,0,0,0", f"10,20,5,0,0,{math.pi / 2}"), WITH_POSES,
        poses=TWO_POSES, said=["its poses are x, y, z and a rotation vector, columns 'x' to 'rz', in mm and rad"]),
    "universal_robots": Case(poses(UR, ".01,.02,.005,0,0,0",
        f".01,.02,.005,0,0,{math.pi / 2}"), WITH_POSES, poses=TWO_POSES,
        said=["a rotation vector, columns 'actual_TCP_pose_0' to 'actual_TCP_pose_5', in m and rad"]),
    "universal_robots_in_a_given_unit": Case(poses(UR, "10,20,5,0,0,0", "10,20,5,0,0,90"),
        [*WITH_POSES, "--pose-unit", "mm,deg"], poses=TWO_POSES),
    "universal_robots_by_number": Case(poses(UR, ".01,.02,.005,0,0,0", f".01,.02,.005,0,0,{math.pi / 2}"),
        [*WITH_POSES, "--pose-columns", "2:7"], poses=TWO_POSES),
    "libfranka": Case(poses(LIBFRANKA, *MATRIX_COLUMNS), WITH_POSES, poses=TWO_POSES,
        said=["its poses are matrices written by columns (--matrix), columns 'O_T_EE[0]' to 'O_T_EE[15]', in m"]),
    "matrices_by_rows": Case(poses(",".join(f"t{i}" for i in range(12)), *MATRIX_ROWS),
        [*WITH_POSES, "--pose-columns", "t{n}"], poses=TWO_POSES, said=["matrices written by rows"]),
    "a_matrix_that_is_rounded": Case(poses(",".join(f"t{i}" for i in range(16)), MATRIX_ROWS[0] + ",1e-17,0,0,1",
        MATRIX_ROWS[1] + ",0,1e-17,0,1"), [*WITH_POSES, "--pose-columns", "t*"], poses=TWO_POSES),
    "a_quaternion_whose_w_is_first": Case(poses("x,y,z,qw,qx,qy,qz", "10,20,5,1,0,0,0", f"10,20,5,{DOWN},0,0,{DOWN}"),
        [*WITH_POSES, "--pose-columns", "x:qz"], poses=TWO_POSES,
        said=["poses.csv: its poses are x, y, z and a quaternion x, y, z, w, columns 'x' to 'qw', in mm"]),
    "quaternions_of_rostopic": Case(
        poses("field.pose.position.x,field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
        "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w",
        "10,20,5,0,0,0,1", f"10,20,5,0,0,{DOWN},{DOWN}"), WITH_POSES, poses=TWO_POSES),
    "a_quaternion_of_zeros_is_no_pose": Case(
        {"log.csv": PRESSURES, "poses.csv": "time,tx,ty,tz,qx,qy,qz,qw\n0,10,20,5,0,0,0,1\n.1,0,0,0,0,0,0,0\n"},
        WITH_POSES, poses=[[10, 20, 0], [NAN] * 3], said=["1 of its poses are unknown, as their quaternion is"]),
    "names_before_a_short_table": Case({"log.csv": PRESSURES,
        "poses.csv": "Robot: A\nBy: B\nAt: C\nOn: D\ntime,x,y,theta\n0,10,20,0\n.1,10,20,0\n"}, WITH_POSES,
        poses=[[10, 20, 0]] * 2, said=["poses.csv: 4 lines before line 5 ('time', 'x', 'y', 'theta') are left out\n"]),
    "a_mount_beside_the_flange": Case(poses("x,y,theta", "10,20,0", f"10,20,{math.pi / 2}"),
        [*WITH_POSES, "--mount", "5,0,30,0,0,90"], poses=[[15, 20, math.pi / 2], [10, 25, math.pi]]),
    "a_pad_sideways_on_a_finger": Case(poses("x,y,z,roll_deg,pitch_deg,yaw_deg", "10,20,5,0,90,0", "10,20,5,0,90,0"),
        [*WITH_POSES, "--mount", "0,0,0,0,-90,0"], poses=[[10, 20, 0]] * 2),
    # Columns.
    "columns_by_pattern": Case("time,p10_fz,p2_fz,p2_fx\n0,2,1,9\n.1,4,3,9\n", ["--pressure-columns", "p{n}_fz"],
        READINGS, said=["its readings are 2 columns, 'p2_fz' to 'p10_fz'"]),
    "columns_by_star": Case("time,a_fz,a_fx,b_fz\n0,1,9,2\n.1,3,9,4\n", ["--pressure-columns", "*_fz"], READINGS),
    "every_third_column": Case("time,x0,y0,z0,x1,y1,z1\n0,8,9,1,8,9,2\n.1,8,9,3,8,9,4\n",
        ["--pressure-columns", "4::3"], READINGS),
    "numbers_of_columns_with_a_header": Case("when,c,a,b\n0,9,1,2\n.1,9,3,4\n",
        ["--pressure-columns", "3:4", "--time-column", "1"], READINGS, times=[0, 0.1]),
    "numbers_of_each_table": Case({"log.csv": "0,1,2\n.1,3,4\n", "poses.csv": "0,9,10,20,0\n.1,9,10,20,0\n"},
        [*WITH_POSES, "--pressure-columns", "2,3", "--pose-columns", "3:5", "--time-column", "1"], READINGS,
        poses=[[10, 20, 0]] * 2),
    "the_z_of_three_axes": Case("time,x0,x1,y0,y1,z0,z1\n0,8,8,9,9,1,2\n.1,8,8,9,9,3,4\n",
        ["--pressure-component", "z"], READINGS,
        said=["its readings are the z of x, y and z of each element, of the first 'x0', 'y0' and 'z0'"]),
    "the_length_of_three_axes": Case("0,2,3,6,0,3,4\n.1,0,0,1,0,0,2\n",
        ["--pressure-component", "norm", "--pressure-columns", "2:7",
        "--time-column", "1"], [[7, 5], [1, 2]]),
    "two_pads_of_a_hand_are_one_array": Case({"log.csv": "time,left_0,right_0,left_1,pad\n0,1,2,3,9\n.1,4,5,6,9\n",
        "hand.csv": "x,y\n-10,0\n-8,0\n9,0\n"}, ["--pressure-columns", "left_{n},right_{n}"], [[1, 3, 2], [4, 6, 5]],
        array="hand.csv"),
    "rows_of_which_two_columns_hold": Case(
        "time,id,side,p0,p1\n0,2,left,1,2\n0,2,right,9,9\n.1,1,left,9,9\n.1,2.0,left,3,4\n",
        ["--where", "id=2", "--where", "side=left"], READINGS, times=[0, 0.1]),
    "rows_of_the_pressures_by_number": Case({"log.csv": "time,id,p0,p1\n0,2,1,2\n0,1,9,9\n.1,2,3,4\n",
        "poses.csv": "time,x,y,theta\n0,10,20,0\n.1,2,20,0\n"}, [*WITH_POSES, "--where", "2=2"], READINGS,
        poses=[[10, 20, 0], [2, 20, 0]]),
    "poses_beside_single_readings": Case(
        "time,element,pressure,x,y,theta\n0,0,1,10,20,0\n0,1,2,10,20,0\n.1,0,3,2,20,0\n.1,1,4,2,20,0\n",
        ["--poses", "log.csv"], READINGS, poses=[[10, 20, 0], [2, 20, 0]]),
    "an_order_that_is_given": Case("time,p1,p0\n0,2,1\n.1,4,3\n", ["--pressure-columns", "p1,p0"],
        [row[::-1] for row in READINGS]),
    "one_of_two_columns_of_readings": Case("time,element,pressure,raw\n0,0,9,1\n0,1,9,2\n.1,0,9,3\n.1,1,9,4\n",
        ["--pressure-columns", "raw"], READINGS),
    "a_time_for_each_reading": Case("frame,t,Element,Pressure [kPa]\n0,0,0,1\n0,0.01,1,2\n1,0.1,0,3\n1,0.11,1,4\n",
        [], READINGS, times=[0, 0.1]),
    "names_and_labels_with_a_number_sign": Case(
        "time,Taxel #0,Taxel #1,label\n0,1,2,mug #2\n.05,9,9,mug #1\n.1,3,4,mug #2\n",
        ["--where", "label=mug #2"], READINGS),
    # Sheets.
    "lines_before_the_header": Case("Tactile array 5\nRecorded 2026-11-01, by hand\n\ntime,p0,p1\n0,1,2\n.1,3,4\n",
        [], READINGS, said=["log.csv: 2 lines before line 4 ('time', 'p0', 'p1') are left out (--header-line)"]),
    "lines_filled_up_by_a_spreadsheet": Case("Device,5,,\nOperator,A,,\ntime,p0,p1,\n0,1,2,\n.1,3,4,\n", [], READINGS,
        said=["2 lines before line 3"]),
    "a_header_line_that_is_given": Case("a,a,c\nwhen,p0,p1\n0,1,2\n.1,3,4\n",
        ["--header-line", "2", "--time-column", "when"], READINGS, times=[0, 0.1]),
    "a_short_table_below_more_lines": Case("K;0\nK;1\nK;2\nK;3\ntime;p0;p1\n0;1;2\n0,1;3;4\n", [], READINGS,
        said=["4 lines before line 5 ('time', 'p0', 'p1')"]),
    "numbers_before_the_header": Case("2,1\ntime,p0,p1\n0,1,2\n.1,3,4\n", [], READINGS, times=[0, 0.1]),
    "an_empty_row_before_the_header": Case(";;\ntime;p0;p1\n0;1;2\n0,1;3;4\n", [], READINGS, times=[0, 0.1]),
    "sep_and_decimal_commas": Case("sep=;\r\ntime;p0;p1\r\n0;1,0;2\r\n0,1;3;4\r\n", [], READINGS, times=[0, 0.1]),
    "decimal_commas_between_blanks": Case("time p0 p1\n0,0 1,0 2\n0,1 3 4 # last\n", [], READINGS, times=[0, 0.1]),
    "utf_16": Case("time\tp0\tp1\r\n0\t1\t2\r\n0,1\t3\t4\r\n".encode("utf-16"), [], READINGS, times=[0, 0.1]),
    "utf_16_big_endian": Case(b"\xfe\xff" + "time,p0 \U0001f446 \ud83d,p1\n0,1,2\n.1,3,4\n".encode("utf-16-be",
        "surrogatepass"), [], READINGS, times=[0, 0.1]),
    "units_in_brackets": Case("Time [ms],p0 [kPa],p1 [kPa]\n0,1,2\n100,3,4\n", [], READINGS, times=[0, 0.1]),
    "iso_8601": Case("time,p0,p1\n1970-01-02T00:00:01.5+01:00,1,2\n1970-01-01T23:00:02Z,3,4\n", [], READINGS,
        times=[86400 - 3600 + 1.5, 86400 - 3600 + 2]),
    "times_of_day_past_midnight": Case("time,p0,p1\n23:59:59.5,1,2\n00:00:00,3,4\n", [], READINGS,
        times=[86399.5, 86400]),
    "frames_as_blocks": Case("Frame 1\n1,2\n3,4\n\nFrame 2\n5,6\n7,8\n", ["--rows", "frames", "--rate", "10"],
        [[1, 2, 3, 4], [5, 6, 7, 8]], times=[0, 0.1], array="2:2:2",
        said=["its frames are blocks of 2 rows of 2 readings"]),
    # Times.
    "poses_at_one_time": Case(
        {"log.csv": PRESSURES, "poses.csv": "time,x,y,theta\n0,,,\n0,10,20,0\n0,99,99,0\n.1,10,20,0\n"}, WITH_POSES,
        poses=[[10, 20, 0]] * 2, said=["1 of its rows repeat the time of the row before, whose pose is kept"]),
    "a_clock_of_another_name": Case({"log.csv": PRESSURES, "poses.csv": "clock,x,y,theta\n.1,10,20,0\n.2,99,99,0\n"},
        WITH_POSES, poses=[[NAN] * 3, [10, 20, 0]],
        said=["poses.csv: its column 'clock' is taken for its times, in s (--time-column)"]),
    "poses_that_are_counted": Case({"log.csv": PRESSURES, "poses.csv": "frame,x,y,theta\n0,10,20,0\n1,10,20,0\n"},
        WITH_POSES, poses=[[10, 20, 0]] * 2, said=["its poses have no times (--time-column), and are taken"]),
    "a_unit_of_the_other_times": Case({"log.csv": "time,p0,p1\n0,1,2\n100,3,4\n",
        "poses.csv": "time_s,x,y,theta\n0,10,20,0\n.1,10,20,0\n"}, [*WITH_POSES, "--time-unit", "ms"], READINGS,
        times=[0, 0.1], poses=[[10, 20, 0]] * 2),
    "readings_at_one_time": Case("time,p0,p1\n0,1,2\n0,9,9\n.1,3,4\n", [], READINGS,
        said=["1 of its rows repeat the time of the row before, whose readings are kept"]),
    "a_step_back_over_midnight": Case(
        "time,p0,p1\n23:59:59.5,1,2\n00:00:00,3,4\n23:59:59.75,1,2\n23:59:59.5,3,4\n", [], READINGS * 2,
        times=[86399.5, 86400, 86410, 86420], said=["back from 86400 to 86399.75 s, as at lines 4, 5 (2 times)"]),
    "a_delay_in_one_file": Case("time,p0,p1,x,y,z,roll,pitch,yaw\n0,1,2,0,20,5,0,0,0\n.1,3,4,10,20,5,0,0,0\n",
        ["--poses", "log.csv", "--pose-delay", "-.05", "--pose-unit", "mm,rad"], poses=[[NAN] * 3, [5, 20, 0]]),
    "a_clock_that_steps_back": Case({"log.csv": "time,p0,p1\n5,1,2\n6,3,4\n0.5,1,2\n1.5,3,4\n",
        "poses.csv": "time,x,y,theta\n5,1,1,0\n6,1,1,0\n0,2,2,0\n2,2,2,0\n"}, [*WITH_POSES, "--largest-gap-s", "3"],
        READINGS * 2, times=[5, 6, 16.5, 17.5], poses=[[1, 1, 0]] * 2 + [[2, 2, 0]] * 2,
        said=["log.csv:4: the clock steps back from 6 to 0.5 s; a new stretch begins there, 10 s after the last"]),
}  # fmt: skip

#: What a refused import has where its case says nothing else.
SOUND: Files = {
    "log.csv": "time,p0,p1\n0,1,2\n0.05,3,4\n0.1,5,6\n",
    "poses.csv": "time,x_mm,y_mm,theta_rad\n0,0,5,-1\n0.1,10,7,1\n",
}
#: Files, flags, and what the line says.
REFUSED: dict[str, tuple["Files | str | bytes", list[str], str]] = {
    "no_time": ("time,p0,p1\n,1,2\n", [], "log.csv:2: column 'time' is empty"),
    "nanoseconds": ("time,p0,p1\n1700000000000000000,1,2\n", [], "log.csv:2: column 'time': 1.7e+18 s is no time"),
    "two_units": ("time_ns,p0,p1\n1,1,2\n", ["--time-unit", "s"],
        "log.csv:1: column 'time_ns' is in ns by its name, in s by --time-unit"),
    "no_corner": ({}, ["--first-element", "left"], "--first-element left: give bottom-left"),
    "no_order": ({}, ["--order", "x"], "--order x: give rows or columns"),
    "an_order_of_a_file": ({"array.csv": "x,y\n0,0\n2,0\n"}, ["--array", "array.csv", "--order", "columns"],
        "--order: is for a grid, COLUMNS:ROWS:PITCH"),
    "a_corner_of_a_file": ({"array.csv": "x,y\n0,0\n2,0\n"}, ["--array", "array.csv", "--first-element", "top-left"],
        "--first-element: is for a grid, COLUMNS:ROWS:PITCH"),
    "no_such_dead_element": ({}, ["--dead", "0,2"], "--dead 0,2: '2' is no element"),
    "more_columns": ("time,p0,p1,p2\n0,1,2,3\n", [],
        "log.csv:1: 3 columns of pressure ('p0' to 'p2') for an array of 2 elements"),
    "sorted_as_text": ("time,p10,p2\n0,1,2\n", [], "log.csv:1: column 'p2' comes after 'p10'"),
    "sorted_as_text_with_an_end": ("time,p10_z,p2_z\n0,1,2\n", [], "log.csv:1: column 'p2_z' comes after 'p10_z'"),
    "rows_sorted_as_text": ("time,r10_c1,r2_c0\n0,1,2\n", [], "log.csv:1: column 'r2_c0' comes after 'r10_c1'"),
    "axes_sorted_as_text": ("time,x10,x2,y10,y2,z10,z2\n0,1,2,3,4,5,6\n", ["--pressure-component", "z"],
        "log.csv:1: column 'z2' comes after 'z10'"),
    "an_axis_of_one_reading": ("time,element,pressure\n0,0,1\n", ["--pressure-component", "z"],
        "log.csv:1: --pressure-component z: each row holds one reading; leave it out"),
    "columns_of_blocks": ("1,2\n3,4\n", ["--rows", "frames", "--rate", "1", "--array", "2:2:2", "--where", "1=1"],
        "log.csv:1: its frames are blocks of rows, which are read whole; leave out --where"),
    "a_fault_of_a_spreadsheet": ("time\tp0\tp1\n0\t1\t#DIV/0!\n", [], "log.csv:2: column 'p1': '#DIV/0!' is not"),
    "poses_of_the_next_day": ({"poses.csv": "time,x,y,theta\n86400,1,2,3\n"}, WITH_POSES,
        "where midnight lies between them, give --pose-delay 86400"),
    "of_one_number": ("time,p1,p01\n0,1,2\n", [], "log.csv:1: column 'p01' comes after 'p1'"),
    "no_pose_known": ({"poses.csv": "time,x_mm,y_mm,theta_rad\n0,,,\n0.1,,,\n"}, WITH_POSES,
        "poses.csv: holds no pose"),
    "no_such_columns": ({}, ["--pressure-columns", "q"], "log.csv:1: no column is called or begins with 'q'"),
    "columns_back_to_front": ({}, ["--pressure-columns", "p1:p0"], "log.csv:1: column 'p0' comes before 'p1'"),
    "times_as_pressures": ({}, ["--pressure-columns", "time:p0"],
        "log.csv:1: column 'time', between 'time' and 'p0', holds something else"),
    "a_temperature_is_no_time": ("T,p0,p1\n20,1,2\n", ["--pressure-columns", "p"], "log.csv: its rows are touches"),
    "touches_without_their_poses": ("x,y,theta,p0,p1\n0,0,0,1,2\n", [], "log.csv: its rows are touches"),
    "a_bad_cell_in_the_first_row": ("0,1,NA\n1,2,3\n", [], "log.csv:1: column '3': 'NA' is not a finite number"),
    "header_alone": ("time,p0,p1\n", [], "log.csv: holds a header and no row"),
    "nothing_read": ("time,p0,p1\n0,,\n", [], "log.csv: holds no reading of a living element"),
    "no_such_element": ("time,element,pressure\n0,2,1\n", [], "log.csv:2: column 'element': 2 is no element"),
    "element_twice": ("frame,element,pressure\n0,1,1\n0,1,1\n", WITH_POSES,
        "log.csv:3: element 1 has two readings in one frame"),
    "no_frame": ("element,pressure\n0,1\n", [],
        "log.csv:1: a table with a row for each reading needs a column 'time' or 'frame'"),
    "touches_without_poses": ("p0,p1\n1,2\n", [], "log.csv: its rows are touches"),
    "frames_without_times": ("p0,p1\n1,2\n", ["--rows", "frames"], "log.csv: frames need times"),
    "poses_alone_have_times": ("p0,p1\n1,2\n", WITH_POSES, "poses.csv: has times, log.csv has none"),
    "fewer_poses": ({"poses.csv": "x,y,theta\n1,2,3\n"}, WITH_POSES,
        "poses.csv: holds 1 poses without a time for 3 frames or touches of log.csv"),
    "a_touch_without_a_pose": ({"poses.csv": "time,x,y,theta\n0,1,2,3\n0.05,1,2,3\n"},
        [*WITH_POSES, "--rows", "touches"],
        "poses.csv: has no pose for row 2 of log.csv, counted from 0, at 0.1 s, and a touch needs one"),
    "half_a_pose": ({"poses.csv": "time,x,y,theta\n0,1,,3\n"}, WITH_POSES,
        "poses.csv:2: a part of the pose is empty: 'y'"),
    "a_far_pose": ({"poses.csv": "time,x_m,y_m,theta\n0,2e6,0,0\n"}, WITH_POSES,
        "poses.csv:2: column 'x_m': 2000000 m is further than any robot gets"),
    "no_angle": ({"poses.csv": "time,x,y\n0,1,2\n"}, WITH_POSES, "poses.csv:1: has no columns 'x', 'y' and 'theta'"),
    "no_rotation": ({"poses.csv": "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0,0,0,0,1,1\n"}, WITH_POSES,
        "poses.csv:3: the quaternion's length is 1.414"),
    "a_part_of_a_pose_in_space": ({"poses.csv": "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,,0,0,0,1\n"}, WITH_POSES,
        "poses.csv:2: a part of the pose is empty: 'tz'"),
    "looks_everywhere": ({"poses.csv": "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n0.1,0,0,0,1,0,0,0\n"}, WITH_POSES,
        "--plane: missing"),
    "a_plane_of_plane_poses": ({}, [*WITH_POSES, "--plane", "0,0,1"], "--plane 0,0,1: is for poses in space"),
    "an_array_of_one_column": ({"a.txt": "1\n2\n"}, ["--array", "a.txt"], "a.txt:1: no column is called 'x'"),
    "a_long_table_of_poses_without_times": ("frame,element,pressure,x,y,theta\n0,0,1,0,0,0\n0,1,1,0,0,0\n",
        ["--poses", "log.csv"], "log.csv: holds 2 poses without a time for 1 frames or touches of log.csv"),
    "a_unit_that_is_not_read": ("elapsed [min],p0,p1\n0,1,2\n", ["--time-column", "1"],
        "log.csv:1: column 'elapsed [min]' is in min by its name; convert it to s, or give --time-unit"),
    "angles_of_no_angles": ({}, [*WITH_POSES, "--euler", "xyz"],
        "poses.csv: its poses are of another form than --euler or --matrix is for"),
    "a_matrix_of_no_matrices": ({}, [*WITH_POSES, "--matrix", "rows"],
        "poses.csv: its poses are of another form than --euler or --matrix is for"),
    "angles_of_no_poses": ({}, ["--euler", "xyz"], "--euler xyz: is for poses; give --poses"),
    "a_sideways_array": ({"poses.csv": "time_s,x_mm,y_mm,roll_deg,pitch_deg,yaw_deg\n0,0,0,0,90,0\n"}, WITH_POSES,
        "poses.csv:2: column 'pitch_deg': the array is turned by 90 degrees out of the xy plane"),
    "a_rotation_vector_of_a_tool_that_points_down": ({"poses.csv": "time,x,y,z,rx,ry,rz\n0,0,0,5,2.2,2.2,0\n"},
        [*WITH_POSES, "--pose-columns", "x,y,rz"],
        "poses.csv:2: column 'rx': the array is turned by 126 degrees out of the xy plane"),
    "no_rotation_by_row": (poses(",".join(f"t{i}" for i in range(12)), MATRIX_ROWS[0], "1,0,0,0,0,2,0,0,0,0,1,0"),
        [*WITH_POSES, "--pose-columns", "t*"],
        "poses.csv:3: the numbers are no rotation and position, read by rows; correct them, or give --matrix columns"),
    "a_matrix_that_may_be_either": (poses(",".join(f"t{i}" for i in range(16)), "0,1,0,0,-1,0,0,0,0,0,1,0,0,0,0,1"),
        [*WITH_POSES, "--pose-columns", "t*"],
        "poses.csv: its matrices may be written by columns or by rows; give --matrix columns or --matrix rows"),
    "four_columns_of_a_pose": (poses("a,b,c,d", "1,2,3,4"), [*WITH_POSES, "--pose-columns", "a:d"],
        "poses.csv:1: --pose-columns a:d names 4 columns; give three, X,Y,THETA, or of poses in space six "
        "(X,Y,Z,ROLL,PITCH,YAW, or a rotation vector), seven (TX,TY,TZ,QX,QY,QZ,QW), or the 12 or 16 numbers of a "
        "matrix; the header there is 'time', 'a', 'b', 'c', ..."),
    "no_axes": ({}, ["--euler", "xxy"], "--euler xxy: give the axes of the three angles in their order"),
    "no_mount": (poses("x,y,theta", "0,0,0"), [*WITH_POSES, "--mount", "1,2,3"],
        "--mount 1,2,3: give X,Y,Z,ROLL,PITCH,YAW"),
    "a_mount_of_no_poses": ({}, ["--mount", "1,2,3,0,0,0"], "--mount 1,2,3,0,0,0: is for poses; give --poses"),
    "no_sign": ({}, ["--sign", "2"], "palpate: --sign 2: give 1, or -1 where readings fall under load\n"),
    "unposed_beside_poses": ({}, [*WITH_POSES, "--unposed"], "--unposed: poses.csv holds the poses; leave one of them "
        "out\n"),
    "no_delay": ({}, [*WITH_POSES, "--pose-delay", "nan"], "--pose-delay nan"),
    "a_delay_of_no_times": ({"poses.csv": "x,y,theta\n0,0,0\n0,0,0\n0,0,0\n"}, [*WITH_POSES, "--pose-delay", "0.1"],
        "--pose-delay 0.1: poses.csv has no times"),
    "poses_too_far_apart": ({"poses.csv": "t,x,y,yaw\n0.01,1,2,3\n0.02,1,2,3\n0.07,1,2,3\n0.08,1,2,3\n"},
        [*WITH_POSES, "--largest-gap-s", "0.03"],
        "poses.csv: no row of log.csv finds a pose: its times are 0 to 0.1 s, the poses' are 0.01 to 0.08 s; check "
        "clocks and units, or raise --largest-gap-s"),
    "no_such_column_to_keep": ({}, ["--where", "id=2"], "--where id=2: no table has this column"),
    "no_such_header_line": ({}, ["--header-line", "9"], "--header-line 9: log.csv has no such line"),
    "three_axes_unsaid": ("time,x0,y0,z0,x1,y1,z1\n0,8,9,1,8,9,2\n", [],
        "log.csv:1: 6 columns of pressure ('x0' to 'z1') for an array of 2 elements; where each element reads x, y "
        "and z, give --pressure-component z or --pressure-component norm; the header there is 'time', 'x0', 'y0', "
        "'z0', ..."),
    "a_block_cut_short": ("Frame 1\n1,2\n3,4\nFrame 2\n5,6\n",
        ["--rows", "frames", "--rate", "10", "--array", "2:2:2"],
        "log.csv:5: the last frame has 1 rows, and the array has 2"),
    "blocks_unsaid": ("1,2\n3,4\n", ["--array", "2:2:2"],
        "where each frame is a block of rows, as the array has them, give --rows frames"),
    "one_clock_steps_back": ({"poses.csv": "time,x,y,theta\n1,0,0,0\n0,0,0,0\n"}, WITH_POSES,
        "poses.csv:3: 0 s is earlier than the row before, at 1 s, and the clock of log.csv does not step back with it"),
    "rows_that_are_not_sorted": ("time,p0,p1\n" + "1,1,2\n0,1,2\n" * 11, [],
        "and so are more than 10 rows; sort the rows by time"),
    "a_date_of_no_month": ("time,p0,p1\n2026-02-3012:00:00,1,2\n", [], "'2026-02-3012:00:00' is no time"),
    "a_time_beyond_the_day": ("time,p0,p1\n25:00:00,1,2\n", [], "log.csv:2: column 'time': '25:00:00' is no time"),
    # Flags alone.
    "unit_of_lengths": ({}, ["--pose-unit", "cm,rad"], "--pose-unit cm,rad: give mm,rad"),
    "unit_of_times": ({}, ["--time-unit", "h"], "--time-unit h: give s"),
    "unit_of_pressures": ({}, ["--pressure-unit", "psi"], "--pressure-unit psi: give kPa"),
    "kind_of_rows": ({}, ["--rows", "rows"], "--rows rows: give frames"),
    "rate_beside_times": ({}, ["--rate", "5"], "--rate 5: log.csv has times"),
    "rate_too_low": ({}, ["--rate", "1e-300"], "--rate 1e-300: give 0.001 to 1000000 Hz"),
    "rate_too_high": ({}, ["--rate", "1e300"], "--rate 1e+300: give 0.001"),
    "no_gap": ({}, ["--largest-gap-s", "0"], "--largest-gap-s 0: give seconds above 0"),
    "half_a_normal": ({}, ["--plane", "0,0"], "--plane 0,0: give auto"),
    "normal_of_no_length": ({}, ["--plane", "0,0,0"], "--plane 0,0,0: give auto"),
    "truth_without_a_label": ("time,p0,p1\nx,1,2\n", ["--truth", "1,2,3"], "--truth 1,2,3: give LABEL,X,Y,THETA"),
    "truth_of_an_empty_label": ({}, ["--truth", ",1,2,3"], "--truth ,1,2,3: give LABEL,X,Y,THETA"),
    "truth_too_far": ({}, ["--truth", "A,0,1e12,0"], "--truth A,0,1e12,0: is further than 1e+09 mm"),
    "array_without_columns": ({}, ["--array", "0:1:2"], "--array 0:1:2: give COLUMNS:ROWS:PITCH, with 1 to 1024"),
    "output_over_input": ({}, ["-o", "log.csv"], "-o log.csv: would overwrite log.csv, which PRESSURES reads"),
    "no_column_of_times": (poses("x,y,theta", "0,5,-1"), [*WITH_POSES, "--time-column", "stmap"],
        "log.csv:1: --time-column stmap: no table has this column; give its name; the header there is 'time', 'p0', "
        "'p1' (or give --header-line)"),
    "no_column_of_times_in_touches": ("p0,p1\n1,2\n", ["--time-column", "when"],
        "--time-column when: no table has this column"),
}  # fmt: skip


def imported(
    folder: pathlib.Path, files: "Files | str | bytes", flags: list[str]
) -> "subprocess.CompletedProcess[str]":
    given = files if isinstance(files, dict) else {"log.csv": files}
    for name, text in {"log.csv": PRESSURES, **given}.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    array = [] if "--array" in flags else ["--array", "2:1:2"]
    output = [] if "-o" in flags else ["-o", "o.h5"]
    return run("import", "log.csv", *array, *output, *flags, cwd=folder)


def expect_refused(done: "subprocess.CompletedProcess[str]", said: str) -> None:
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert said in done.stderr


@pytest.mark.parametrize("name", READ)
def test_a_log_is_read(name: str, tmp_path: pathlib.Path) -> None:
    case = READ[name]
    done = imported(tmp_path, case.files, ["--array", case.array, *case.flags])
    assert done.returncode == 0, done.stderr
    recording = palpate.read_recording(tmp_path / "o.h5")
    for given, expected in (
        (recording.pressure, case.readings),
        (recording.time_s, case.times),
        (recording.T_robot_sensor, case.poses),
    ):
        if expected is not None:
            assert given == pytest.approx(numpy.array(expected), nan_ok=True, abs=1e-9)
    for words in case.said:
        assert words in done.stderr
    assert len(done.stderr.splitlines()) <= 6


@pytest.mark.parametrize("name", REFUSED)
def test_a_log_that_makes_no_recording_is_refused(name: str, tmp_path: pathlib.Path) -> None:
    files, flags, said = REFUSED[name]
    given = files if isinstance(files, dict) else {"log.csv": files}
    expect_refused(imported(tmp_path, SOUND | given, flags), said)
    assert not (tmp_path / "o.h5").exists()


def test_a_column_of_labels_makes_a_recording_each_or_none(tmp_path: pathlib.Path) -> None:
    """Values of which only kept rows have some make no recording; where one is refused, none is written."""
    log = "time;p0;p1;label;id\n0;1;2;cup;1\n.1;3;4;key;2\n.2;5;6;1;1\n.3;5;6;1,0;1\n.35;7;8;;1\n"
    done = imported(tmp_path, log, ["--split", "label", "--where", "id=1"])
    assert "log.csv: 1 rows without a value of 'label' are left out (--split)" in done.stderr
    assert sorted(file.name for file in tmp_path.glob("*.h5")) == ["o-1.h5", "o-cup.h5"]
    one, cup = (palpate.read_recording(tmp_path / f"o-{label}.h5") for label in ("1", "cup"))
    assert (one.object, one.pressure.tolist()) == ("1", [[5, 6], [5, 6]])
    assert (cup.object, cup.pressure.tolist()) == ("cup", [[1, 2]])
    for name, bad in (("x", log + ".4;abc;6;late;1\n"), ("y", log + ".4;1;2;a/b;1\n.5;1;2;a_b;1\n"),
                      ("z", log + f".4;1;2;{'L' * 250};1\n")):  # fmt: skip
        done = imported(tmp_path, bad, ["--split", "label", "-o", f"{name}.h5"])
        expect_refused(done, "")
        assert not list(tmp_path.glob(f"{name}-*.h5"))
