"""`palpate import` reads tables as laboratories write them: each case is a table of the shape that its name
says, the flags that it takes, the recording that it makes and what the command says of it."""

import dataclasses
import math
import os
import pathlib
import subprocess
from typing import Any

import numpy
import pytest

import palpate

NAN = math.nan
PRESSURES = "time,p0,p1\n0,1,2\n0.1,3,4\n"
READINGS = [[1, 2], [3, 4]]
DOWN = 0.5**0.5  # of a quaternion of a quarter turn


@dataclasses.dataclass
class Case:
    files: dict[str, "str | bytes"]
    flags: list[str]
    readings: Any = None
    times: Any = None
    poses: Any = None
    said: list[str] = dataclasses.field(default_factory=list)
    array: str = "2:1:2"


def poses(header: str, *rows: str) -> dict[str, "str | bytes"]:
    text = "time," + header + "\n" + "".join(f"{i / 10},{row}\n" for i, row in enumerate(rows))
    return {"log.csv": PRESSURES, "poses.csv": text}


WITH_POSES = ["--poses", "poses.csv"]
# The same two poses in every form: the array looks along z, at (10, 20) mm, turned by 0 and by a quarter.
TWO_POSES = [[10, 20, 0], [10, 20, math.pi / 2]]
MATRIX_ROWS = ("1,0,0,10,0,1,0,20,0,0,1,5", "0,-1,0,10,1,0,0,20,0,0,1,5")
MATRIX_COLUMNS = ("1,0,0,0,0,1,0,0,0,0,1,0,.01,.02,.005,1", "0,1,0,0,-1,0,0,0,0,0,1,0,.01,.02,.005,1")
LIBFRANKA = ",".join(f"O_T_EE[{i}]" for i in range(16))

