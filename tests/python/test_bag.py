"""Bags of each storage become the recordings of what they hold; what they lack is said."""

import math
import os
import pathlib
import re
import struct
import subprocess
import sys
import warnings
from typing import Any

import numpy
import pytest

import palpate
from palpate import _bag_messages, _bag_transforms, read_bag
from palpate.bag import topics

from ros_bag import START_S, Bag, about_z, pointing_down

def readings(i: int) -> numpy.ndarray:
    return numpy.array([i + 0.5, 0.25, 3, i], dtype=numpy.float32)


def write_log(path: pathlib.Path, storage: str) -> pathlib.Path:
    """Ten frames every 0.1 s; the arm moves 10 mm a frame and turns, and holds the array pointing down.

    Messages arrive 5 ms after their time. Transforms come between the frames.
    """
    bag = Bag(path, storage)
    moving = "geometry_msgs/msg/TransformStamped"
    flange = bag.of(moving, bag.header(0.0, "arm"), "/array", bag.pose("Transform", 0, 0, -0.02, pointing_down(0)))
    cup = bag.of(moving, bag.header(0.0, "base"), "cup", bag.pose("Transform", 0.6, 0.1, 0, about_z(0.3)))
    array = "tf2_msgs/msg/TFMessage"
    bag.write("/tf_static", bag.of(array, [flange, cup]), START_S)
    for k in range(11):
        at = START_S + 0.1 * k - 0.05
        arm = bag.pose("Transform", 0.6 + 0.01 * (k - 0.5), 0.1, 0.3, about_z(0.05 * (k - 0.5)))
        edges = [bag.of(moving, bag.header(at, "/base"), "arm", arm)]
        bag.write("/tf", bag.of(array, edges), at + 0.005)
    for i in range(10):
        at = START_S + 0.1 * i
        layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
        bag.write("/plain", bag.of("std_msgs/msg/Float32MultiArray", layout, readings(i)), at)
        taxels = (100 * readings(i)).astype(numpy.uint16)
        fingers = [bag.of("lab_msgs/msg/Finger", name, part)
                   for name, part in (("a", taxels[:1]), ("b", taxels[1:]))]  # fmt: skip
        hand = bag.of("lab_msgs/msg/Hand", bag.header(at), numpy.array([7, 8], dtype=numpy.int32), fingers)
        bag.write("/hand", hand, at + 0.005)
        pose = bag.pose("Pose", 0.6 + 0.01 * i, 0.1, 0.28, pointing_down(0.05 * i))
        bag.write("/pose", bag.of("geometry_msgs/msg/PoseStamped", bag.header(at, "base"), pose), at + 0.005)
    return bag.close()


@pytest.fixture(params=["bag", "sqlite3", "mcap"])
def log(request: pytest.FixtureRequest, tmp_path: pathlib.Path) -> pathlib.Path:
    return write_log(tmp_path, request.param)


def expect_poses(recording: palpate.Recording) -> None:
    expected = [[600 + 10 * i, 100, 0.05 * i] for i in range(10)]
    # Times since 1970 resolve 0.2 us.
    numpy.testing.assert_allclose(recording.T_robot_sensor, expected, atol=1e-4)
    # Read row by row from the lower left corner, as the array's own frame has them, seen from above.
    assert recording.elements_mm.tolist() == [[-1, 1], [1, 1], [-1, -1], [1, -1]]
    numpy.testing.assert_allclose(recording.time_s, [START_S + 0.1 * i for i in range(10)], atol=1e-6)


def test_frames_take_the_chain_of_transforms(log: pathlib.Path) -> None:
    with pytest.warns(UserWarning) as said:
        recording = read_bag(
            log, pressure_topic="/hand", pressure_field="fingers.taxels", tf=("base", "array"),
            truth_tf=("base", "cup"), array=(2, 2, 2), pressure_unit="raw", object="cup",
        )  # fmt: skip
    expect_poses(recording)
    assert recording.pressure.tolist() == [(100 * readings(i)).astype(int).tolist() for i in range(10)]
    assert recording.truth is not None and recording.object == "cup" == recording.truth.object
    numpy.testing.assert_allclose(
        inverse(recording.truth.T_object_robot), [600, 100, 0.3], atol=1e-9
    )
    assert any("its y is turned over" in str(warning.message) for warning in said)


