"""Bags of each storage become the recordings of what they hold; what they lack is said."""

import functools
import math
import pathlib
import re
import struct
import subprocess
import sys
from typing import Any
from unittest import mock

import numpy
import pytest
from conftest import error_of, warned
from program import run_program

import palpate
from palpate import _bag_messages, _bag_transforms, read_bag
from palpate.bag import _flag_parser, _in_flags, main, topics

from ros_bag import START_S, Bag, about_z, pointing_down

PLAIN: dict[str, Any] = {"pressure_topic": "/plain", "array": (2, 2, 2)}
HAND: dict[str, Any] = {**PLAIN, "pressure_topic": "/hand", "pressure_field": "fingers.taxels", "pressure_unit": "raw"}


def readings(i: int) -> numpy.ndarray:
    return numpy.array([i + 0.5, 0.25, 3, i], dtype=numpy.float32)


def write_log(path: pathlib.Path, storage: str) -> pathlib.Path:
    """Ten frames every 0.1 s; the arm moves 10 mm a frame and turns, and holds the array pointing down.

    Messages arrive 5 ms after their time. Transforms come between the frames.
    """
    bag = Bag(path, storage)
    flange = bag.edge("arm", "/array", 0.0, 0, 0, -0.02, pointing_down(0))
    cup = bag.edge("base", "cup", 0.0, 0.6, 0.1, 0, about_z(0.3))
    bag.frames("/tf_static", [flange, cup], START_S)
    for k in range(11):
        at, steps = START_S + 0.1 * k - 0.05, k - 0.5
        arm = bag.edge("/base", "arm", at, 0.6 + 0.01 * steps, 0.1, 0.3, about_z(0.05 * steps))
        bag.frames("/tf", [arm], at + 0.005)
    for i in range(10):
        at = START_S + 0.1 * i
        bag.plain("/plain", readings(i), at)
        taxels = (100 * readings(i)).astype(numpy.uint16)
        fingers = [bag.of("lab_msgs/msg/Finger", name, part)
                   for name, part in (("a", taxels[:1]), ("b", taxels[1:]))]  # fmt: skip
        hand = bag.of("lab_msgs/msg/Hand", bag.header(at), numpy.array([7, 8], dtype=numpy.int32), fingers)
        bag.write("/hand", hand, at + 0.005)
        bag.stamped_pose("/pose", at, at + 0.005, 0.6 + 0.01 * i, 0.1, 0.28, pointing_down(0.05 * i))
    return bag.close()


@pytest.fixture(scope="module", params=["bag", "sqlite3", "mcap"])
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    return write_log(tmp_path_factory.mktemp(request.param), request.param)


@pytest.fixture
def mcap(tmp_path: pathlib.Path) -> pathlib.Path:
    return write_log(tmp_path, "mcap")


def expect_poses(recording: palpate.Recording) -> None:
    expected = [[600 + 10 * i, 100, 0.05 * i] for i in range(10)]
    # Times since 1970 resolve 0.2 us.
    numpy.testing.assert_allclose(recording.T_robot_sensor, expected, atol=1e-4)
    # Read row by row from the lower left corner, as the array's own frame has them, seen from above.
    assert recording.elements_mm.tolist() == [[-1, 1], [1, 1], [-1, -1], [1, -1]]
    numpy.testing.assert_allclose(recording.time_s, [START_S + 0.1 * i for i in range(10)], atol=1e-6)