CASES = {
    # Poses.
    "roll_pitch_yaw": Case(
        poses("x,y,z,roll_deg,pitch_deg,yaw_deg", "10,20,5,0,0,0", "10,20,5,0,0,90"), WITH_POSES, poses=TWO_POSES,
        said=["poses.csv: its poses are x, y, z and angles about the fixed axes xyz one after another (--euler), "
              "columns 'x' to 'yaw_deg', in mm and deg"],
    ),
    "a_tool_that_points_down": Case(
        poses("x,y,z,roll_deg,pitch_deg,yaw_deg", "10,20,5,180,0,0", "10,20,5,180,0,90"), WITH_POSES,
        poses=TWO_POSES, said=["the array looks against the plane's normal"],
    ),
    "other_axes": Case(
        poses("a,b,c,rz,ry,rx", "10,20,5,0,0,180", "10,20,5,90,0,180"),
        [*WITH_POSES, "--pose-columns", "a:rx", "--euler", "ZYX", "--pose-unit", "mm,deg"], poses=TWO_POSES,
        said=["angles about the moving axes ZYX"],
    ),
    "rotation_vector": Case(
        poses("x,y,z,rx,ry,rz", "10,20,5,0,0,0", f"10,20,5,0,0,{math.pi / 2}"), WITH_POSES, poses=TWO_POSES,
        said=["its poses are x, y, z and a rotation vector, columns 'x' to 'rz', in mm and rad"],
    ),
    "universal_robots": Case(
        poses(",".join(f"actual_TCP_pose_{i}" for i in range(6)), ".01,.02,.005,0,0,0",
              f".01,.02,.005,0,0,{math.pi / 2}"), WITH_POSES, poses=TWO_POSES,
        said=["a rotation vector, columns 'actual_TCP_pose_0' to 'actual_TCP_pose_5', in m and rad"],
    ),
    "libfranka": Case(
        poses(LIBFRANKA, *MATRIX_COLUMNS), WITH_POSES, poses=TWO_POSES,
        said=["its poses are matrices written by columns (--matrix), columns 'O_T_EE[0]' to 'O_T_EE[15]', in m"],
    ),
    "matrices_by_rows": Case(
        poses(",".join(f"t{i}" for i in range(12)), *MATRIX_ROWS), [*WITH_POSES, "--pose-columns", "t{n}"],
        poses=TWO_POSES, said=["matrices written by rows"],
    ),
    "quaternions_of_rostopic": Case(
        poses("field.pose.position.x,field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
              "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w",
              "10,20,5,0,0,0,1", f"10,20,5,0,0,{DOWN},{DOWN}"), WITH_POSES, poses=TWO_POSES,
    ),
    "a_quaternion_of_zeros_is_no_pose": Case(
        {"log.csv": PRESSURES, "poses.csv": "time,tx,ty,tz,qx,qy,qz,qw\n0,10,20,5,0,0,0,1\n.1,0,0,0,0,0,0,0\n"},
        WITH_POSES, poses=[[10, 20, 0], [NAN] * 3],
    ),
    "a_mount_beside_the_flange": Case(
        poses("x,y,theta", "10,20,0", f"10,20,{math.pi / 2}"), [*WITH_POSES, "--mount", "5,0,30,0,0,90"],
        poses=[[15, 20, math.pi / 2], [10, 25, math.pi]],
    ),
    "a_pad_sideways_on_a_finger": Case(
        poses("x,y,z,roll_deg,pitch_deg,yaw_deg", "10,20,5,0,90,0", "10,20,5,0,90,0"),
        [*WITH_POSES, "--mount", "0,0,0,0,-90,0"], poses=[[10, 20, 0]] * 2,
    ),
    # Columns.
    "columns_by_pattern": Case(
        {"log.csv": "time,p10_fz,p2_fz,p2_fx\n0,2,1,9\n.1,4,3,9\n"}, ["--pressure-columns", "p{n}_fz"],
        READINGS, said=["its readings are 2 columns, 'p2_fz' to 'p10_fz'"],
    ),
    "columns_by_star": Case(
        {"log.csv": "time,a_fz,a_fx,b_fz\n0,1,9,2\n.1,3,9,4\n"}, ["--pressure-columns", "*_fz"], READINGS,
    ),
    "every_third_column": Case(
        {"log.csv": "time,x0,y0,z0,x1,y1,z1\n0,8,9,1,8,9,2\n.1,8,9,3,8,9,4\n"}, ["--pressure-columns", "4::3"],
        READINGS,
    ),
    "numbers_of_columns_with_a_header": Case(
        {"log.csv": "when,c,a,b\n0,9,1,2\n.1,9,3,4\n"}, ["--pressure-columns", "3:4", "--time-column", "1"],
        READINGS, times=[0, 0.1],
    ),
    "numbers_of_each_table": Case(
        {"log.csv": "0,1,2\n.1,3,4\n", "poses.csv": "0,9,10,20,0\n.1,9,10,20,0\n"},
        [*WITH_POSES, "--pressure-columns", "2,3", "--pose-columns", "3:5", "--time-column", "1"],
        READINGS, poses=[[10, 20, 0]] * 2,
    ),
    "the_z_of_three_axes": Case(
        {"log.csv": "time,x0,x1,y0,y1,z0,z1\n0,8,8,9,9,1,2\n.1,8,8,9,9,3,4\n"}, ["--pressure-component", "z"],
        READINGS, said=["its readings are the z of x, y and z of each element, of the first 'x0', 'y0' and 'z0'"],
    ),
    "the_length_of_three_axes": Case(
        {"log.csv": "0,2,3,6,0,3,4\n.1,0,0,1,0,0,2\n"}, ["--pressure-component", "norm", "--pressure-columns", "2:7",
                                                        "--time-column", "1"],
        [[7, 5], [1, 2]],
    ),
    "one_sensor_of_several": Case(
        {"log.csv": "time,sensor_id,p0,p1\n0,1,9,9\n0,2,1,2\n.1,1,9,9\n.1,2.0,3,4\n"}, ["--where", "sensor_id=2"],
        READINGS, times=[0, 0.1],
    ),
    "two_pads_of_a_hand_are_one_array": Case(
        {"log.csv": "time,left_0,right_0,left_1,pad\n0,1,2,3,9\n.1,4,5,6,9\n",
         "hand.csv": "x,y\n-10,0\n-8,0\n9,0\n"},
        ["--pressure-columns", "left_{n},right_{n}"], [[1, 3, 2], [4, 6, 5]], array="hand.csv",
    ),
    "rows_of_which_two_columns_hold": Case(
        {"log.csv": "time,id,side,p0,p1\n0,2,left,1,2\n0,2,right,9,9\n.1,1,left,9,9\n.1,2,left,3,4\n"},
        ["--where", "id=2", "--where", "side=left"], READINGS, times=[0, 0.1],
    ),
    # Sheets.
    "lines_before_the_header": Case(
        {"log.csv": "Tactile array 5\nRecorded 2026-11-01, by hand\n\ntime,p0,p1\n0,1,2\n.1,3,4\n"}, [], READINGS,
        said=["log.csv: 2 lines before line 4 ('time', 'p0', 'p1') are left out (--header-line)"],
    ),
    "lines_filled_up_by_a_spreadsheet": Case(
        {"log.csv": "Device,5,,\nOperator,A,,\ntime,p0,p1,\n0,1,2,\n.1,3,4,\n"}, [], READINGS,
        said=["2 lines before line 3"],
    ),
    "a_header_line_that_is_given": Case(
        {"log.csv": "a,b,c\ntime,p0,p1\n0,1,2\n.1,3,4\n"}, ["--header-line", "2"], READINGS, times=[0, 0.1],
    ),
    "sep_and_decimal_commas": Case({"log.csv": "sep=;\r\ntime;p0;p1\r\n0;1,0;2\r\n0,1;3;4\r\n"}, [], READINGS,
                                   times=[0, 0.1]),
    "utf_16": Case({"log.csv": "time\tp0\tp1\r\n0\t1\t2\r\n0,1\t3\t4\r\n".encode("utf-16")}, [], READINGS,
                   times=[0, 0.1]),
    "utf_16_big_endian": Case({"log.csv": b"\xfe\xff" + "time,p0 \U0001f446,p1\n0,1,2\n.1,3,4\n".encode("utf-16-be")},
                              [], READINGS, times=[0, 0.1]),
    "units_in_brackets": Case({"log.csv": "Time [ms],p0 [kPa],p1 [kPa]\n0,1,2\n100,3,4\n"}, [], READINGS,
                              times=[0, 0.1]),
    "iso_8601": Case(
        {"log.csv": "time,p0,p1\n1970-01-02T00:00:01.5+01:00,1,2\n1970-01-01T23:00:02Z,3,4\n"}, [], READINGS,
        times=[86400 - 3600 + 1.5, 86400 - 3600 + 2],
    ),
    "times_of_day_past_midnight": Case({"log.csv": "time,p0,p1\n23:59:59.5,1,2\n00:00:00,3,4\n"}, [], READINGS,
                                       times=[86399.5, 86400]),
    "frames_as_blocks": Case(
        {"log.csv": "Frame 1\n1,2\n3,4\n\nFrame 2\n5,6\n7,8\n"}, ["--rows", "frames", "--rate", "10"],
        [[1, 2, 3, 4], [5, 6, 7, 8]], times=[0, 0.1], array="2:2:2",
        said=["its frames are blocks of 2 rows of 2 readings"],
    ),
    # Times.
    "poses_at_one_time": Case(
        {"log.csv": PRESSURES, "poses.csv": "time,x,y,theta\n0,10,20,0\n0,99,99,0\n.1,10,20,0\n"}, WITH_POSES,
        poses=[[10, 20, 0]] * 2, said=["1 of its rows repeat the time of the row before, whose pose is kept"],
    ),
    "a_clock_that_steps_back": Case(
        {"log.csv": "time,p0,p1\n5,1,2\n6,3,4\n0.5,1,2\n1.5,3,4\n",
         "poses.csv": "time,x,y,theta\n5,1,1,0\n6,1,1,0\n0,2,2,0\n2,2,2,0\n"},
        [*WITH_POSES, "--largest-gap-s", "3"], READINGS * 2, times=[5, 6, 16.5, 17.5],
        poses=[[1, 1, 0]] * 2 + [[2, 2, 0]] * 2,
        said=["log.csv:4: the clock steps back from 6 to 0.5 s; a new stretch begins there, 10 s after the last"],
    ),
}  # fmt: skip

