"""From a robot's bags to poses that it can act on, with nothing but what the package has."""

import json
import math
import pathlib

import numpy

import palpate
from palpate import read_bag

from conftest import command
from ros_bag import START_S, Bag, pointing_down

#: Where the robot learns, in its frame: 0.6 m away.
PLACE = (600.0, 100.0, 0.3)
DEAD = (13, 42)


def write_bag(path: pathlib.Path, touches: palpate.Recording) -> pathlib.Path:
    """The log of an 8 x 8 array under a tool that points down: counts, and the arm in /tf.

    The array hangs in the air for 0.6 s, and for a tenth of a second between any two touches.
    """
    path.mkdir()
    bag = Bag(path, "mcap")
    moving = "geometry_msgs/msg/TransformStamped"
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    k = 0

    def frame(counts: numpy.ndarray, pose: numpy.ndarray, z_m: float) -> None:
        nonlocal k
        at = START_S + 0.02 * k
        k += 1
        x, y, theta = pose
        arm = bag.pose("Transform", x / 1000, y / 1000, z_m, pointing_down(theta))
        edges = [bag.of(moving, bag.header(at, "base"), "array", arm)]
        bag.write("/tf", bag.of("tf2_msgs/msg/TFMessage", edges), at)
        counts = counts.astype(numpy.uint16)
        counts[list(DEAD)] = 0
        bag.write("/taxels", bag.of("std_msgs/msg/UInt16MultiArray", layout, counts), at)

    idle = numpy.full(64, 30)
    for _ in range(30):
        frame(idle, touches.T_robot_sensor[0], 0.15)
    for pose, pressure in zip(touches.T_robot_sensor, touches.pressure):
        for share in (0.0, *12 * (1.0,), 0.0, 0.0, 0.0, 0.0):
            frame(idle + 100 * share * pressure, pose, 0.1 if share else 0.12)
    return bag.close()


def recording_of(path: pathlib.Path, touches: palpate.Recording, label: str) -> pathlib.Path:
    """What the package makes of the bag: touches in a file."""
    log = write_bag(path, touches)
    frames = read_bag(
        log,
        pressure_topic="/taxels",
        tf=("base", "array"),
        array=(8, 8, 1.9),
        pressure_unit="raw",
        dead=DEAD,
        object=label,
    )
    frames.save(path / "frames.h5")
    file = path / f"{path.name}.h5"
    command("touches", path / "frames.h5", "-o", file, "--onset", 100)
    return file


def touched(letter: str, count: int, seed: int, moved: tuple[float, float, float]) -> palpate.Recording:
    """Touches of a letter that was learned at PLACE and then moved so in the robot frame."""
    poses = palpate.random_poses(count, seed=seed)
    # Seen from above, an array that looks down is turned over.
    elements_mm = palpate.grid_array(8, 8, 1.9) * (1, -1)
    at = palpate.compose(moved, PLACE)
    recording = palpate.simulate(letter, poses, elements_mm=elements_mm, seed=seed)
    return palpate.Recording(
        recording.pressure,
        [palpate.compose(at, pose) for pose in recording.T_robot_sensor],
        elements_mm,
        object=letter,
    )


def test_from_bags_to_poses(device: palpate.Device, tmp_path: pathlib.Path) -> None:
    # Takes six seconds of one core: the bags of nine objects are written, read and recognised.
    learned = [
        recording_of(tmp_path / letter, touched(letter, 48, k + 1, (0, 0, 0)), letter)
        for k, letter in enumerate("AEUK4B")
    ]
    assert json.loads(command("check", *learned, "--threshold", 200, "--json", "-")) == []
    maps = tmp_path / "maps"
    command("map", *learned, "-o", f"{maps}/", "--threshold", 200)
    for k, letter in enumerate("EKO"):
        moved = (12.0 - 5 * k, -9.0 + 3 * k, 0.5 - k)
        # The middle of the moved object: turned about the robot's base, as the letter's frame is.
        about = palpate.compose(moved, (0, 0, 0))
        file = recording_of(tmp_path / f"unknown_{letter}", touched(letter, 12, 40 + k, about), "")
        [record] = palpate.recognize(file, maps, threshold=200, none="auto", device=device)
        if letter == "O":
            assert record.best == "(none)", "a stranger"
            continue
        assert record.best == letter and record.fit.verdict == "fits"
        grid = palpate.read_map(maps / f"{letter}.map.h5")
        assert grid.T_learned_robot_object[0] > 500, "its frame is its own"
        expected = palpate.compose(about, grid.T_learned_robot_object)
        off = record.refined.T_robot_object - expected
        assert math.hypot(*off[:2]) < 0.3, off
        assert max(record.refined.sd[:2]) < 1.0