def test_frames_take_the_chain_of_transforms(log: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frames: dict[str, Any] = {**HAND, "tf": ("base", "array"), "truth_tf": ("base", "cup"), "object": "cup"}
    recording, said = warned(read_bag, log, **frames)
    expect_poses(recording)
    assert recording.pressure.tolist() == [(100 * readings(i)).astype(int).tolist() for i in range(10)]
    assert recording.truth is not None and recording.object == "cup" == recording.truth.object
    found = palpate.inverse(recording.truth.T_object_robot)
    numpy.testing.assert_allclose(found, [600, 100, 0.3], atol=1e-9)
    assert "its y is turned over" in said
    monkeypatch.setattr(_bag_transforms, "_BLOCK", 4)
    joined, _ = warned(read_bag, log, **frames)
    for name in ("pressure", "time_s", "T_robot_sensor"):
        assert numpy.array_equal(getattr(recording, name), getattr(joined, name)), "over blocks"


def test_frames_take_the_poses_of_a_topic(log: pathlib.Path) -> None:
    recording, said = warned(read_bag, log, **{**PLAIN, "array": "2:2:2"}, pose_topic="/pose", dead=(1,))
    expect_poses(recording)
    assert recording.pressure.tolist() == [readings(i).tolist() for i in range(10)]
    assert recording.valid is not None and recording.valid.tolist() == [True, False, True, True]
    assert "/plain: 10 of 10 messages have no time of their own" in said
    falling, _ = warned(read_bag, log, **PLAIN, sign=-1)
    assert numpy.array_equal(falling.pressure, -recording.pressure)


def test_topics_are_listed(log: pathlib.Path) -> None:
    found = {topic.name: topic for topic in topics(log)}
    assert {name: (topic.messages, topic.guess) for name, topic in found.items()} == {
        "/hand": (10, ""), "/plain": (10, "pressures"), "/pose": (10, "poses"), "/tf": (11, "transforms"),
        "/tf_static": (1, "transforms"),
    }  # fmt: skip
    assert found["/pose"].type == "geometry_msgs/msg/PoseStamped"
    assert 8.0 < found["/pose"].rate_hz < 10.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"pressure_topic": "/none"}, "has no topic /none; it has /hand, /plain"),
        ({"pressure_topic": "/pose"}, "/pose: geometry_msgs/msg/PoseStamped has no list of numbers"),
        ({"pressure_topic": "/hand", "pressure_field": "taxels"}, "no list of numbers taxels; it has serial"),
        ({"pose_topic": "/hand"}, "/hand: lab_msgs/msg/Hand is no pose"),
        ({"tf": ("base", "head")}, "joins these frames; on /tf, /tf_static are arm, array, base"),
        ({"pose_topic": "/p", "tf": ("a", "b")}, "both say where the sensor is"),
        ({"tf": ("base", "arm", "array")}, "tf ('base', 'arm', 'array'): give two frames"),
        ({"pressure_topic": "/tf", "pressure_field": "transforms[].transform.rotation.w"}, "has 1 readings"),
        ({"pressure_topic": []}, "pressure_topic: names no topic"),
        ({"tf": "base:array", "pose_field": "pose"}, "pose_field: is of the poses of a topic; give"),
        ({"euler": "vector"}, "euler: is of the poses of a topic; give pose_topic"),
        # Before all is read, of which the frames would be refused.
        ({"pose_topic": "/plain", "pose_field": "data", "truth_tf": "base:head", "object": "cup"}, "are of 4 numbers"),
        ({"tf": "base:array", "truth_tf": "base:cup"}, "truth_tf: needs the object's label"),
        ({"mount": (0, 0, 0, 0, 0, 0)}, "mount: is for poses; give pose_topic or tf"),
        ({"tf": ("base", "array"), "pose_delay": math.nan}, "pose_delay="),
        ({"tf": ("base", "array"), "largest_gap_s": -1.0}, "largest_gap_s="),
    ],
)
def test_what_a_log_lacks_is_said(log: pathlib.Path, options: dict[str, Any], words: str) -> None:
    said = error_of(read_bag, log, **{**PLAIN, **options})
    assert words in said
    assert said.startswith((f"{log}: ", *options)) or "give seconds" in said


