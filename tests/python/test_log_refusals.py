"""What `palpate import` refuses, by the place and the field that it names, in one line and without a file."""

import os
import pathlib
import subprocess

import pytest

from test_logs import MATRIX_ROWS, WITH_POSES, poses

FRAMES = "time,p0,p1\n0,1,2\n0.05,3,4\n0.1,5,6\n"
POSES = "time,x_mm,y_mm,theta_rad\n0,0,5,-1\n0.1,10,7,1\n"

#: Files beside those above, flags, and what the line says.
CASES: dict[str, tuple[dict[str, "str | bytes"], list[str], str]] = {
    "text": (
        {"log.csv": "time,p0,p1\n0,1,2\n1,3,abc\n"}, [],
        "log.csv:3: column 'p1': 'abc' is not a finite number",
    ),
    "no_time": ({"log.csv": "time,p0,p1\n,1,2\n"}, [], "log.csv:2: column 'time' is empty"),
    "nanoseconds": (
        {"log.csv": "time,p0,p1\n1700000000000000000,1,2\n"}, [],
        "log.csv:2: column 'time': 1.7e+18 s is no time",
    ),
    "two_units": (
        {"log.csv": "time_ns,p0,p1\n1,1,2\n"}, ["--time-unit", "s"],
        "log.csv:1: column 'time_ns' is in ns by its name, in s by --time-unit",
    ),
    "no_corner": (
        {}, ["--first-element", "left"],
        "--first-element left: give bottom-left, bottom-right, top-left or top-right: x grows to the right, y upwards",
    ),
    "no_order": ({}, ["--order", "x"], "--order x: give rows or columns"),
    "an_order_of_a_file": (
        {"array.csv": "x,y\n0,0\n2,0\n"}, ["--array", "array.csv", "--order", "columns"],
        "--order: is for a grid, COLUMNS:ROWS:PITCH",
    ),
    "a_corner_of_a_file": (
        {"array.csv": "x,y\n0,0\n2,0\n"}, ["--array", "array.csv", "--first-element", "top-left"],
        "--first-element: is for a grid, COLUMNS:ROWS:PITCH",
    ),
    "no_such_dead_element": ({}, ["--dead", "0,2"], "--dead 0,2: '2' is no element"),
    "no_element_at_all": ({}, ["--dead", "1,"], "--dead 1,: '' is no element"),
    "more_columns": (
        {"log.csv": "time,p0,p1,p2\n0,1,2,3\n"}, [],
        "log.csv:1: 3 columns of pressure ('p0' to 'p2') for an array of 2 elements",
    ),
    "sorted_as_text": ({"log.csv": "time,p10,p2\n0,1,2\n"}, [], "log.csv:1: column 'p2' comes after 'p10'"),
    "of_one_number": ({"log.csv": "time,p1,p01\n0,1,2\n"}, [], "log.csv:1: column 'p01' comes after 'p1'"),
    "no_pose_known": (
        {"poses.csv": "time,x_mm,y_mm,theta_rad\n0,,,\n0.1,,,\n"}, WITH_POSES,
        "poses.csv: holds no pose",
    ),
    "no_such_columns": ({}, ["--pressure-columns", "q"], "log.csv:1: no column is called or begins with 'q'"),
    "columns_back_to_front": (
        {}, ["--pressure-columns", "p1:p0"],
        "log.csv:1: column 'p0' comes before 'p1'",
    ),
    "times_as_pressures": (
        {}, ["--pressure-columns", "time:p0"],
        "log.csv:1: column 'time', between 'time' and 'p0', holds something else",
    ),
    "a_temperature_is_no_time": (
        {"log.csv": "T,p0,p1\n20,1,2\n"}, ["--pressure-columns", "p"],
        "log.csv: its rows are touches",
    ),
    "touches_without_their_poses": (
        {"log.csv": "x,y,theta,p0,p1\n0,0,0,1,2\n"}, [],
        "log.csv: its rows are touches",
    ),
    "a_bad_cell_in_the_first_row": (
        {"log.csv": "0,1,NA\n1,2,3\n"}, [],
        "log.csv:1: column '3': 'NA' is not a finite number",
    ),
    "ragged": (
        {"log.csv": "time,p0,p1\n0,1,2\n1,3\n"}, [],
        "log.csv:3: the row has 2 cells, the first row 3",
    ),
    "header_alone": ({"log.csv": "time,p0,p1\n"}, [], "log.csv: holds a header and no row"),
    "nothing_read": ({"log.csv": "time,p0,p1\n0,,\n"}, [], "log.csv: holds no reading of a living element"),
    "no_such_element": (
        {"log.csv": "time,element,pressure\n0,2,1\n"}, [],
        "log.csv:2: column 'element': 2 is no element",
    ),
    "element_twice": (
        {"log.csv": "frame,element,pressure\n0,1,1\n0,1,1\n"}, WITH_POSES,
        "log.csv:3: element 1 has two readings in one frame",
    ),
    "no_frame": (
        {"log.csv": "element,pressure\n0,1\n"}, [],
        "log.csv:1: a table with a row for each reading needs a column 'time' or 'frame'",
    ),
    "touches_without_poses": ({"log.csv": "p0,p1\n1,2\n"}, [], "log.csv: its rows are touches"),
    "frames_without_times": ({"log.csv": "p0,p1\n1,2\n"}, ["--rows", "frames"], "log.csv: frames need times"),
    "poses_alone_have_times": (
        {"log.csv": "p0,p1\n1,2\n"}, WITH_POSES,
        "poses.csv: has times, log.csv has none",
    ),
    "fewer_poses": (
        {"poses.csv": "x,y,theta\n1,2,3\n"}, WITH_POSES,
        "poses.csv: holds 1 poses without a time for 3 rows of log.csv",
    ),
    "a_touch_without_a_pose": (
        {"poses.csv": "time,x,y,theta\n0,1,2,3\n0.05,1,2,3\n"}, [*WITH_POSES, "--rows", "touches"],
        "poses.csv: has no pose for row 2 of log.csv, counted from 0, at 0.1 s, and a touch needs one",
    ),
    "half_a_pose": (
        {"poses.csv": "time,x,y,theta\n0,1,,3\n"}, WITH_POSES,
        "poses.csv:2: a part of the pose is empty: 'y'",
    ),
    "a_far_pose": (
        {"poses.csv": "time,x_m,y_m,theta\n0,2e6,0,0\n"}, WITH_POSES,
        "poses.csv:2: column 'x_m': 2000000 m is further than any robot gets",
    ),
    "no_angle": (
        {"poses.csv": "time,x,y\n0,1,2\n"}, WITH_POSES,
        "poses.csv:1: has no columns 'x', 'y' and 'theta'",
    ),
    "no_rotation": (
        {"poses.csv": "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n1,0,0,0,0,0,1,1\n"}, WITH_POSES,
        "poses.csv:3: the quaternion's length is 1.414",
    ),
    "a_part_of_a_pose_in_space": (
        {"poses.csv": "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,,0,0,0,1\n"}, WITH_POSES,
        "poses.csv:2: a part of the pose is empty: 'tz'",
    ),
    "looks_everywhere": (
        {"poses.csv": "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n0.1,0,0,0,1,0,0,0\n"}, WITH_POSES,
        "--plane: missing",
    ),
    "a_plane_of_plane_poses": ({}, [*WITH_POSES, "--plane", "0,0,1"], "--plane 0,0,1: is for poses in space"),
    "an_array_of_one_column": ({"a.txt": "1\n2\n"}, ["--array", "a.txt"], "a.txt:1: no column is called 'x'"),
    "a_long_table_with_poses": (
        {"log.csv": "time,element,pressure,x,y,theta\n0,0,1,0,0,0\n0,1,1,0,0,0\n"}, ["--poses", "log.csv"],
        "log.csv: has 2 rows of readings for 1 frames or touches",
    ),
    "a_sideways_array": (
        {"poses.csv": "time_s,x_mm,y_mm,roll_deg,pitch_deg,yaw_deg\n0,0,0,0,90,0\n"}, WITH_POSES,
        "poses.csv:2: column 'pitch_deg': the array is turned by 90 degrees out of the xy plane",
    ),
    "a_rotation_vector_of_a_tool_that_points_down": (
        {"poses.csv": "time,x,y,z,rx,ry,rz\n0,0,0,5,2.2,2.2,0\n"}, [*WITH_POSES, "--pose-columns", "x,y,rz"],
        "poses.csv:2: column 'rx': the array is turned by 126 degrees out of the xy plane",
    ),
    "binary": ({"log.csv": b"\0\1\2"}, [], "log.csv: is no text"),
    "no_rotation_by_row": (
        poses(",".join(f"t{i}" for i in range(12)), MATRIX_ROWS[0], "1,0,0,0,0,2,0,0,0,0,1,0"),
        [*WITH_POSES, "--pose-columns", "t*"],
        "poses.csv:3: the numbers are no rotation and position, read by rows; correct them, or give --matrix columns",
    ),
    "a_matrix_that_may_be_either": (
        poses(",".join(f"t{i}" for i in range(16)), "0,1,0,0,-1,0,0,0,0,0,1,0,0,0,0,1"),
        [*WITH_POSES, "--pose-columns", "t*"],
        "poses.csv: its matrices may be written by columns or by rows; give --matrix columns or --matrix rows",
    ),
    "four_columns_of_a_pose": (
        poses("a,b,c,d", "1,2,3,4"), [*WITH_POSES, "--pose-columns", "a:d"],
        "poses.csv:1: --pose-columns a:d names 4 columns; give three, X,Y,THETA, or of poses in space six "
        "(X,Y,Z,ROLL,PITCH,YAW, or a rotation vector), seven (TX,TY,TZ,QX,QY,QZ,QW), or the 12 or 16 numbers of a "
        "matrix; the header there is 'time', 'a', 'b', 'c', ...",
    ),
    "no_axes": ({}, ["--euler", "xxy"], "--euler xxy: give the axes of the three angles in their order"),
    "no_mount": (poses("x,y,theta", "0,0,0"), [*WITH_POSES, "--mount", "1,2,3"],
                 "--mount 1,2,3: give X,Y,Z,ROLL,PITCH,YAW"),
    "a_mount_of_no_poses": ({}, ["--mount", "1,2,3,0,0,0"], "--mount 1,2,3,0,0,0: is for poses; give --poses"),
    "no_such_column_to_keep": ({}, ["--where", "id=2"], "--where id=2: no table has this column; give its name"),
    "no_such_header_line": ({}, ["--header-line", "9"], "--header-line 9: log.csv has no such line"),
    "three_axes_unsaid": (
        {"log.csv": "time,x0,y0,z0,x1,y1,z1\n0,8,9,1,8,9,2\n"}, [],
        "log.csv:1: 6 columns of pressure ('x0' to 'z1') for an array of 2 elements; where each element reads x, y "
        "and z, give --pressure-component z or --pressure-component norm; the header there is 'time', 'x0', 'y0', "
        "'z0', ...",
    ),
    "a_block_cut_short": (
        {"log.csv": "Frame 1\n1,2\n3,4\nFrame 2\n5,6\n"}, ["--rows", "frames", "--rate", "10", "--array", "2:2:2"],
        "log.csv:5: the last frame has 1 rows, and the array has 2",
    ),
    "blocks_unsaid": (
        {"log.csv": "1,2\n3,4\n"}, ["--array", "2:2:2"],
        "where each frame is a block of rows, as the array has them, give --rows frames",
    ),
    "one_clock_steps_back": (
        {"poses.csv": "time,x,y,theta\n1,0,0,0\n0,0,0,0\n"}, WITH_POSES,
        "poses.csv:3: 0 s is earlier than the row before, at 1 s, and the clock of log.csv does not step back with it",
    ),
    "rows_that_are_not_sorted": (
        {"log.csv": "time,p0,p1\n" + "1,1,2\n0,1,2\n" * 11}, [], "and so are more than 10 rows; sort the rows by time",
    ),
    "no_time": ({"log.csv": "time,p0,p1\n25:00:00,1,2\n"}, [], "log.csv:2: column 'time': '25:00:00' is no time"),
}  # fmt: skip

