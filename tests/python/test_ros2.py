"""The example node's work without ROS: touches are found and recognised, messages say what was found."""

import importlib
import math
import pathlib
import runpy
import sys
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy
import pytest
from conftest import Maps, error_of, learned, warned
from rosbags.typesys import Stores, get_typestore

import palpate
from palpate import read_bag
from palpate.bag import readings

from ros_bag import START_S, Bag, about_z, pointing_down

ROOT = pathlib.Path(__file__).parents[2] / "examples" / "ros2"
sys.path.insert(0, str(ROOT))
conversion = importlib.import_module("palpate_ros2.conversion")
session = importlib.import_module("palpate_ros2.session")

TYPES = get_typestore(Stores.ROS2_HUMBLE)
#: Where the touched object was moved to, from where it was learned, in the robot's frame.
MOVED = (300.0, -200.0, 2.0)
#: Of the E in the stream.
T_ROBOT_OBJECT = palpate.inverse((5.0, 3.0, math.radians(40)))


def new(name: str) -> Any:
    """An empty message, as ROS makes them."""

    def empty(kind: int, what: Any) -> Any:
        if kind == 1:
            return {"string": "", "bool": False}.get(what[0], 0)
        if kind == 2:
            return new(what)
        return numpy.zeros(what[1] if kind == 3 else 0) if what[0][0] == 1 else []

    fields = TYPES.fielddefs[name][1]
    return TYPES.types[name](**{field: empty(*kind) for field, kind in fields})


def sent(message: Any) -> Any:
    """The message as a subscriber gets it; fails where a field's type or size is wrong."""
    name = message.__msgtype__
    if name == "nav_msgs/msg/OccupancyGrid":
        message.data = numpy.array(message.data, dtype=numpy.int8)
    return TYPES.deserialize_cdr(TYPES.serialize_cdr(message, name), name)


@pytest.fixture(scope="module", params="EI")
def record(device: palpate.Device, request: pytest.FixtureRequest) -> palpate.Record:
    """What is recognised of an E, or of an I that half a turn leaves as it is, that lies at MOVED."""
    of, grids = request.param, [learned(device, letter) for letter in "EI"]
    grids[1].symmetry = 2
    touched = palpate.simulate(of, palpate.random_poses(8, seed=4), T_object_robot=palpate.inverse(MOVED), seed=5)
    [record] = palpate.recognize(touched, grids, device=device)
    assert record.best == of
    return record


@pytest.fixture(scope="module")
def frames() -> list[palpate.Frame]:
    """Four touches of an E."""
    with palpate.open_sensor("simulate:E,object=5:3:40,touches=4,seed=3,speed=max") as sensor:
        return list(sensor)


def message_of(frame: palpate.Frame) -> Any:
    message = new("std_msgs/msg/Float32MultiArray")
    message.data = numpy.array(frame.values, dtype=numpy.float32)
    return message


def test_the_pose_is_that_of_the_record(record: palpate.Record) -> None:
    message = sent(conversion.pose_message(new, record, "base", START_S + 0.25, 0.05))
    assert message.header.frame_id == "base"
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (int(START_S), 250_000_000)
    pose, expected = message.pose.pose, record.refined.T_robot_object
    assert (pose.position.x, pose.position.y, pose.position.z) == pytest.approx((*expected[:2] / 1000, 0.05))
    q = pose.orientation
    assert (q.x, q.y, 2 * math.atan2(q.z, q.w)) == pytest.approx((0, 0, expected[2]), abs=1e-9)
    covariance = message.pose.covariance.reshape(6, 6)
    assert numpy.allclose(covariance, covariance.T, rtol=1e-9)
    assert not covariance[2:5].any(), "z, roll and pitch"
    sd = numpy.sqrt(covariance.diagonal()[[0, 1, 5]]) * (1000, 1000, 1)
    assert sd == pytest.approx(record.refined.sd, rel=1e-6)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_map_lies_where_the_object_lies(record: palpate.Record, mirrored: bool) -> None:
    # Two rows of three cells, 2 mm wide, the first centred at (10, 20) mm: one occupied, one empty.
    log_odds = numpy.full((2, 3), math.log(0.2 / 0.8))
    log_odds[0, 2], log_odds[1, 0] = math.log(9), -math.log(9)
    grid = palpate.OccupancyGrid("E", log_odds, cell_mm=2, origin_mm=(10, 20), prior=0.2)
    record = palpate.Record({**record, "mode": {**record.mode, "mirrored": mirrored}})
    message = sent(conversion.map_message(new, grid, record, "base", START_S, 0.05))
    info = message.info
    assert (message.header.frame_id, info.width, info.height) == ("base", 3, 2)
    assert info.resolution == pytest.approx(0.002)
    assert message.data.tolist() == ([90, -1, -1, -1, -1, 10] if mirrored else [-1, -1, 90, 10, -1, -1])
    # The middle of the occupied cell, seen from the grid's origin as subscribers see it.
    theta = 2 * math.atan2(info.origin.orientation.z, info.origin.orientation.w)
    corner = (info.origin.position.x, info.origin.position.y, theta)
    at = palpate.transform(corner, [(0.001 if mirrored else 0.005, 0.001)])[0]
    middle = (-14, 20) if mirrored else (14, 20)
    assert at == pytest.approx(palpate.transform(record.refined.T_robot_object, [middle])[0] / 1000)
    assert info.origin.position.z == 0.05