def inverse(pose: Any) -> list[float]:
    x, y, theta = pose
    c, s = math.cos(theta), math.sin(theta)
    return [-c * x - s * y, s * x - c * y, -theta]


def test_frames_take_the_poses_of_a_topic(log: pathlib.Path) -> None:
    seen: list[float] = []
    with pytest.warns(UserWarning) as said:
        recording = read_bag(
            log, pressure_topic="/plain", pose_topic="/pose", array="2:2:2", dead=(1,), progress=seen.append
        )
    expect_poses(recording)
    assert recording.pressure.tolist() == [readings(i).tolist() for i in range(10)]
    assert recording.valid is not None and recording.valid.tolist() == [True, False, True, True]
    words = " ".join(str(warning.message) for warning in said)
    assert "/plain: 10 of 10 messages have no time of their own" in words


def test_topics_are_listed(log: pathlib.Path) -> None:
    found = {topic.name: topic for topic in topics(log)}
    assert {name: (topic.messages, topic.guess) for name, topic in found.items()} == {
        "/hand": (10, ""), "/plain": (10, "pressures"), "/pose": (10, "poses"), "/tf": (11, "transforms"),
        "/tf_static": (1, "transforms"),
    }  # fmt: skip
    assert found["/pose"].type == "geometry_msgs/msg/PoseStamped"
    assert 8.0 < found["/pose"].rate_hz < 10.0


def test_what_a_log_lacks_is_said(log: pathlib.Path) -> None:
    def refused(words: str, **options: Any) -> None:
        given = {"pressure_topic": "/plain", "array": (2, 2, 2), **options}
        with pytest.raises(palpate.Error) as error:
            read_bag(log, **given)
        assert str(error.value).startswith(f"{log}: ") and words in str(error.value), error.value

    refused("has no topic /none; it has /hand, /plain", pressure_topic="/none")
    refused("/pose: geometry_msgs/msg/PoseStamped has no list of numbers", pressure_topic="/pose")
    refused("has the lists serial, fingers.taxels; name one by pressure_field", pressure_topic="/hand")
    refused("no list of numbers taxels; it has serial", pressure_topic="/hand", pressure_field="taxels")
    refused("/hand: lab_msgs/msg/Hand is no pose", pose_topic="/hand")
    refused("no chain of transforms joins these frames; the log has arm, array, base", tf=("base", "head"))
    refused("has 4 readings a frame for an array of 6 elements; correct array", array=(2, 3, 2))
    with pytest.raises(palpate.Error, match="both say where the sensor is"):
        read_bag(log, pressure_topic="/plain", array=(2, 2, 2), pose_topic="/p", tf=("a", "b"))