#: Flags alone.
FORMS = [
    (["--pose-unit", "cm,rad"], "--pose-unit cm,rad: give mm,rad or mm,deg or m,rad or m,deg"),
    (["--time-unit", "h"], "--time-unit h: give s, ms, us or ns"),
    (["--pressure-unit", "psi"], "--pressure-unit psi: give kPa or raw"),
    (["--rows", "rows"], "--rows rows: give frames or touches"),
    (["--rate", "5"], "--rate 5: log.csv has times"),
    (["--rate", "0"], "--rate 0: give 0.001 to 1000000 Hz"),
    (["--rate", "1e-300"], "--rate 1e-300: give 0.001 to 1000000 Hz"),
    (["--rate", "1e300"], "--rate 1e+300: give 0.001 to 1000000 Hz"),
    (["--largest-gap-s", "0"], "--largest-gap-s 0: give seconds above 0"),
    (["--plane", "0,0"], "--plane 0,0: give auto, or the plane's normal in the robot frame"),
    (["--plane", "0,0,0"], "--plane 0,0,0: give auto, or the plane's normal in the robot frame"),
    (["--truth", "1,2,3"], "--truth 1,2,3: give LABEL,X,Y,THETA, in the units of the poses"),
    (["--truth", ",1,2,3"], "--truth ,1,2,3: give LABEL,X,Y,THETA, in the units of the poses"),
    (["--truth", "A,0,1e12,0"], "--truth A,0,1e12,0: is further than 1e+09 mm or turned by more than 1e9 rad"),
    (["--array", "0:1:2"], "--array 0:1:2: give COLUMNS:ROWS:PITCH, with 1 to 1024 columns and rows and a pitch of 0.001 to 1000 mm, or a file"),
    (["-o", "log.csv"], "-o log.csv: would overwrite log.csv, which PRESSURES reads; choose another name"),
    (["--poses", "poses.csv", "--time-column", "stmap"], "--time-column stmap: no table has this column"),
]  # fmt: skip