@pytest.mark.parametrize("storage", ["bag", "mcap"])
def test_known_types_need_no_field(tmp_path: pathlib.Path, storage: str) -> None:
    bag = Bag(tmp_path, storage)
    for i in range(2):
        at, row = START_S + i, readings(i)
        channels = [bag.of("sensor_msgs/msg/ChannelFloat32", name, part)
                    for name, part in (("a", row[:3]), ("b", row[3:]))]  # fmt: skip
        bag.write("/state", bag.of("tactile_msgs/msg/TactileState", bag.header(at), channels), at)
        bag.write("/takktile", bag.of("takktile_ros/msg/Touch", row, 0 * row), at)
        taxels = [bag.of("xela_server_ros2/msg/Taxel", 1, 2, int(10 * value)) for value in row]
        full = [bag.of("xela_server_ros2/msg/SensorFull", at, part, numpy.array([], dtype=numpy.int32))
                for part in (taxels[:2], taxels[2:])]  # fmt: skip
        bag.write("/xela", bag.of("xela_server_ros2/msg/SensStream", full), at)
    log = bag.close()
    assert {topic.guess for topic in topics(log)} == {"pressures"}
    for topic, factor in (("/state", 1), ("/takktile", 1), ("/xela", 10)):
        recording, _ = warned(read_bag, log, **{**PLAIN, "pressure_topic": topic})
        expected = [[int(10 * v) if factor == 10 else float(v) for v in readings(i)] for i in range(2)]
        assert recording.pressure.tolist() == expected
        assert numpy.isnan(recording.T_robot_sensor).all()


def test_every_kind_of_pose_is_read(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "sqlite3")
    covariance = numpy.zeros(36)
    zero = bag.of("geometry_msgs/msg/Vector3", 0, 0, 0)
    for i in range(3):
        at, place = START_S + i, (0.1 * i, 0.2, 0, about_z(0.1 * i))
        pose, header = bag.pose("Pose", *place), bag.header(at, "base")
        with_covariance = bag.of("geometry_msgs/msg/PoseWithCovariance", pose, covariance)
        twist = bag.of("geometry_msgs/msg/Twist", zero, zero)
        moving = bag.of("geometry_msgs/msg/TwistWithCovariance", twist, covariance)
        for topic, message in {
            "/pose": pose,
            "/stamped": bag.of("geometry_msgs/msg/PoseStamped", header, pose),
            "/covariance": bag.of("geometry_msgs/msg/PoseWithCovarianceStamped", header, with_covariance),
            "/odometry": bag.of("nav_msgs/msg/Odometry", header, "array", with_covariance, moving),
            "/transform": bag.edge("base", "array", at, *place),
        }.items():
            bag.write(topic, message, at)
        bag.plain("/plain", readings(i), at)
    log = bag.close()
    for topic in ("/pose", "/stamped", "/covariance", "/odometry", "/transform"):
        recording, _ = warned(read_bag, log, **PLAIN, pose_topic=topic)
        expected = [[100 * i, 200, 0.1 * i] for i in range(3)]
        numpy.testing.assert_allclose(recording.T_robot_sensor, expected, atol=1e-4, err_msg=topic)


def test_frames_in_a_gap_of_transforms_have_no_pose(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "mcap")
    for k in range(101):  # every 10 ms but for 0.4 s in the middle
        if not 30 < k < 70:
            at = START_S + 0.01 * k
            edges = [bag.edge("base", child, at, 0.01 * k, 0, 0, about_z(0)) for child in ("other", "array")]
            bag.frames("/tf", edges, at)
    for i in range(6):  # slower than the transforms
        bag.plain("/plain", readings(i), START_S + 0.2 * i)
    log = bag.close()
    [file] = log.glob("*.mcap")
    recording, said = warned(read_bag, file, **PLAIN, tf=("base", "array"))
    assert "2 of 6 frames have no pose" in said
    known = ~numpy.isnan(recording.T_robot_sensor[:, 0])
    assert known.tolist() == [True, True, False, False, True, True]
    numpy.testing.assert_allclose(recording.T_robot_sensor[known, 0], [0, 200, 800, 1000], atol=1e-3)
    alone = file.rename(tmp_path / "alone.mcap")
    assert [topic.name for topic in topics(alone)] == ["/plain", "/tf"], "without its folder"
    wide, _ = warned(read_bag, alone, **PLAIN, tf=("base", "array"), largest_gap_s=1)
    numpy.testing.assert_allclose(wide.T_robot_sensor[:, 0], [200 * i for i in range(6)], atol=1e-3)