def test_markers_show_array_uncertainty_and_label(record: palpate.Record) -> None:
    elements_mm = palpate.grid_array(3, 2, 2.0)
    message = conversion.marker_messages(new, record, elements_mm, (10.0, 20.0, math.pi / 2), "base", START_S, 0.05)
    outline, ellipse, label = sent(message).markers
    assert [marker.id for marker in (outline, ellipse, label)] == [0, 1, 2]
    assert {marker.header.frame_id for marker in (outline, ellipse, label)} == {"base"}
    # The array is 4 x 2 mm between its outer centres, turned by a right angle.
    corners = [(point.x, point.y) for point in outline.points]
    expected = [(0.011, 0.018), (0.011, 0.022), (0.009, 0.022), (0.009, 0.018), (0.011, 0.018)]
    numpy.testing.assert_allclose(corners, expected, atol=1e-9)
    covariance = session.covariance_of(record)[:2, :2]
    theta = 2 * math.atan2(ellipse.pose.orientation.z, ellipse.pose.orientation.w)
    axis = numpy.array([math.cos(theta), math.sin(theta)])
    # Half the long axis is 2.448 deviations in its direction, which is the direction of the largest.
    assert (ellipse.scale.x / 2 * 1000 / 2.4477) ** 2 == pytest.approx(axis @ covariance @ axis, rel=1e-3)
    assert axis @ covariance @ axis == pytest.approx(numpy.linalg.eigvalsh(covariance)[-1], rel=1e-6)
    assert ellipse.scale.y <= ellipse.scale.x
    assert ellipse.pose.position.x == pytest.approx(record.refined.T_robot_object[0] / 1000)
    assert label.text.startswith(f"{record.best} ") and "fits" in label.text


def test_planar_poses_are_those_of_a_bag(tmp_path: pathlib.Path) -> None:
    bag = Bag(tmp_path, "mcap")
    poses = []
    for k, theta in enumerate((0.4, -2.5, 1.0, 1.0)):
        place, at = (0.6, 0.01 * k, 0.3, pointing_down(theta)), START_S + 0.05 * k
        bag.frames("/tf", [bag.edge("base", "array", at, *place)], at)
        if k < 3:  # the last transform comes after the last frame
            poses.append(session.planar_pose(bag.pose("Transform", *place))[0])
            bag.plain("/p", [9.5, 0, 0, 1], at)
    recording, _ = warned(read_bag, bag.close(), pressure_topic="/p", tf=("base", "array"), array=(2, 2, 2))
    # Times since 1970 resolve 0.2 us, in which this arm moves 5e-5 mm.
    numpy.testing.assert_allclose(recording.T_robot_sensor, poses, atol=1e-3)
    assert session.planar_pose(bag.pose("Transform", 0, 0, 0.3, about_z(3.0))) == (
        pytest.approx((0, 0, 3.0)), 0.3,
    )  # fmt: skip


def test_frames_of_another_array_and_touches_at_the_start_are_refused(
    maps: Maps, frames: list[palpate.Frame]
) -> None:
    array = palpate.Recording(numpy.zeros((2, 36)), [(0, 0, 0)] * 2, palpate.digitacts_array())
    stream = session.Session(array, maps)
    assert stream.map_of("E") is maps[1] and stream.map_of("(none)") is None
    assert "3 readings for an array of 36 elements" in error_of(stream.add, 0.0, [1.0, 2.0, 3.0])
    with pytest.raises(palpate.Error, match="touched while its baseline is taken"):
        for k, frame in enumerate(frames[120:200]):
            stream.add(0.01 * k, frame.values)
    state = "tactile_msgs/msg/TactileState"
    assert "has no list of numbers sensors.values" in error_of(readings, message_of(frames[0]), state)


