"""Bags whose messages hold pads of several fingers, poses in fields of their own, and flags."""

import math
import pathlib
import subprocess
import sys
import warnings
from typing import Any

import numpy
import pytest
from backports import zstd

import palpate
from palpate import read_bag
from palpate.bag import topics

from ros_bag import START_S, Bag, about_z


def matrix(x: float, theta: float, by_rows: bool) -> numpy.ndarray:
    c, s = math.cos(theta), math.sin(theta)
    rows = numpy.array([[c, -s, 0, x], [s, c, 0, 0.2], [0, 0, 1, 0.1], [0, 0, 0, 1]])
    return rows.ravel() if by_rows else rows.T.ravel()


def write_states(path: pathlib.Path, by_rows: bool = False, skewed: int = -1) -> pathlib.Path:
    """Five states of a hand with a pad of two elements on each of two fingers, and a palm of one."""
    bag = Bag(path, "mcap")
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    for i in range(5):
        at = START_S + 0.1 * i
        pads = [bag.of("lab_msgs/msg/Pad", name, numpy.array([i, first + i], dtype=numpy.float32),
                       numpy.array([True, name == "left" or i > 0]))
                for name, first in (("left", 10), ("right", 20))]  # fmt: skip
        pose = matrix(0.1 * i, 0.1 * i, by_rows)
        pose[0] += 1.0 if i == skewed else 0.0
        tool = bag.pose("Pose", 0.1 * i, 0.2, 0.1, about_z(0.1 * i))
        bag.write("/state", bag.of("lab_msgs/msg/State", bag.header(at), pose, tool, pads), at)
        palm = numpy.array([7 + i], dtype=numpy.float32)
        bag.write("/palm", bag.of("std_msgs/msg/Float32MultiArray", layout, palm), at + 0.01)
    return bag.close()


def read(log: pathlib.Path, **options: Any) -> tuple[palpate.Recording, str]:
    given: dict[str, Any] = {"pressure_topic": "/state", "array": (2, 1, 2), "pressure_field": "pads[left].values"}
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        recording = read_bag(log, **{**given, **options})
    return recording, " ".join(str(warning.message) for warning in said)


@pytest.mark.parametrize("key, first", [("left", 10), ("1", 20), ("right", 20)])
def test_one_part_of_a_list_is_read(tmp_path: pathlib.Path, key: str, first: int) -> None:
    recording, said = read(write_states(tmp_path), pressure_field=f"pads[{key}].values")
    assert recording.pressure[1:].tolist() == [[i, first + i] for i in range(1, 5)]
    unknown = numpy.isnan(recording.pressure[0]).tolist()
    assert unknown == [False, first == 20], "by its flags"
    assert ("1 readings are unknown by their flags pads" in said) == (first == 20)


def test_parts_that_a_list_lacks_are_named(tmp_path: pathlib.Path) -> None:
    log = write_states(tmp_path)
    for key, words in (("thumb", "no item has this name or frame; the list has left, right"),
                       ("2", "the list has 2 items, counted from 0")):  # fmt: skip
        with pytest.raises(palpate.Error, match=f"/state: pads.*: .{key}.: {words}"):
            read(log, pressure_field=f"pads[{key}].values")


def test_pads_on_two_topics_are_one_array(tmp_path: pathlib.Path) -> None:
    elements = numpy.array([[-1.0, 0], [1, 0], [9, 0]])
    with pytest.raises(palpate.Error, match="no list of numbers pads.left..values"):
        read(write_states(tmp_path), pressure_topic=["/state", "/palm"], array=elements)
    bag = Bag(tmp_path / "two", "mcap")
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    for i in range(4):
        for topic, late_s, values in (("/left", 0.0, [i, i]), ("/palm", 0.01, [5 + i])):
            if topic == "/left" or i < 2:
                row = numpy.array(values, dtype=numpy.float32)
                bag.write(topic, bag.of("std_msgs/msg/Float32MultiArray", layout, row), START_S + i + late_s)
    recording, _ = read(bag.close(), pressure_topic=["/left", "/palm"], pressure_field=None, array=elements)
    assert recording.pressure[:2].tolist() == [[0, 0, 5], [1, 1, 6]]
    assert numpy.isnan(recording.pressure[2:, 2]).all(), "the palm is silent"


@pytest.mark.parametrize("by_rows", [False, True])
@pytest.mark.parametrize("field", ["tool", "O_T_EE"])
def test_a_field_of_the_message_is_the_pose(tmp_path: pathlib.Path, field: str, by_rows: bool) -> None:
    log = write_states(tmp_path, by_rows)
    recording, _ = read(log, pose_topic="/state", pose_field=field)
    numpy.testing.assert_allclose(recording.T_robot_sensor, [[100 * i, 200, 0.1 * i] for i in range(5)], atol=1e-6)


def test_a_mount_takes_the_flange_to_the_array(tmp_path: pathlib.Path) -> None:
    recording, _ = read(
        write_states(tmp_path), pose_topic="/state", pose_field="tool", mount=(10, 0, 0, 0, 0, 90)
    )
    expected = [[100 * i + 10 * math.cos(0.1 * i), 200 + 10 * math.sin(0.1 * i), 0.1 * i + math.pi / 2]
                for i in range(5)]  # fmt: skip
    numpy.testing.assert_allclose(recording.T_robot_sensor, expected, atol=1e-6)


def test_fields_that_are_no_pose_are_named(tmp_path: pathlib.Path) -> None:
    log = write_states(tmp_path, skewed=3)
    for field, words in (("O_T_EE", "the matrix of message 3, counted from 0, is no rotation"),
                         ("pads", "is no pose, no transform"),
                         ("pose", "has no field pose; it has header, O_T_EE, tool, pads")):  # fmt: skip
        with pytest.raises(palpate.Error, match=words):
            read(log, pose_topic="/state", pose_field=field)
    with pytest.raises(palpate.Error, match="name its field by pose_field"):
        read(log, pose_topic="/state")


def test_a_compressed_file_is_read_and_a_cut_one_told_how_to_be_mended(tmp_path: pathlib.Path) -> None:
    [file] = write_states(tmp_path).glob("*.mcap")
    alone = tmp_path / "log.mcap"
    alone.write_bytes(file.read_bytes())
    packed = tmp_path / "log.mcap.zstd"
    packed.write_bytes(zstd.compress(file.read_bytes()))
    assert read(packed)[0].pressure.tolist() == read(alone)[0].pressure.tolist()
    assert [topic.name for topic in topics(packed)] == ["/palm", "/state"]
    alone.write_bytes(file.read_bytes()[:-300])
    with pytest.raises(palpate.Error, match="log.mcap: cannot be read as a bag .*'mcap recover .*log.mcap -o"):
        read(alone)
    packed.write_bytes(zstd.compress(file.read_bytes())[:-100])
    with pytest.raises(palpate.Error, match="log.mcap.zstd: cannot be read as a bag"):
        read(packed)


def test_the_command_takes_them(tmp_path: pathlib.Path) -> None:
    log = write_states(tmp_path)
    run = subprocess.run(
        [sys.executable, "-m", "palpate.bag", log, "--pressure-topic", "/state", "--pressure-field",
         "pads[left].values", "--pose-topic", "/state", "--pose-field", "tool", "--mount", "0,0,0,0,0,0",
         "--array", "2:1:2", "-o", tmp_path / "f.h5"], capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert "5 frames of 2 elements, 5 with a pose" in run.stdout