def run(folder: pathlib.Path, files: dict[str, "str | bytes"], flags: list[str]) -> "subprocess.CompletedProcess[str]":
    for name, text in {"log.csv": PRESSURES, **files}.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    array = [] if "--array" in flags else ["--array", "2:1:2"]
    return subprocess.run([os.environ["PALPATE_COMMAND"], "import", "log.csv", *array, "-o", "o.h5", *flags],
                          cwd=folder, capture_output=True, text=True)  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_log_is_read(name: str, tmp_path: pathlib.Path) -> None:
    case = CASES[name]
    done = run(tmp_path, case.files, ["--array", case.array, *case.flags])
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


def test_a_column_of_labels_makes_a_recording_each(tmp_path: pathlib.Path) -> None:
    done = run(tmp_path, {"log.csv": "time,p0,p1,label\n0,1,2,cup\n.1,3,4,key\n.2,5,6,cup\n"}, ["--split", "label"])
    assert done.returncode == 0, done.stderr
    cup, key = (palpate.read_recording(tmp_path / f"o-{label}.h5") for label in ("cup", "key"))
    assert (cup.object, cup.pressure.tolist()) == ("cup", [[1, 2], [5, 6]])
    assert (key.object, key.pressure.tolist()) == ("key", [[3, 4]])


def test_splitting_writes_all_or_nothing(tmp_path: pathlib.Path) -> None:
    """Values of which only kept rows have some make no recording; where one is refused, none is written."""
    log = "time,p0,p1,label,id\n0,1,2,cup,1\n.1,3,4,key,2\n.2,5,6,1,1\n.3,5,6,1.0,1\n"
    assert run(tmp_path, {"log.csv": log}, ["--split", "label", "--where", "id=1"]).returncode == 0
    assert sorted(file.name for file in tmp_path.glob("*.h5")) == ["o-1.h5", "o-cup.h5"]
    assert len(palpate.read_recording(tmp_path / "o-1.h5")) == 2
    for name, bad in (("x", log + ".4,abc,6,late,1\n"), ("y", log + ".4,1,2,a/b,1\n.5,1,2,a_b,1\n")):
        done = run(tmp_path, {"log.csv": bad}, ["--split", "label", "-o", f"{name}.h5"])
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
        assert not list(tmp_path.glob(f"{name}-*.h5"))