def stand_ins(parameters: dict[str, Any], frames: list[palpate.Frame], asked: list[tuple[str, str]]) -> Any:
    """What node.py takes from ROS, which is not there: a node that keeps what it publishes and says, and the
    poses of the frames, whose frames of reference are asked for."""

    class Node:
        now_s = 0.0
        create_subscription = create_service = MagicMock()

        def __init__(self, name: str) -> None:
            assert name == "recognise"
            self.published: dict[str, list[Any]] = {"~/pose": [], "~/map": [], "~/markers": []}
            self.said: list[str] = []

        def declare_parameter(self, name: str, default: Any) -> Any:
            return SimpleNamespace(value=parameters.get(name, default))

        def create_publisher(self, kind: Any, topic: str, _: Any) -> Any:
            def publish(message: Any) -> None:
                assert message.__msgtype__ == kind().__msgtype__
                self.published[topic].append(message)

            return SimpleNamespace(publish=publish)

        def get_clock(self) -> Any:
            return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=round(1e9 * self.now_s)))

        def get_logger(self) -> Any:
            return SimpleNamespace(info=self.said.append, warning=lambda text, **_: self.said.append(text))

    class Buffer:
        def lookup_transform(self, target: str, source: str, at: Any, _: Any) -> Any:
            asked.append((target, source))
            frame = min(frames, key=lambda frame: abs(frame.host_time_s - 1e-9 * at.nanoseconds))
            x, y, theta = frame.T_robot_sensor
            transform = new("geometry_msgs/msg/TransformStamped")
            transform.transform.translation = TYPES.types["geometry_msgs/msg/Vector3"](x / 1000, y / 1000, 0.1)
            transform.transform.rotation = TYPES.types["geometry_msgs/msg/Quaternion"](*about_z(theta))
            return transform

    return MagicMock(
        Node=Node, Buffer=Buffer, Time=SimpleNamespace, TransformException=KeyError, ExternalShutdownException=OSError,
        get_message=lambda kind: lambda: new(kind),
    )  # fmt: skip


def test_the_node_publishes_what_it_finds(
    maps: Maps, frames: list[palpate.Frame], tmp_path: pathlib.Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    for grid in maps[:2]:
        grid.save(tmp_path / f"{grid.label}.map.h5")
    valid = numpy.ones((2, 36), dtype=numpy.uint8)
    valid[:, 7] = 0
    array = palpate.Recording(numpy.zeros((2, 36)), [(0, 0, 0)] * 2, palpate.digitacts_array(), valid=valid)
    array.save(tmp_path / "A.h5")
    parameters = {"maps": str(tmp_path), "recording": str(tmp_path / "A.h5"), "base_frame": "base"}
    asked: list[tuple[str, str]] = []
    ros = stand_ins(parameters, frames, asked)
    for name in ("rclpy", "rclpy.duration", "rclpy.executors", "rclpy.node", "rclpy.qos", "rclpy.time",
                 "rosidl_runtime_py", "rosidl_runtime_py.utilities", "std_srvs", "std_srvs.srv", "tf2_ros"):  # fmt: skip
        monkeypatch.setitem(sys.modules, name, ros)
    monkeypatch.delitem(sys.modules, "palpate_ros2.node", raising=False)
    node = importlib.import_module("palpate_ros2.node").Recognise()
    for frame in frames:
        node.now_s = frame.host_time_s
        message = message_of(frame)
        message.data[7] = 1e3 * len(asked)  # of the dead element
        node.take(message)
    assert asked == [("base", "array")] * 4
    assert [text for text in node.said if text.startswith("touch 4: E with probability 1.000, fits")]
    # Each message where something was found; the pose where it is sure.
    assert len(node.published["~/map"]) == len(node.published["~/markers"]) >= len(node.published["~/pose"]) >= 1
    pose = sent(node.published["~/pose"][-1])
    assert pose.header.frame_id == "base"
    at = pose.pose.pose.position
    assert (at.x, at.y, at.z) == pytest.approx((*T_ROBOT_OBJECT[:2] / 1000, 0.1), abs=1e-3)
    assert node.next_unknown(None, SimpleNamespace()).message == "forgot 4 touches"
    node.session.options["threshold"] = 1e3  # which no reading reaches
    for frame in frames:
        node.now_s = frame.host_time_s
        node.take(message_of(frame))
    assert "no touch has an element in contact" in node.said[-1]
    message = message_of(frames[0])
    message.data = message.data[:35]
    node.take(message)
    assert "35 readings for an array of 36 elements" in node.said[-1]


def test_the_launch_takes_the_nodes_parameters(monkeypatch: pytest.MonkeyPatch) -> None:
    ros: Any = MagicMock()
    for name in ("launch", "launch.actions", "launch.substitutions", "launch_ros.actions",
                 "launch_ros.parameter_descriptions"):  # fmt: skip
        monkeypatch.setitem(sys.modules, name, ros)
    runpy.run_path(str(ROOT / "launch" / "recognise.launch.py"))["generate_launch_description"]()
    [node] = ros.Node.call_args_list
    [values] = node.kwargs["parameters"]
    assert {"maps", "pressure_topic", "onset"} <= values.keys()
    declared = [each.args[0] for each in ros.DeclareLaunchArgument.call_args_list]
    assert declared == list(values)
