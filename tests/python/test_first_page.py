"""The commands of README.md go from logs, in CSV and in a bag of ROS, to the pose of an unknown object."""

import math
import os
import pathlib
import re
import subprocess
import sys

import numpy
import pytest

import palpate

from ros_bag import Bag, about_z

README = pathlib.Path(__file__).parents[2] / "README.md"


def write_tables(folder: pathlib.Path, frames: list[palpate.Frame]) -> None:
    folder.mkdir()
    readings = [[frame.host_time_s, *frame.values] for frame in frames]
    poses = [[frame.host_time_s, *frame.T_robot_sensor / (1000, 1000, 1)] for frame in frames]
    header = ",".join(["time", *(f"p{k}" for k in range(64))])
    for name, names, rows in (("pressures", header, readings), ("poses", "time,x,y,yaw", poses)):
        formats = ["%.6f", *["%.17g"] * names.count(",")]
        numpy.savetxt(folder / f"{name}.csv", rows, formats, ",", header=names, comments="")


def write_frames(file: pathlib.Path, folder: pathlib.Path, frames: list[palpate.Frame]) -> None:
    bag = Bag(folder, "mcap")
    for frame in frames:
        at = frame.host_time_s
        x, y, theta = frame.T_robot_sensor
        bag.frames("/tf", [bag.edge("base", "array", at, x / 1000, y / 1000, 0.1, about_z(theta))], at)
        bag.plain("/taxels", frame.values, at)
    [written] = bag.close().glob("*.mcap")
    written.rename(file)


def test_the_first_page_runs(tmp_path: pathlib.Path) -> None:
    unknown = (20, -10, 40)  # T_object_robot, mm and degrees
    for seed, (label, shape, touches, pose) in enumerate(
        [("cup", "A", 24, (0, 0, 0)), ("key", "E", 24, (0, 0, 0)), ("unknown", "E", 5, unknown)], start=1
    ):
        x, y, deg = pose
        name = f"simulate:{shape},array=8:8:1.9,rate=50,touches={touches},seed={seed}"
        with palpate.open_sensor(f"{name},object={x}:{y}:{deg},speed=max") as sensor:
            frames = list(sensor)
        write_tables(tmp_path / label, frames)
        if label == "cup":
            write_frames(tmp_path / "cup.mcap", tmp_path, frames)
    folders = [pathlib.Path(os.environ["PALPATE_COMMAND"]).parent, pathlib.Path(sys.executable).parent]
    path = ":".join(map(str, [*folders, os.environ["PATH"]]))
    tables, bags = re.findall(r"```sh\n(.*?)```", README.read_text(), re.DOTALL)

    def said(block: str) -> str:
        run = subprocess.run(
            ["sh", "-e", "-c", block], cwd=tmp_path, capture_output=True, text=True, timeout=300,
            env={**os.environ, "PATH": path},
        )  # fmt: skip
        assert run.returncode == 0, run.stderr
        return run.stdout

    out = said(tables)
    assert "48 touches: nothing is wrong with the set-up" in out
    number = r" +([-0-9.]+)\+-\S+"
    [found] = re.findall(rf"unknown\.h5 +5 +key +1\.000 .*?{number}{number}{number} +fits", out)
    truth = palpate.inverse((*unknown[:2], math.radians(unknown[2])))
    assert [float(text) for text in found[:2]] == pytest.approx(truth[:2], abs=1.0)
    assert float(found[2]) == pytest.approx(math.degrees(truth[2]), abs=4.0)

    of_tables = palpate.read_recording(tmp_path / "cup.frames.h5")
    assert re.search(r"/taxels +\d+ +50\.0 Hz +std_msgs/msg/Float32MultiArray +\(pressures\)", said(bags))
    of_bag = palpate.read_recording(tmp_path / "cup.frames.h5")
    assert of_bag.object == of_tables.object == "cup"
    # CSV has microseconds, the bag float32.
    numpy.testing.assert_allclose(of_bag.pressure, of_tables.pressure, rtol=1e-6)
    known = ~numpy.isnan(of_bag.T_robot_sensor[:, 0])  # the last frame may be a rounding after the last pose
    assert known[:-1].all()
    off = (of_bag.T_robot_sensor - of_tables.T_robot_sensor)[known]
    off[:, 2] = numpy.sin(off[:, 2])  # a quaternion knows no full turns
    assert numpy.abs(off).max() < 0.01