def test_frames_come_in_the_order_of_their_times(tmp_path: pathlib.Path) -> None:
    def read(step_s: float) -> palpate.Recording:
        bag = Bag(tmp_path / f"{step_s}", "mcap")
        for i, k in enumerate([3, 0, 7, 1, 2, 9, 4, 8, 5, 6]):
            finger = bag.of("lab_msgs/msg/Finger", "a", numpy.full(4, k, dtype=numpy.uint16))
            hand = bag.of("lab_msgs/msg/Hand", bag.header(START_S + k * step_s), numpy.zeros(2, numpy.int32), [finger])
            bag.write("/hand", hand, START_S + i)
        return read_bag(bag.close(), **HAND)

    assert read(0.1).pressure.tolist() == [[float(k)] * 4 for k in range(10)]
    assert "/hand: the clock steps back from 1700000003.000 to 1700000000.000 s" in error_of(read, 1.0)


def test_only_wanted_transforms_are_kept(mcap: pathlib.Path) -> None:
    def kept(target: str, source: str) -> dict[str, int]:
        with _bag_messages.opened(str(mcap)) as bag:
            tree = bag.transforms([(target, source)])
            bag.read([tree], None)
        return {name: len(edge.rows) for name, edge in tree.edges.items()}

    assert kept("base", "array") == {"array": 1, "arm": 11, "cup": 1}
    # What came before the chain was complete is forgotten, what came later not kept.
    assert kept("base", "cup") == {"array": 1, "arm": 0, "cup": 1}


@pytest.mark.parametrize("poses", [{"tf": ("base", "array")}, {"pose_topic": "/pose"}])
def test_a_delay_of_the_poses_is_taken_from_their_times(log: pathlib.Path, poses: dict[str, Any]) -> None:
    recording, _ = warned(read_bag, log, **PLAIN, pose_delay=0.02, **poses)
    # The arm moves by 10 mm in 0.1 s.
    expected = [602 + 10 * i for i in range(1, 9)]
    numpy.testing.assert_allclose(recording.T_robot_sensor[1:9, 0], expected, atol=0.01)


def test_clocks_that_differ_are_said(tmp_path: pathlib.Path) -> None:
    """Ten presses of 0.4 to 0.6 s each, and 0.5 s to the next place; poses are stamped 0.4 s late."""
    bag = Bag(tmp_path, "mcap")
    at, place = START_S, 0.0
    for k in range(10):
        for i in range(45 + 3 * (k * k % 5)):
            pressed = i >= 25
            place += 0.0 if pressed else 0.0003
            bag.plain("/plain", [9.5 * pressed, 0, 0, 0.5], at)
            bag.stamped_pose("/pose", at + 0.4, at, 0.6 + place, 0.1, 0.28, pointing_down(0))
            at += 0.02
    log = bag.close()
    _, said = warned(read_bag, log, **PLAIN, pose_topic="/pose")
    assert re.search(r"/pose: the poses' clock seems 0\.(3|4)\d s ahead: .*pose_delay=0\.(3|4)", said), said
    assert "clock seems" not in warned(read_bag, log, **PLAIN, pose_topic="/pose", pose_delay=0.4)[1]


def test_what_a_callback_raises_is_not_the_logs_fault(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "mcap")
    for i in range(1000):
        bag.plain("/plain", readings(i), START_S + i)
    log = bag.close()

    def stop(fraction: float) -> None:
        raise ValueError(f"at {fraction}")

    with pytest.raises(ValueError, match="at 1.0"):
        read_bag(log, **PLAIN, progress=stop)


def test_a_log_that_is_cut_off_or_not_there_is_said(tmp_path: pathlib.Path, mcap: pathlib.Path) -> None:
    log = write_log(tmp_path, "bag")
    log.write_bytes(log.read_bytes()[:3000])
    assert "log.bag: cannot be read as a bag" in error_of(topics, log)
    [storage] = mcap.glob("*.mcap")
    whole = storage.read_bytes()
    storage.with_name("other.mcap").write_bytes(whole[:200])
    assert "other.mcap: cannot be read as a bag" in error_of(topics, storage.with_name("other.mcap")), "not its folder"
    storage.write_bytes(whole[:200])
    assert "mcap: cannot be read as a bag" in error_of(topics, mcap)
    assert f"mend it by: mcap recover {storage} -o" in error_of(topics, storage)
    storage.write_bytes(whole[:9] + struct.pack("<Q", 1 << 62) + whole[17:])  # the length of the first record
    assert "mcap: cannot be read as a bag (a part of it does not fit" in error_of(topics, mcap)


