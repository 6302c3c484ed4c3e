"""Frames of a bag that move although they should not: what is taken of them, and what is said."""

import math
import pathlib
from typing import Any

import numpy
import pytest

import palpate
from palpate import read_bag

from ros_bag import START_S, Bag, about_z


def write_frames(path: pathlib.Path, edges: list[tuple[str, float, str, str, float, float]]) -> pathlib.Path:
    """Ten frames every 0.1 s, and transforms: topic, time, parent, child, x in m, theta."""
    bag = Bag(path, "mcap")
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    for topic, at, parent, child, x, theta in sorted(edges, key=lambda edge: edge[1]):
        header = bag.header(START_S + at, parent)
        transform = bag.pose("Transform", x, 0, 0, about_z(theta))
        edge = bag.of("geometry_msgs/msg/TransformStamped", header, child, transform)
        bag.write(topic, bag.of("tf2_msgs/msg/TFMessage", [edge]), START_S + at)
    for i in range(10):
        at = START_S + 0.1 * i
        bag.write("/plain", bag.of("std_msgs/msg/Float32MultiArray", layout, numpy.zeros(4, numpy.float32)), at)
    return bag.close()


def read_frames(log: pathlib.Path, **options: Any) -> tuple[palpate.Recording, str]:
    with pytest.warns(UserWarning) as said:
        recording = read_bag(log, pressure_topic="/plain", array=(2, 2, 2), tf=("base", "array"), **options)
    return recording, " ".join(str(warning.message) for warning in said)


@pytest.mark.parametrize("still_at_s", [-1.0, 0.55, 2.0])
@pytest.mark.parametrize("still_parent", ["base", "table"])
def test_what_moves_in_tf_moves(tmp_path: pathlib.Path, still_at_s: float, still_parent: str) -> None:
    moving = [("/tf", 0.1 * k - 0.05, "base", "array", 0.01 * (k - 0.5), 0.0) for k in range(11)]
    still = ("/tf_static", still_at_s, still_parent, "array", 0.5, 0.0)
    table = ("/tf_static", -1.0, "base", "table", 0.1, 0.0)
    recording, said = read_frames(write_frames(tmp_path, [*moving, still, table]))
    numpy.testing.assert_allclose(recording.T_robot_sensor[:, 0], [10 * i for i in range(10)], atol=1e-4)
    assert "the frame array is in /tf_static, but moves in /tf: its transforms of /tf are taken" in said
    assert "the frame table" not in said


def test_what_other_frames_do_is_not_said(tmp_path: pathlib.Path) -> None:
    still = [("/tf_static", -1.0, "base", name, 0.0, 0.0) for name in ("array", "other")]
    _, said = read_frames(write_frames(tmp_path, [*still, ("/tf", 0.0, "base", "other", 0.1, 0.0)]))
    assert "moves in /tf" not in said


@pytest.mark.parametrize("mm, degrees, moves", [(0.9, 0.9, False), (1.1, 0.0, True), (0.0, 1.1, True)])
def test_an_object_that_moves_has_no_truth(
    tmp_path: pathlib.Path, mm: float, degrees: float, moves: bool
) -> None:
    def cup(k: int) -> tuple[str, float, str, str, float, float]:
        after = k > 6
        return "/tf", 0.1 * k, "base", "cup", 0.2 + 1e-3 * mm * after, math.radians(degrees) * after

    log = write_frames(
        tmp_path, [("/tf_static", -1.0, "base", "array", 0.0, 0.0), *(cup(k) for k in range(10))]
    )
    recording, said = read_frames(log, truth_tf=("base", "cup"), object="cup")
    words = f"the frame moves by {mm:.1f} mm and {degrees:.1f}°, so that the recording has no truth"
    assert (words in said) == moves
    assert (recording.truth is None) == moves and recording.object == "cup"
