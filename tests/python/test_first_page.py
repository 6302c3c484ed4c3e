"""The commands of README.md go from logs, in CSV and in a bag of ROS, to the pose of an unknown object."""

import csv
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
#: Label, simulated shape, touches and T_object_robot.
LOGS = [("cup", "A", 24, (0, 0, 0)), ("key", "E", 24, (0, 0, 0)), ("unknown", "E", 5, (20, -10, 40))]


def frames_of(shape: str, touches: int, seed: int, pose: tuple[int, int, int]) -> list[palpate.Frame]:
    x, y, deg = pose
    name = f"simulate:{shape},array=8:8:1.9,rate=50,touches={touches},seed={seed}"
    with palpate.open_sensor(f"{name},object={x}:{y}:{deg},speed=max") as sensor:
        return list(sensor)


def write_tables(folder: pathlib.Path, frames: list[palpate.Frame]) -> None:
    folder.mkdir()
    with (folder / "pressures.csv").open("w") as file:
        rows = csv.writer(file)
        rows.writerow(["time", *(f"p{k}" for k in range(64))])
        rows.writerows([f"{frame.host_time_s:.6f}", *frame.values] for frame in frames)
    with (folder / "poses.csv").open("w") as file:
        rows = csv.writer(file)
        rows.writerow(["time", "x", "y", "yaw"])
        for frame in frames:
            x, y, theta = frame.T_robot_sensor
            rows.writerow([f"{frame.host_time_s:.6f}", x / 1000, y / 1000, theta])


def write_bag(file: pathlib.Path, folder: pathlib.Path, frames: list[palpate.Frame]) -> None:
    bag = Bag(folder, "mcap")
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    for frame in frames:
        at = frame.host_time_s
        x, y, theta = frame.T_robot_sensor
        arm = bag.pose("Transform", x / 1000, y / 1000, 0.1, about_z(theta))
        edge = bag.of("geometry_msgs/msg/TransformStamped", bag.header(at, "base"), "array", arm)
        bag.write("/tf", bag.of("tf2_msgs/msg/TFMessage", [edge]), at)
        values = numpy.array(frame.values, dtype=numpy.float32)
        bag.write("/taxels", bag.of("std_msgs/msg/Float32MultiArray", layout, values), at)
    [written] = bag.close().glob("*.mcap")
    written.rename(file)


def test_the_first_page_runs(tmp_path: pathlib.Path) -> None:
    for seed, (label, shape, touches, pose) in enumerate(LOGS, start=1):
        frames = frames_of(shape, touches, seed, pose)
        write_tables(tmp_path / label, frames)
        if label == "cup":
            write_bag(tmp_path / "cup.mcap", tmp_path, frames)
    folders = [pathlib.Path(os.environ["PALPATE_COMMAND"]).parent, pathlib.Path(sys.executable).parent]
    blocks = re.findall(r"```sh\n(.*?)```", README.read_text(), re.DOTALL)
    assert len(blocks) == 2

    def said(block: str) -> str:
        run = subprocess.run(
            ["sh", "-e", "-c", block], cwd=tmp_path, capture_output=True, text=True, timeout=300,
            env={**os.environ, "PATH": ":".join(map(str, [*folders, os.environ["PATH"]]))},
        )  # fmt: skip
        assert run.returncode == 0, run.stderr
        return run.stdout

    out = said(blocks[0])
    assert "48 touches: nothing is wrong with the set-up" in out
    number = r" +([-0-9.]+)\+-\S+"
    [found] = re.findall(rf"unknown\.h5 +5 +key +1\.000 .*?{number}{number}{number} +fits", out)
    truth = palpate.inverse((20, -10, numpy.radians(40)))
    assert [float(text) for text in found[:2]] == pytest.approx(truth[:2], abs=1.0)
    assert float(found[2]) == pytest.approx(numpy.degrees(truth[2]), abs=4.0)

    tables = palpate.read_recording(tmp_path / "cup.frames.h5")
    out = said(blocks[1])
    assert re.search(r"/taxels +\d+ +50\.0 Hz +std_msgs/msg/Float32MultiArray +\(pressures\)", out)
    bag = palpate.read_recording(tmp_path / "cup.frames.h5")
    assert bag.object == tables.object == "cup"
    # CSV has microseconds, the bag float32.
    numpy.testing.assert_allclose(bag.pressure, tables.pressure, rtol=1e-6)
    known = ~numpy.isnan(bag.T_robot_sensor[:, 0])  # the last frame may be a rounding after the last pose
    assert known[:-1].all()
    off = (bag.T_robot_sensor - tables.T_robot_sensor)[known]
    off[:, 2] = numpy.sin(off[:, 2])  # a quaternion knows no full turns
    assert numpy.abs(off).max() < 0.01
