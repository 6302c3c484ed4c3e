"""From a robot's bags to a pose that it can act on, with nothing but what the package has."""

import json
import math
import pathlib

import numpy
import palpate
from conftest import command
from palpate import read_bag
from ros_bag import START_S, Bag, pointing_down

#: Where the robot learns, in its frame: 0.6 m away.
PLACE = (600.0, 100.0, 0.3)
DEAD = (13, 42)


def touched(letter: str, count: int, seed: int, moved: tuple[float, float, float]) -> palpate.Recording:
    """Touches of a letter that was learned at PLACE, and then moved so in the robot frame."""
    elements_mm = palpate.grid_array(8, 8, 1.9) * (1, -1)  # an array that looks down, seen from above
    poses = palpate.random_poses(count, seed=seed)
    told = palpate.simulate(letter, poses, elements_mm=elements_mm, seed=seed)
    at = palpate.compose(moved, PLACE)
    placed = [palpate.compose(at, pose) for pose in told.T_robot_sensor]
    return palpate.Recording(told.pressure, placed, elements_mm)


def recorded(path: pathlib.Path, touches: palpate.Recording, label: str) -> pathlib.Path:
    """Touches in a file, from a bag of counts and of the arm in /tf, with two elements that never read. The
    array hangs in the air for 0.6 s, and for a tenth of a second between any two touches."""
    path.mkdir()
    bag, idle, frames = Bag(path, "mcap"), numpy.full(64, 30), 0

    def frame(counts: numpy.typing.NDArray[numpy.float64], pose: numpy.typing.NDArray[numpy.float64]) -> None:
        nonlocal frames
        at = START_S + 0.02 * frames
        frames += 1
        edge = bag.edge("base", "array", at, pose[0] / 1000, pose[1] / 1000, 0.1, pointing_down(pose[2]))
        bag.frames("/tf", [edge], at)
        bag.plain("/taxels", numpy.where(numpy.isin(numpy.arange(64), DEAD), 0, counts), at, "UInt16")

    for _ in range(30):
        frame(idle, touches.T_robot_sensor[0])
    for pose, pressure in zip(touches.T_robot_sensor, touches.pressure, strict=True):
        for share in (0.0, *12 * (1.0,), 0.0, 0.0, 0.0, 0.0):
            frame(idle + 100 * share * pressure, pose)
    recording = read_bag(bag.close(), pressure_topic="/taxels", tf=("base", "array"), array=(8, 8, 1.9),
                         pressure_unit="raw", dead=DEAD, object=label)  # fmt: skip
    recording.save(path / "frames.h5")
    file = path / f"{path.name}.h5"
    command("touches", path / "frames.h5", "-o", file, "--onset", 100)
    return file


def test_from_bags_to_poses(device: palpate.Device, tmp_path: pathlib.Path) -> None:
    learned = [recorded(tmp_path / letter, touched(letter, 48, k + 1, (0, 0, 0)), letter)
               for k, letter in enumerate("AEK")]  # fmt: skip
    assert json.loads(command("check", *learned, "--threshold", 200, "--json", "-")) == []
    command("map", *learned, "-o", f"{tmp_path / 'maps'}/", "--threshold", 200)
    moved = (12.0, -9.0, 0.5)
    file = recorded(tmp_path / "unknown", touched("E", 12, 40, moved), "")
    [record] = palpate.recognize(file, tmp_path / "maps", threshold=200, device=device)
    assert record.best == "E" and record.fit.verdict == "fits"
    grid = palpate.read_map(tmp_path / "maps" / "E.map.h5")
    assert grid.T_learned_robot_object is not None
    assert grid.T_learned_robot_object[0] > 500, "its frame is its own"
    off = record.refined.T_robot_object - palpate.compose(moved, grid.T_learned_robot_object)
    assert math.hypot(*off[:2]) < 0.3, off
    assert max(record.refined.sd[:2]) < 1.0
