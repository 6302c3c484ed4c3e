"""The messages of a log of ROS: which topics it has, and the pressures and poses of one of them."""

from array import array as numbers
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import NDArray

from ._bag_transforms import Transforms, row_of, stamp_s
from ._error import Error

#: Where the pressures of known types lie; of another type, the only list of numbers is taken.
_PRESSURES = {
    "tactile_msgs/msg/TactileState": "sensors.values",
    "takktile_ros/msg/Touch": "pressure",
    "xela_server_ros2/msg/SensStream": "sensors.taxels.z",
    "xela_server_ros/msg/SensStream": "sensors.taxels.z",
}
#: Where the poses of known types lie.
_POSES = {
    "geometry_msgs/msg/Pose": "",
    "geometry_msgs/msg/PoseStamped": "pose",
    "geometry_msgs/msg/PoseWithCovariance": "pose",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose",
    "geometry_msgs/msg/Transform": "",
    "geometry_msgs/msg/TransformStamped": "transform",
    "nav_msgs/msg/Odometry": "pose.pose",
}
#: Kinds of fields in definitions of rosbags: Nodetype.
_BASE, _NAME, _LISTS = 1, 2, (3, 4)
_TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")


@dataclass(frozen=True)
class Topic:
    """A topic of a log."""

    name: str
    type: str
    messages: int
    rate_hz: float  #: mean; 0 of a single message
    guess: str  #: "pressures", "poses", "transforms" or ""


def _at(message: Any, path: str) -> Any:
    """The field of a dotted path; of lists, and lists in them, the field of each item."""
    if isinstance(message, list):
        return [_at(item, path) for item in message]
    field, _, rest = path.partition(".")
    return _at(getattr(message, field), rest) if field else message


def _flat(values: Any) -> list[float]:
    """The numbers of a list, or of lists in it."""
    if hasattr(values, "tolist"):
        values = values.tolist()
    if isinstance(values, (int, float)):
        return [float(values)]
    flat: list[float] = []
    for value in values:
        flat += [float(value)] if isinstance(value, (int, float)) else _flat(value)
    return flat


class _Timed:
    """Messages of one topic, at their headers' times, or at those of their reception."""

    def __init__(self, topic: str, has_header: bool) -> None:
        self.topics = {topic}
        self.topic = topic
        self.has_header = has_header
        self.received = 0
        self.time_s = numbers("d")

    def time_of(self, message: Any, received_s: float) -> float:
        time_s = stamp_s(message.header.stamp) if self.has_header else 0.0
        if time_s <= 0.0:
            self.received += 1
            return received_s
        return time_s

    def require_some(self, log: str) -> None:
        if not self.time_s:
            raise Error(f"{log}: {self.topic}: holds no message; record it, or give another topic")

    def remarks(self, log: str) -> list[str]:
        if not self.received:
            return []
        return [
            f"{log}: {self.topic}: {self.received} of {len(self.time_s)} messages have no time of their "
            "own; the times of their reception are taken"
        ]


class Pressures(_Timed):
    """The readings of a topic."""

    def __init__(self, topic: str, has_header: bool, path: str) -> None:
        super().__init__(topic, has_header)
        self.path = path
        self.elements = 0
        self.values = numbers("d")  #: frame by frame

    def add(self, topic: str, message: Any, received_s: float) -> None:
        values = _at(message, self.path)
        row = values if hasattr(values, "dtype") and values.ndim == 1 else _flat(values)
        if not self.time_s:
            self.elements = len(row)
            if not self.elements:
                raise Error(f"{self.topic}: {self.path}: holds no reading; give another field")
        if len(row) != self.elements:
            raise Error(
                f"{self.topic}: {self.path}: {len(row)} readings in message {len(self.time_s)}, counted "
                f"from 0, but {self.elements} before; give a topic or a field of one length"
            )
        self.values.frombytes(numpy.asarray(row, numpy.float64).tobytes())
        self.time_s.append(self.time_of(message, received_s))

    def in_order(self) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
        """The frames' times [n], ascending, and their readings [n, e]."""
        time_s = numpy.frombuffer(self.time_s)
        rows: NDArray[numpy.float64] = numpy.frombuffer(self.values).reshape(-1, self.elements)
        if numpy.any(time_s[1:] < time_s[:-1]):
            order = numpy.argsort(time_s, kind="stable")
            time_s, rows = time_s[order], rows[order]
        return time_s, rows


class Poses(_Timed):
    """The poses of a topic."""

    def __init__(self, topic: str, has_header: bool, path: str) -> None:
        super().__init__(topic, has_header)
        self.path = path
        self.rows = numbers("d")  #: one behind the other

    def add(self, topic: str, message: Any, received_s: float) -> None:
        self.rows.extend(row_of(_at(message, self.path)))
        self.time_s.append(self.time_of(message, received_s))

    def in_order(self) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
        """Times, ascending, and the first pose of each, [n, 7]."""
        times, first = numpy.unique(numpy.frombuffer(self.time_s), return_index=True)
        return times, numpy.frombuffer(self.rows).reshape(-1, 7)[first]