def expect_refused(folder: pathlib.Path, files: "dict[str, str | bytes]", flags: list[str], said: str) -> None:
    for name, text in {"log.csv": FRAMES, "poses.csv": POSES, **files}.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    array = [] if "--array" in flags else ["--array", "2:1:2"]
    output = [] if "-o" in flags else ["-o", "o.h5"]
    done = subprocess.run([os.environ["PALPATE_COMMAND"], "import", "log.csv", *array, *output, *flags],
                          cwd=folder, capture_output=True, text=True)  # fmt: skip
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert said in done.stderr
    assert not (folder / "o.h5").exists()


@pytest.mark.parametrize("name", CASES)
def test_a_table_that_makes_no_recording(name: str, tmp_path: pathlib.Path) -> None:
    expect_refused(tmp_path, *CASES[name])


@pytest.mark.parametrize(("flags", "said"), FORMS)
def test_a_flag_names_its_form(flags: list[str], said: str, tmp_path: pathlib.Path) -> None:
    expect_refused(tmp_path, {}, flags, said)


def test_a_column_of_times_must_be_there(tmp_path: pathlib.Path) -> None:
    said = "--time-column when: no table has this column"
    expect_refused(tmp_path, {"log.csv": "p0,p1\n1,2\n"}, ["--time-column", "when"], said)
