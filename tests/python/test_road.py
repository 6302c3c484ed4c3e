"""From a robot's logs to poses that it can act on: the commands of README.md, and a bag with nothing but what
the package has."""

import csv
import json
import math
import os
import pathlib
import re
import subprocess
import sys

import numpy
import pytest
from conftest import command

import palpate
from palpate import read_bag

from ros_bag import START_S, Bag, about_z, pointing_down

README = pathlib.Path(__file__).parents[2] / "README.md"


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


#: Where the robot learns, in its frame: 0.6 m away.
PLACE = (600.0, 100.0, 0.3)
DEAD = (13, 42)
# Seen from above, an array that looks down is turned over.
ELEMENTS_MM = palpate.grid_array(8, 8, 1.9) * (1, -1)


def write_presses(path: pathlib.Path, touches: palpate.Recording) -> pathlib.Path:
    """The log of an 8 x 8 array under a tool that points down: counts, and the arm in /tf.

    The array hangs in the air for 0.6 s, and for a tenth of a second between any two touches.
    """
    path.mkdir()
    bag = Bag(path, "mcap")
    idle = numpy.full(64, 30)
    course = [(touches.T_robot_sensor[0], idle, 0.15)] * 30
    for pose, pressure in zip(touches.T_robot_sensor, touches.pressure, strict=True):
        for share in (0.0, *12 * (1.0,), 0.0, 0.0, 0.0, 0.0):
            course.append((pose, idle + 100 * share * pressure, 0.1 if share else 0.12))
    for k, ((x, y, theta), counts, z_m) in enumerate(course):
        at = START_S + 0.02 * k
        bag.frames("/tf", [bag.edge("base", "array", at, x / 1000, y / 1000, z_m, pointing_down(theta))], at)
        row = counts.astype(numpy.uint16)
        row[list(DEAD)] = 0
        bag.plain("/taxels", row, at, "UInt16")
    return bag.close()


def touches_of(
    path: pathlib.Path, letter: str, label: str, count: int, seed: int, moved: tuple[float, float, float] = (0, 0, 0)
) -> pathlib.Path:
    """The touches, in a file, that the package makes of the bag of a letter that was learned at PLACE and then
    moved so in the robot frame."""
    made = palpate.simulate(letter, palpate.random_poses(count, seed=seed), elements_mm=ELEMENTS_MM, seed=seed)
    at = palpate.compose(moved, PLACE)
    poses = [palpate.compose(at, pose) for pose in made.T_robot_sensor]
    frames = read_bag(
        write_presses(path, palpate.Recording(made.pressure, poses, ELEMENTS_MM)),
        pressure_topic="/taxels", tf=("base", "array"), array=(8, 8, 1.9), pressure_unit="raw", dead=DEAD,
        object=label,
    )  # fmt: skip
    frames.save(path / "frames.h5")
    file = path / f"{path.name}.h5"
    command("touches", path / "frames.h5", "-o", file, "--onset", 100)
    return file


def test_from_bags_to_poses(device: palpate.Device, tmp_path: pathlib.Path) -> None:
    learned = [
        touches_of(tmp_path / letter, letter, letter, 36, k) for k, letter in enumerate("AEK", start=1)
    ]
    assert json.loads(command("check", *learned, "--threshold", 200, "--json", "-")) == []
    maps = tmp_path / "maps"
    command("map", *learned, "-o", f"{maps}/", "--threshold", 200)
    for k, letter in enumerate("EKO"):
        # The middle of the moved object: turned about the robot's base, as the letter's frame is.
        about = palpate.compose((12.0 - 5 * k, -9.0 + 3 * k, 0.5 - k), (0, 0, 0))
        file = touches_of(tmp_path / f"unknown_{letter}", letter, "", 12, 40 + k, tuple(about))
        [record] = palpate.recognize(file, maps, threshold=200, none="auto", device=device)
        if letter == "O":
            assert record.best == "(none)", "a stranger"
            continue
        assert record.best == letter and record.fit.verdict == "fits"
        grid = palpate.read_map(maps / f"{letter}.map.h5")
        assert grid.T_learned_robot_object[0] > 500, "its frame is its own"
        off = record.refined.T_robot_object - palpate.compose(about, grid.T_learned_robot_object)
        assert math.hypot(*off[:2]) < 0.3, off
        assert max(record.refined.sd[:2]) < 1.0