class Bag:
    """An open log."""

    def __init__(self, name: str, reader: Any) -> None:
        self.name = name
        self.reader = reader

    def connections(self, topic: str) -> list[Any]:
        found = [connection for connection in self.reader.connections if connection.topic == topic]
        if not found:
            known = sorted({connection.topic for connection in self.reader.connections})
            raise Error(f"{self.name}: has no topic {topic}; it has {', '.join(known) or 'none'}")
        return found

    def fields(self, msgtype: str) -> list[tuple[str, Any]]:
        return list(self.reader.typestore.fielddefs[msgtype][1])

    def has_header(self, msgtype: str) -> bool:
        return any(
            name == "header" and kind[1] == "std_msgs/msg/Header" for name, kind in self.fields(msgtype)
        )

    def lists(self, msgtype: str, path: str = "", within: tuple[str, ...] = ()) -> Iterator[str]:
        """The dotted paths of lists of numbers, also of one number in each item of a list."""
        for name, (kind, what) in self.fields(msgtype):
            here = f"{path}.{name}" if path else name
            if name == "header" or (kind == _NAME and what in within):
                continue
            if kind == _NAME:
                yield from self.lists(what, here, (*within, msgtype))
            elif kind in _LISTS and what[0][0] == _NAME:
                inner = what[0][1]
                if inner not in within and not inner.endswith("/MultiArrayDimension"):
                    yield from self.lists(inner, here, (*within, msgtype))
                    yield from (
                        f"{here}.{member}"
                        for member, (of, base) in self.fields(inner)
                        if of == _BASE and base[0].startswith(("float", "int", "uint"))
                    )
            elif kind in _LISTS and what[0][1][0].startswith(("float", "int", "uint")):
                yield here

    def pressure_path(self, msgtype: str) -> str | None:
        """Where the pressures of a type lie; None where several lists may be meant, or none."""
        found = list(self.lists(msgtype))
        known = _PRESSURES.get(msgtype)
        return known if known in found else found[0] if len(found) == 1 else None

    def pressures(self, topic: str, path: str | None) -> Pressures:
        msgtype = self.connections(topic)[0].msgtype
        if path is None:
            path = self.pressure_path(msgtype)
        found = list(self.lists(msgtype))
        if path is None and found:
            raise Error(
                f"{self.name}: {topic}: {msgtype} has the lists {', '.join(found)}; name one by "
                "pressure_field"
            )
        if path is None or path not in found:
            raise Error(
                f"{self.name}: {topic}: {msgtype} has no list of numbers"
                + (f" {path}; it has {', '.join(found)}" if path and found else "; give another topic")
            )
        return Pressures(topic, self.has_header(msgtype), path)

    def poses(self, topic: str) -> Poses:
        msgtype = self.connections(topic)[0].msgtype
        if msgtype not in _POSES:
            raise Error(
                f"{self.name}: {topic}: {msgtype} is no pose; give a topic of "
                f"{', '.join(sorted(_POSES))}, or frames by tf"
            )
        return Poses(topic, self.has_header(msgtype), _POSES[msgtype])

    def transforms(self, wanted: list[tuple[str, str]]) -> Transforms:
        topics = {c.topic for c in self.reader.connections if c.msgtype in _TRANSFORMS}
        if not topics:
            raise Error(
                f"{self.name}: tf {':'.join(wanted[0])}: the log has no topic of transforms; give "
                "pose_topic"
            )
        static = {topic for topic in topics if topic.endswith("tf_static")}
        return Transforms(topics, static, wanted)

    def read(
        self, parts: Sequence[Pressures | Poses | Transforms], progress: Callable[[float], object] | None
    ) -> None:
        takers: dict[str, list[Any]] = {}
        for part in parts:
            for topic in part.topics:
                takers.setdefault(topic, []).append(part)
        connections = [c for c in self.reader.connections if c.topic in takers]
        total = max(1, sum(c.msgcount for c in connections))
        done = 0
        for topic, received_s, message in self.messages(connections):
            for part in takers[topic]:
                part.add(topic, message, received_s)
            done += 1
            if progress is not None and done % 1000 == 0:
                progress(done / total)

    def messages(self, connections: list[Any]) -> Iterator[tuple[str, float, Any]]:
        """Topic, time of reception and message of each."""
        with _readable(self.name):
            for connection, received_ns, data in self.reader.messages(connections):
                message = self.reader.deserialize(data, connection.msgtype)
                yield connection.topic, 1e-9 * received_ns, message

    def topics(self) -> list[Topic]:
        duration_s = 1e-9 * self.reader.duration
        counts: dict[tuple[str, str], int] = {}
        for connection in self.reader.connections:
            key = (connection.topic, connection.msgtype)
            counts[key] = counts.get(key, 0) + connection.msgcount
        found = []
        for (topic, msgtype), count in sorted(counts.items()):
            guess = (
                "transforms"
                if msgtype in _TRANSFORMS
                else "poses"
                if msgtype in _POSES
                else "pressures"
                if self.pressure_path(msgtype)
                else ""
            )
            rate = (count - 1) / duration_s if count > 1 and duration_s > 0.0 else 0.0
            found.append(Topic(topic, msgtype, count, rate, guess))
        return found


@contextmanager
def _readable(name: str) -> Iterator[None]:
    """Says of any failure of the reader that the log is at fault."""
    try:
        yield
    except Exception as error:  # a damaged bag may fail anywhere in rosbags
        memory = isinstance(error, MemoryError)  # for a length that is damaged, in all likelihood
        why = "a part of it does not fit into memory" if memory else str(error) or type(error).__name__
        raise Error(f"{name}: cannot be read as a bag ({why}); copy it again, or reindex it") from None


@contextmanager
def opened(name: str) -> Iterator[Bag]:
    """The log. Raises Error where it cannot be read, or rosbags is missing."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise Error("rosbags is missing; pip install 'palpate[bag]'") from None
    path = Path(name)
    if not path.exists():
        raise Error(f"{name}: no such file or folder; give a bag")
    if path.suffix in (".db3", ".mcap") and (path.parent / "metadata.yaml").exists():
        path = path.parent
    with _readable(name):
        reader = AnyReader([path], default_typestore=get_typestore(Stores.LATEST))
        reader.open()
    try:
        yield Bag(name, reader)
    finally:
        reader.close()