@pytest.mark.parametrize("storage", ["bag", "mcap"])
def test_known_types_need_no_field(tmp_path: pathlib.Path, storage: str) -> None:
    bag = Bag(tmp_path, storage)
    for i in range(2):
        at, row = START_S + i, readings(i)
        channels = [bag.of("sensor_msgs/msg/ChannelFloat32", "a", row[:3]),
                    bag.of("sensor_msgs/msg/ChannelFloat32", "b", row[3:])]  # fmt: skip
        bag.write("/state", bag.of("tactile_msgs/msg/TactileState", bag.header(at), channels), at)
        bag.write("/takktile", bag.of("takktile_ros/msg/Touch", row, 0 * row), at)
        taxels = [bag.of("xela_server_ros2/msg/Taxel", 1, 2, int(10 * value)) for value in row]
        full = [bag.of("xela_server_ros2/msg/SensorFull", at, part, numpy.array([], dtype=numpy.int32))
                for part in (taxels[:2], taxels[2:])]  # fmt: skip
        bag.write("/xela", bag.of("xela_server_ros2/msg/SensStream", full), at)
    log = bag.close()
    assert {topic.guess for topic in topics(log)} == {"pressures"}
    for topic, factor in (("/state", 1), ("/takktile", 1), ("/xela", 10)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            recording = read_bag(log, pressure_topic=topic, array=(2, 2, 2))
        expected = [[int(10 * v) if factor == 10 else float(v) for v in readings(i)] for i in range(2)]
        assert recording.pressure.tolist() == expected
        assert numpy.isnan(recording.T_robot_sensor).all()
    with pytest.raises(palpate.Error, match="has no list of numbers pressures; it has pressure, temp"):
        read_bag(log, pressure_topic="/takktile", pressure_field="pressures", array=(2, 2, 2))


def test_every_kind_of_pose_is_read(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "sqlite3")
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    covariance = numpy.zeros(36)
    zero = bag.of("geometry_msgs/msg/Vector3", 0, 0, 0)
    for i in range(3):
        at = START_S + i
        pose, transform = (bag.pose(kind, 0.1 * i, 0.2, 0, about_z(0.1 * i)) for kind in ("Pose", "Transform"))
        header = bag.header(at, "base")
        with_covariance = bag.of("geometry_msgs/msg/PoseWithCovariance", pose, covariance)
        twist = bag.of("geometry_msgs/msg/Twist", zero, zero)
        moving = bag.of("geometry_msgs/msg/TwistWithCovariance", twist, covariance)
        for topic, message in {
            "/pose": pose,
            "/stamped": bag.of("geometry_msgs/msg/PoseStamped", header, pose),
            "/covariance": bag.of("geometry_msgs/msg/PoseWithCovarianceStamped", header, with_covariance),
            "/odometry": bag.of("nav_msgs/msg/Odometry", header, "array", with_covariance, moving),
            "/transform": bag.of("geometry_msgs/msg/TransformStamped", header, "array", transform),
            "/plain": bag.of("std_msgs/msg/Float32MultiArray", layout, readings(i)),
        }.items():
            bag.write(topic, message, at)
    log = bag.close()
    for topic in ("/pose", "/stamped", "/covariance", "/odometry", "/transform"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            recording = read_bag(log, pressure_topic="/plain", pose_topic=topic, array=(2, 2, 2))
        expected = [[100 * i, 200, 0.1 * i] for i in range(3)]
        numpy.testing.assert_allclose(recording.T_robot_sensor, expected, atol=1e-4, err_msg=topic)


def test_frames_in_a_gap_of_transforms_have_no_pose(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "mcap")
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    for k in range(101):  # every 10 ms but for 0.4 s in the middle
        if not 30 < k < 70:
            at = START_S + 0.01 * k
            arm = bag.pose("Transform", 0.01 * k, 0, 0, about_z(0))
            edge = bag.of("geometry_msgs/msg/TransformStamped", bag.header(at, "base"), "array", arm)
            other = bag.of("geometry_msgs/msg/TransformStamped", bag.header(at, "base"), "other", arm)
            bag.write("/tf", bag.of("tf2_msgs/msg/TFMessage", [other, edge]), at)
    for i in range(6):  # slower than the transforms
        bag.write("/plain", bag.of("std_msgs/msg/Float32MultiArray", layout, readings(i)), START_S + 0.2 * i)
    log = bag.close()
    [file] = log.glob("*.mcap")
    with pytest.warns(UserWarning, match="2 of 6 frames have no pose"):
        recording = read_bag(file, pressure_topic="/plain", tf=("base", "array"), array=(2, 2, 2))
    known = ~numpy.isnan(recording.T_robot_sensor[:, 0])
    assert known.tolist() == [True, True, False, False, True, True]
    numpy.testing.assert_allclose(recording.T_robot_sensor[known, 0], [0, 200, 800, 1000], atol=1e-3)
    alone = tmp_path / "alone.mcap"
    alone.write_bytes(file.read_bytes())
    assert [topic.name for topic in topics(alone)] == ["/plain", "/tf"], "without its folder"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        wide = read_bag(
            log, pressure_topic="/plain", tf=("base", "array"), array=(2, 2, 2), largest_gap_s=1
        )
    numpy.testing.assert_allclose(wide.T_robot_sensor[:, 0], [200 * i for i in range(6)], atol=1e-3)
    for name, value in (("pose_delay", math.nan), ("largest_gap_s", -1.0)):
        with pytest.raises(palpate.Error, match=f"{name}=.*give seconds"):
            read_bag(
                log, pressure_topic="/plain", tf=("base", "array"), array=(2, 2, 2), **{name: value}
            )
    with pytest.raises(palpate.Error, match="tf array:cup: no chain"):
        read_bag(log, pressure_topic="/plain", tf=("array", "cup"), array=(2, 2, 2))


def test_chains_join_over_blocks(log: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {"pressure_topic": "/hand", "pressure_field": "fingers.taxels", "array": (2, 2, 2)}
    given |= {"tf": ("base", "array"), "truth_tf": ("base", "cup"), "pressure_unit": "raw"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        whole = read_bag(log, **given)
        monkeypatch.setattr(_bag_transforms, "_BLOCK", 4)
        joined = read_bag(log, **given)
    for name in ("pressure", "time_s", "T_robot_sensor"):
        assert numpy.array_equal(getattr(whole, name), getattr(joined, name)), name


def test_frames_come_in_the_order_of_their_times(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "mcap")
    for i, k in enumerate([3, 0, 7, 1, 2, 9, 4, 8, 5, 6]):
        finger = bag.of("lab_msgs/msg/Finger", "a", numpy.full(4, k, dtype=numpy.uint16))
        serial = numpy.array([7, 8], dtype=numpy.int32)
        bag.write("/hand", bag.of("lab_msgs/msg/Hand", bag.header(START_S + k), serial, [finger]), START_S + i)
    recording = read_bag(
        bag.close(), pressure_topic="/hand", pressure_field="fingers.taxels", array=(2, 2, 2), pressure_unit="raw"
    )
    assert recording.pressure.tolist() == [[float(k)] * 4 for k in range(10)]


def test_readings_that_fall_are_turned(log: pathlib.Path) -> None:
    given: dict[str, Any] = {"pressure_topic": "/plain", "array": (2, 2, 2)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rising, falling = read_bag(log, **given), read_bag(log, **given, sign=-1)
    assert numpy.array_equal(falling.pressure, -rising.pressure)


def test_only_wanted_transforms_are_kept(tmp_path: pathlib.Path) -> None:
    log = write_log(tmp_path, "mcap")

    def kept(target: str, source: str) -> dict[str, int]:
        with _bag_messages.opened(str(log)) as bag:
            tree = bag.transforms([(target, source)])
            bag.read([tree], None)
        return {name: len(edge.rows) // 7 for name, edge in tree.edges.items()}

    assert kept("base", "array") == {"array": 1, "arm": 11, "cup": 1}
    # What came before the chain was complete is forgotten, what came later not kept.
    assert kept("base", "cup") == {"array": 1, "arm": 0, "cup": 1}


@pytest.mark.parametrize("from_tf", [True, False])
def test_a_delay_of_the_poses_is_taken_from_their_times(log: pathlib.Path, from_tf: bool) -> None:
    poses: dict[str, Any] = {"tf": ("base", "array")} if from_tf else {"pose_topic": "/pose"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        recording = read_bag(log, pressure_topic="/plain", array=(2, 2, 2), pose_delay=0.02, **poses)
    # The arm moves by 10 mm in 0.1 s.
    numpy.testing.assert_allclose(
        recording.T_robot_sensor[1:9, 0], [602 + 10 * i for i in range(1, 9)], atol=0.01
    )


def test_clocks_that_differ_are_said(tmp_path: pathlib.Path) -> None:
    """Ten presses of 0.4 to 0.6 s each, and 0.5 s to the next place; poses are stamped 0.4 s late."""
    bag = Bag(tmp_path, "mcap")
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    at, place = START_S, 0.0
    for k in range(10):
        for i in range(45 + 3 * (k * k % 5)):
            pressed = i >= 25
            place += 0.0 if pressed else 0.0003
            values = numpy.array([9.5 * pressed, 0, 0, 0.5], dtype=numpy.float32)
            bag.write("/plain", bag.of("std_msgs/msg/Float32MultiArray", layout, values), at)
            arm = bag.pose("Pose", 0.6 + place, 0.1, 0.28, pointing_down(0))
            bag.write("/pose", bag.of("geometry_msgs/msg/PoseStamped", bag.header(at + 0.4, "base"), arm), at)
            at += 0.02
    log = bag.close()

    def said(**options: Any) -> str:
        with pytest.warns(UserWarning) as warned:
            read_bag(log, pressure_topic="/plain", array=(2, 2, 2), pose_topic="/pose", **options)
        return " ".join(str(warning.message) for warning in warned)

    assert re.search(r"/pose: the poses' clock seems 0\.(3|4)\d s ahead: .*pose_delay=0\.(3|4)", said()), said()
    assert "clock seems" not in said(pose_delay=0.4)


def test_what_a_callback_raises_is_not_the_logs_fault(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "mcap")
    layout = bag.of("std_msgs/msg/MultiArrayLayout", [], 0)
    for i in range(1000):
        bag.write("/plain", bag.of("std_msgs/msg/Float32MultiArray", layout, readings(i)), START_S + i)
    log = bag.close()

    def stop(fraction: float) -> None:
        raise ValueError(f"at {fraction}")

    with pytest.raises(ValueError, match="at 1.0"):
        read_bag(log, pressure_topic="/plain", array=(2, 2, 2), progress=stop)


def test_a_log_that_is_cut_off_is_said(tmp_path: pathlib.Path) -> None:
    log = write_log(tmp_path, "bag")
    log.write_bytes(log.read_bytes()[:3000])
    with pytest.raises(palpate.Error, match="log.bag: cannot be read as a bag"):
        topics(log)
    folder = write_log(tmp_path, "mcap")
    [storage] = folder.glob("*.mcap")
    storage.write_bytes(storage.read_bytes()[:200])
    with pytest.raises(palpate.Error, match="mcap: cannot be read as a bag"):
        topics(folder)
    with pytest.raises(palpate.Error, match="none.bag: no such file"):
        topics(tmp_path / "none.bag")


def test_a_length_beyond_all_memory_is_said(tmp_path: pathlib.Path) -> None:
    folder = write_log(tmp_path, "mcap")
    [storage] = folder.glob("*.mcap")
    whole = storage.read_bytes()
    storage.write_bytes(whole[:9] + struct.pack("<Q", 1 << 62) + whole[17:])  # of the first record
    with pytest.raises(palpate.Error, match=r"mcap: cannot be read as a bag \(a part of it does not fit"):
        topics(folder)


def test_the_program_writes_what_the_function_returns(tmp_path: pathlib.Path) -> None:
    log = write_log(tmp_path, "mcap")

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "palpate.bag", *map(str, arguments)], capture_output=True, text=True
        )

    listed = run(log, "--list")
    assert listed.returncode == 0 and "lab_msgs/msg/Hand" in listed.stdout, listed.stderr
    file = tmp_path / "f.h5"
    flags = ("--pressure-topic", "/plain", "--array", "2:2:2", "--tf", "base:array", "--plane", "0,0,1")
    done = run(log, *flags, "-o", file)
    assert done.returncode == 0, done.stderr
    assert "10 frames of 4 elements, 10 with a pose; next: palpate touches" in done.stdout
    assert "palpate.bag: " in done.stderr
    expect_poses(palpate.read_recording(file))
    unposed = run(log, *flags[:4], "-o", tmp_path / "unposed.h5")
    assert "none with a pose, as neither --tf nor --pose-topic is given" in unposed.stdout
    for arguments, words in (
        ((log,), "--pressure-topic: missing; --list shows"),
        ((log, *flags), "--output: missing"),
        ((log, *flags, "--tf", "base", "-o", file), "--tf base: give two frames, TARGET:SOURCE"),
        ((tmp_path / "none.bag", "--list"), "none.bag: no such file"),
        ((log, *flags, "-o", tmp_path), ": cannot be written; give a file in a folder that exists"),
        ((log, *flags, "-o", tmp_path / "none" / "f.h5"), ": cannot be written; give a file"),
        ((log, *flags, "--array", "2:3:2", "-o", file), "array of 6 elements; correct --array\n"),
        ((log, *flags, "--tf", "base:head", "-o", file), ": --tf base:head: no chain of transforms"),
        (
            (log, "--pressure-topic", "/hand", *flags[2:], "-o", file),
            "name one by --pressure-field\n",
        ),
    ):
        wrong = run(*arguments)
        assert wrong.returncode == 2 and words in wrong.stderr, wrong.stderr
        assert wrong.stderr.count("\n") == 1
    assert os.path.exists(file)