def test_the_program_writes_what_the_function_returns(mcap: pathlib.Path, tmp_path: pathlib.Path) -> None:
    run = functools.partial(run_program, main)
    listed = subprocess.run([sys.executable, "-m", "palpate.bag", mcap, "--list"], capture_output=True, text=True)
    assert listed.returncode == 0 and "lab_msgs/msg/Hand" in listed.stdout, listed.stderr
    file = tmp_path / "f.h5"
    flags = ("--pressure-topic", "/plain", "--array", "2:2:2", "--tf", "base:array", "--plane", "0,0,1")
    done = run(mcap, *flags, "-o", file)
    assert done.status == 0, done.err
    assert "10 frames of 4 elements, 10 with a pose; next: palpate touches" in done.out
    assert "palpate.bag: " in done.err
    expect_poses(palpate.read_recording(file))
    with mock.patch("palpate.bag.topics", side_effect=KeyboardInterrupt):
        assert run(mcap, "--list").status == 130
    for said in ("log: /s: list: is no pose", "log: array:base: turned out of the robot's xy plane: x is"):
        assert _in_flags(said, _flag_parser()) == said, "no flag stands in it"
    posed = (*flags[:4], "--pose-topic", "/pose")
    unposed = run(mcap, *flags[:4], "-o", tmp_path / "unposed.h5")
    assert "none with a pose, as neither --tf nor --pose-topic is given" in unposed.out
    for arguments, words in (
        ((mcap,), "--pressure-topic: missing; --list shows"),
        ((mcap, *flags), "--output: missing"),
        ((mcap, *flags, "--tf", "base", "-o", file), "--tf base: give two frames, TARGET:SOURCE"),
        ((tmp_path / "none.bag", "--list"), "none.bag: no such file"),
        ((mcap, *flags, "-o", mcap / "metadata.yaml"), "metadata.yaml, which LOG reads; choose another name"),
        ((mcap, *flags, "--array", file, "-o", file), "f.h5, which --array reads; choose another name"),
        ((mcap, *flags, "-o", tmp_path), ": cannot be written; give a file in a folder that exists"),
        ((mcap, *flags, "-o", tmp_path / "none" / "f.h5"), ": cannot be written; give a file"),
        ((mcap, *flags, "--dead", "auto", "-o", file), "--dead auto: 'auto' is no element"),
        ((mcap, *flags, "--plane", "", "-o", file), "--plane: give auto, or "),
        ((mcap, "--pressure-topic", "/hand", "--pressure-field", "fingers.taxels", "--array", "2:2:2", "--pose-topic",
          "/pose", "--pose-field", "pose.position,pose.position", "-o", file),
         "/pose: its poses are x, y, z and three angles or a rotation vector; give --euler xyz, roll, pitch and yaw"),
        ((mcap, *posed, "--pose-unit", "m", "-o", file), "--pose-unit m: give mm,rad or"),
        ((mcap, *flags, "--mount", "auto", "-o", file), "--mount auto: give X,Y,Z,ROLL,PITCH,YAW"),
        ((mcap, *flags, "--mount", "", "-o", file), "--mount: give X,Y,Z,ROLL,PITCH,YAW, mm and degrees"),
        ((mcap, *flags, "--array", "2:3:2", "-o", file), "array of 6 elements; correct --array\n"),
        ((mcap, *flags, "--tf", "base:head", "-o", file), ": --tf base:head: no chain of transforms"),
        ((mcap, "--pressure-topic", "/hand", *flags[2:], "-o", file), "fingers.taxels; name one by --pressure-field\n"),
    ):
        wrong = run(*arguments)
        assert wrong.status == 2 and words in wrong.err, wrong.err
        assert wrong.err.count("\n") == 1
    assert file.exists()
