"""Bags whose messages hold pads of several fingers, poses in fields of their own, and flags; and frames that
move although they should not."""

import math
import pathlib
import types
from collections.abc import Callable
from typing import Any

import numpy
import pytest
from backports import zstd
from conftest import error_of, warned

import palpate
from palpate import read_bag
from palpate._bag_fields import Pressures, _item
from palpate.bag import topics

from ros_bag import START_S, Bag, about_z


def matrix(x: float, theta: float, y: float = 0.2) -> numpy.ndarray:
    c, s = math.cos(theta), math.sin(theta)
    return numpy.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]])


def write_states(path: pathlib.Path, skewed: int = -1) -> pathlib.Path:
    """Five states of a hand with a pad of two elements on each of two fingers, and a palm of one."""
    bag = Bag(path, "mcap")
    for i in range(5):
        at = START_S + 0.1 * i
        pads = [bag.of("lab_msgs/msg/Pad", name, numpy.array([i, first + i], dtype=numpy.float32),
                       numpy.array([True, name == "left" or i > 0]))
                for name, first in (("left", 10), ("right", 20))]  # fmt: skip
        pose = matrix(0.1 * i, 0.1 * i).T.ravel()
        pose[0] += 1.0 if i == skewed else 0.0
        tool = bag.pose("Pose", 0.1 * i, 0.2, 0.1, about_z(0.1 * i))
        bag.write("/state", bag.of("lab_msgs/msg/State", bag.header(at), pose, tool, pads), at)
        bag.plain("/palm", [7 + i], at + 0.01)
    return bag.close()


STATE: dict[str, Any] = {"pressure_topic": "/state", "array": (2, 1, 2), "pressure_field": "pads[left].values"}


def read(log: pathlib.Path, **options: Any) -> palpate.Recording:
    recording: palpate.Recording = warned(read_bag, log, **{**STATE, **options})[0]
    return recording


@pytest.mark.parametrize("key, first", [("left", 10), ("1", 20), ("right", 20)])
def test_one_part_of_a_list_is_read(tmp_path: pathlib.Path, key: str, first: int) -> None:
    log = write_states(tmp_path)
    recording, said = warned(read_bag, log, **{**STATE, "pressure_field": f"pads[{key}].values"})
    assert recording.pressure[1:].tolist() == [[i, first + i] for i in range(1, 5)]
    assert numpy.isnan(recording.pressure[0]).tolist() == [False, first == 20], "by its flags"
    assert ("1 readings are unknown by their flags pads" in said) == (first == 20)


@pytest.mark.parametrize("key, found", [("2", 2), ("7", 2), ("arm", 2), ("tool", 1)])
def test_an_item_is_one(key: str, found: int) -> None:
    names = [("tip", 1, "arm"), ("tip", 2, "tool"), ("arm", 7, "arm")]
    pads = [types.SimpleNamespace(name=name, id=number, frame_id=frame) for name, number, frame in names]
    assert _item(pads, key) is pads[found]
    assert "2 items are called so" in error_of(_item, pads, "tip")


@pytest.mark.parametrize("flags, words", [
    ([True, False], "2 readings are unknown"), ([[1, 0], [0, 0]], "3 readings are unknown"),
    (False, "4 readings are unknown"), ([1, 0, 1], "1 messages have not as many flags valid as readings"),
])  # fmt: skip
def test_a_flag_is_that_of_its_readings(flags: Any, words: str) -> None:
    pads = Pressures("log", "/pads", "values", False, "valid")
    pads.add("/pads", types.SimpleNamespace(values=[numpy.array([1, 2]), numpy.array([3, 4])], valid=flags), START_S)
    assert words in " ".join(pads.remarks())
    one = types.SimpleNamespace(values=[1], valid=1)
    assert "1 numbers in message 1, counted from 0, but 4" in error_of(pads.add, "/pads", one, START_S)
    assert "has no list of numbers values" in error_of(pads.add, "/pads", types.SimpleNamespace(q=1), START_S)


def test_pads_on_two_topics_are_one_array(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "mcap")
    for i in range(4):
        bag.plain("/left", [i, i], START_S + i)
        if i < 2:
            bag.plain("/palm", [5 + i], START_S + i + 0.01)
    hand = {"pressure_topic": ["/left", "/palm"], "pressure_field": None, "array": [[-1.0, 0], [1, 0], [9, 0]]}
    recording, said = warned(read_bag, bag.close(), **hand)
    assert recording.pressure[:2].tolist() == [[0, 0, 5], [1, 1, 6]] and "/palm: 2 frames of the first pad" in said
    assert numpy.isnan(recording.pressure[2:, 2]).all(), "the palm is silent"


def test_a_field_of_the_message_is_the_pose(tmp_path: pathlib.Path) -> None:
    log = write_states(tmp_path)
    expected = [[100 * i, 200, 0.1 * i] for i in range(5)]
    for field in ("tool", "O_T_EE"):
        recording = read(log, pose_topic="/state", pose_field=field)
        numpy.testing.assert_allclose(recording.T_robot_sensor, expected, atol=1e-6, err_msg=field)
    mounted = read(log, pose_topic="/state", pose_field="tool", mount=(10, 0, 0, 0, 0, 90))
    expected = [[100 * i + 10 * math.cos(0.1 * i), 200 + 10 * math.sin(0.1 * i), 0.1 * i + math.pi / 2]
                for i in range(5)]  # fmt: skip
    numpy.testing.assert_allclose(mounted.T_robot_sensor, expected, atol=1e-6)


#: The numbers of a pose at x in m and turned by t, and how they are read.
FORMS: dict[str, tuple[Callable[[float, float], Any], dict[str, Any]]] = {
    "vector": (lambda x, t: [x, 0, 0, math.pi * math.cos(t / 2), math.pi * math.sin(t / 2), 0], {"euler": "vector"}),
    "ZYX": (lambda x, t: [1e3 * x, 0, 0, math.degrees(t), 0, 180], {"euler": "ZYX", "pose_unit": ("mm", "deg")}),
    "twist": (lambda x, t: [x, 0, 0, 0, 0, t], {"euler": "xyz", "pose_topic": "/t", "pose_field": "linear,angular"}),
    "planar": (lambda x, t: [x, 0, t], {}),
    "w first": (lambda x, t: [x, 0, 0, *about_z(t)[[3, 0, 1, 2]]],
                {"pose_field": ",".join(f"data[{i}]" for i in (0, 1, 2, 4, 5, 6, 3))}),
    "rows": (lambda x, t: matrix(x, t, 0).ravel(), {}),  # the first one, at 0, is a rotation by columns, too
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_numbers_are_poses_as_in_tables(tmp_path: pathlib.Path, form: str) -> None:
    bag, (numbers, given) = Bag(tmp_path, "bag"), FORMS[form]
    for i in range(5):
        row = numpy.array(numbers(0.1 * i, 0.1 + 0.1 * i), numpy.float64)
        layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
        bag.write("/tcp", bag.of("std_msgs/msg/Float64MultiArray", layout, row), START_S + i)
        vectors = [bag.of("geometry_msgs/msg/Vector3", *part) for part in (row[:3], row[-3:])]
        bag.write("/t", bag.of("geometry_msgs/msg/Twist", *vectors), START_S + i)
        bag.plain("/plain", [i, 1], START_S + i)
    options = {"pressure_topic": "/plain", "array": (2, 1, 2), "pose_topic": "/tcp", "pose_field": "data", **given}
    recording, said = warned(read_bag, bag.close(), **options)
    numpy.testing.assert_allclose(recording.T_robot_sensor, [[100 * i, 0, 0.1 + 0.1 * i] for i in range(5)], atol=1e-9)
    assert (": its poses are " in said) == (form not in ("planar", "w first"))


def test_fields_that_a_message_lacks_are_named(tmp_path: pathlib.Path) -> None:
    log = write_states(tmp_path, skewed=3)
    for options, words in (
        ({"pressure_field": "pads[thumb].values"},
         "/state: pads[thumb].values: [thumb]: none of the 2 items has this index, counted from 0, name or frame; "
         "they are called left, right"),
        ({"pressure_field": "pads.values[0][0]"}, "message 0, counted from 0, has no list of numbers pads.values"),
        ({"pressure_topic": ["/state", "/palm"]}, "no list of numbers pads[left].values"),
        ({"pose_field": "O_T_EE"}, "/state[3]: the numbers are no rotation and position, read by columns"),
        ({"pose_field": "pads"}, "message 0, counted from 0, has no list of numbers pads"),
        ({"pose_field": "O_T_EE", "matrix": "rows"}, "/state[0]: the numbers are no rotation and position, read by r"),
        ({"pose_field": "tool,pose"}, "has no field pose; it has header, O_T_EE, tool, pads"),
        ({}, "name its field by pose_field"),
    ):  # fmt: skip
        poses = {} if "pressure_topic" in options else {"pose_topic": "/state"}
        poses |= {"pose_field": "tool"} if "pressure_field" in options else {}
        assert words in error_of(read_bag, log, **{**STATE, **poses, **options})


def test_a_compressed_file_is_read_and_a_cut_one_told_how_to_be_mended(tmp_path: pathlib.Path) -> None:
    [file] = write_states(tmp_path).glob("*.mcap")
    alone, packed = tmp_path / "log.mcap", tmp_path / "log.mcap.zstd"
    alone.write_bytes(file.read_bytes())
    packed.write_bytes(zstd.compress(file.read_bytes()))
    assert read(packed).pressure.tolist() == read(alone).pressure.tolist()
    assert [topic.name for topic in topics(packed)] == ["/palm", "/state"]
    alone.write_bytes(file.read_bytes()[:-300])
    said = error_of(read_bag, alone, **STATE)
    assert "log.mcap: cannot be read as a bag " in said and f": mcap recover {alone} -o" in said
    packed = packed.rename(tmp_path / "my log.mcap.zstd")
    packed.write_bytes(zstd.compress(file.read_bytes())[:-100])
    said = error_of(read_bag, packed, **STATE)
    assert f"zstd -dc '{packed}' > UNPACKED.mcap; mcap recover UNPACKED.mcap -o" in said
    assert "log.tar: is no bag; unpack it" in error_of(read_bag, alone.rename(tmp_path / "log.tar"), **STATE)
    file.write_bytes(file.read_bytes()[:-300])
    assert f"mend it by: mcap recover {file} -o" in error_of(read_bag, file.parent, **STATE)


# Frames that move


Edge = tuple[str, float, str, str, float, float]  #: topic, time, parent, child, x in m, theta


def read_frames(path: pathlib.Path, edges: list[Edge], **options: Any) -> tuple[palpate.Recording, str]:
    """Of a bag of ten frames every 0.1 s, and of transforms; and what is said."""
    bag = Bag(path, "mcap")
    for topic, at, parent, child, x, theta in sorted(edges, key=lambda edge: edge[1]):
        edge = bag.edge(parent, child, START_S + at, x, 0, 0, about_z(theta))
        bag.frames(topic, [edge], START_S + at)
    for i in range(10):
        bag.plain("/plain", numpy.zeros(4), START_S + 0.1 * i)
    return warned(read_bag, bag.close(), pressure_topic="/plain", array=(2, 2, 2), tf=("base", "array"), **options)


@pytest.mark.parametrize("still_at_s", [-1.0, 0.55, 2.0])
@pytest.mark.parametrize("still_parent", ["base", "table"])
def test_what_moves_in_tf_moves(tmp_path: pathlib.Path, still_at_s: float, still_parent: str) -> None:
    moving = [("/tf", 0.1 * k - 0.05, "base", "array", 0.01 * (k - 0.5), 0.0) for k in range(11)]
    still = ("/tf_static", still_at_s, still_parent, "array", 0.5, 0.0)
    table = ("/tf_static", -1.0, "base", "table", 0.1, 0.0)
    recording, said = read_frames(tmp_path, [*moving, still, table])
    numpy.testing.assert_allclose(recording.T_robot_sensor[:, 0], [10 * i for i in range(10)], atol=1e-4)
    assert "the frame array is in /tf_static, but moves in /tf: its transforms of /tf are taken" in said
    assert "the frame table" not in said


@pytest.mark.parametrize("edges, words", [
    ([("/a/tf", 0, "base", "array"), ("/b/tf", 0, "base", "cup")], "/a/tf, /b/tf may be of several robots"),
    ([("/tf", 0, "base", "cup"), ("/tf_old", 0, "base", "array")], "joins these frames; on /tf are base, cup"),
    ([("/tf", 5, "base", "array"), ("/tf", 6, "cup", "array"), ("/tf", 7, "base", "cup")],
     "time, 1700000000.000 to 1700000000.900 s; array (whose parent changes) is from 1700000006.000"),
])  # fmt: skip
def test_what_transforms_lack_is_said(tmp_path: pathlib.Path, edges: list[Any], words: str) -> None:
    assert words in error_of(read_frames, tmp_path, [(*edge, 0.1, 0.0) for edge in edges])


def test_what_other_frames_do_is_not_said(tmp_path: pathlib.Path) -> None:
    still = [("/tf_static", -1.0, "base", name, 0.0, 0.0) for name in ("array", "other")]
    _, said = read_frames(tmp_path, [*still, ("/tf", 0.0, "base", "other", 0.1, 0.0)])
    assert "moves in /tf" not in said


@pytest.mark.parametrize("mm, degrees, moves", [(0.9, 0.9, False), (1.1, 0.0, True), (0.0, 1.1, True)])
def test_an_object_that_moves_has_no_truth(
    tmp_path: pathlib.Path, mm: float, degrees: float, moves: bool
) -> None:
    places = [(0.2, 0.0)] * 7 + [(0.2 + 1e-3 * mm, math.radians(degrees))] * 3
    cup = [("/tf", 0.1 * k, "base", "cup", *place) for k, place in enumerate(places)]
    array = ("/tf_static", -1.0, "base", "array", 0.0, 0.0)
    recording, said = read_frames(tmp_path, [array, *cup], truth_tf=("base", "cup"), object="cup")
    words = f"the frame moves by {mm:.1f} mm and {degrees:.1f}°, so that the recording has no truth"
    assert (words in said) == moves
    assert (recording.truth is None) == moves and recording.object == "cup"
