"""The messages of a log of ROS: which topics it has, and the pressures and poses of one of them."""

import contextlib
import os
import re
import shutil
import tempfile
from array import array as numbers
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import NDArray

from ._bag_transforms import Transforms, row_of, row_of_numbers, stamp_s
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
#: Lists of flags beside the readings that say which of them are valid.
_FLAGS = ("valid", "validity", "is_valid", "mask", "valid_mask")
#: Fields by which an item of a list is called.
_NAMES = ("name", "label", "frame_id", "id")
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


def _without_keys(path: str) -> str:
    """The path without what names single items: "matrices.data" of "matrices[1].data"."""
    return re.sub(r"\[[^]]*\]", "", path)


def _item(items: Sequence[Any], key: str) -> Any:
    """The item of this index, or of this name or frame."""
    if re.fullmatch(r"\d+", key):
        if int(key) < len(items):
            return items[int(key)]
        raise Error(f"[{key}]: the list has {len(items)} items, counted from 0; give another one")
    called = []
    for item in items:
        header = getattr(item, "header", None)
        names = [getattr(item, name) for name in _NAMES if hasattr(item, name)]
        names += [header.frame_id] if hasattr(header, "frame_id") else []
        if key in map(str, names):
            return item
        called += map(str, names[:1])
    raise Error(f"[{key}]: no item has this name or frame; the list has {', '.join(called) or 'no names'}")


def _at(message: Any, path: str) -> Any:
    """The field of a dotted path; of lists, and lists in them, the field of each item, or of the one item
    that stands in brackets by its index, name or frame: "matrices[1].data"."""
    if isinstance(message, list):
        return [_at(item, path) for item in message]
    if not path:
        return message
    match = re.match(r"([^.[]*)(?:\[([^]]*)\])?\.?", path)
    assert match is not None
    field = getattr(message, match[1])
    return _at(field if match[2] is None else _item(field, match[2]), path[match.end():])


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

    def __init__(self, topic: str, has_header: bool, path: str, flags: str | None) -> None:
        super().__init__(topic, has_header)
        self.path = path
        self.flags = flags  #: where the flags of valid readings lie
        self.invalid = 0  #: readings
        self.elements = 0
        self.values = numbers("d")  #: frame by frame

    def add(self, topic: str, message: Any, received_s: float) -> None:
        values = self._field(message, self.path)
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
        readings = numpy.array(row, numpy.float64)
        if self.flags is not None:
            flags = _flat(self._field(message, self.flags))
            if len(flags) == len(readings):
                readings[numpy.array(flags) == 0.0] = numpy.nan
                self.invalid += flags.count(0.0)
        self.values.frombytes(readings.tobytes())
        self.time_s.append(self.time_of(message, received_s))

    def _field(self, message: Any, path: str) -> Any:
        try:
            return _at(message, path)
        except Error as error:
            raise Error(f"{self.topic}: {path}: {error}") from None

    def remarks(self, log: str) -> list[str]:
        if self.invalid:
            said = f"{log}: {self.topic}: {self.invalid} readings are unknown by their flags {self.flags}"
            return [*super().remarks(log), said]
        return super().remarks(log)

    def in_order(self) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
        """The frames' times [n], ascending, and their readings [n, e]."""
        time_s = numpy.frombuffer(self.time_s)
        rows: NDArray[numpy.float64] = numpy.frombuffer(self.values).reshape(-1, self.elements)
        if numpy.any(time_s[1:] < time_s[:-1]):
            order = numpy.argsort(time_s, kind="stable")
            time_s, rows = time_s[order], rows[order]
        return time_s, rows


def together(
    pads: Sequence[tuple[NDArray[numpy.float64], NDArray[numpy.float64]]],
) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
    """The frames of several pads as those of one array: at the times of the first, with the nearest frame of
    each other, whose readings are unknown where that is over 0.1 s away."""
    (time_s, rows), *others = pads
    if not others:
        return time_s, rows
    beside = [rows]
    for other_s, other in others:
        after = numpy.searchsorted(other_s, time_s).clip(max=len(other_s) - 1)
        before = (after - 1).clip(min=0)
        nearest = numpy.where(time_s - other_s[before] < other_s[after] - time_s, before, after)
        far = numpy.abs(other_s[nearest] - time_s) > 0.1
        beside.append(numpy.where(far[:, None], numpy.nan, other[nearest]))
    return time_s, numpy.hstack(beside)


class Poses(_Timed):
    """The poses of a topic."""

    def __init__(self, topic: str, has_header: bool, path: str) -> None:
        super().__init__(topic, has_header)
        self.path = path
        self.rows = numbers("d")  #: one behind the other

    def add(self, topic: str, message: Any, received_s: float) -> None:
        try:
            pose = _at(message, self.path)
            row = row_of(pose) if hasattr(pose, "__dict__") or hasattr(pose, "__slots__") else None
            self.rows.extend(row_of_numbers(_flat(pose)) if row is None else row)
        except (AttributeError, TypeError):
            raise Error(
                f"{self.topic}: {self.path or 'the message'}: is no pose, no transform, and no list of 7, 12 or "
                "16 numbers; give another pose_field"
            ) from None
        except ValueError:
            raise Error(
                f"{self.topic}: {self.path}: the matrix of message {len(self.time_s)}, counted from 0, is no "
                "rotation and position; give another pose_field"
            ) from None
        except Error as error:
            raise Error(f"{self.topic}: {self.path}: {error}") from None
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
        readings = [path for path in found if path.rpartition(".")[2] not in _FLAGS]
        return known if known in found else readings[0] if len(readings) == 1 else None

    def flags(self, msgtype: str, path: str) -> str | None:
        """Where the flags beside the readings of a path lie."""
        beside = path.rpartition(".")[0]
        of = msgtype
        for field in filter(None, _without_keys(beside).split(".")):
            kind, what = dict(self.fields(of))[field]
            of = what if kind == _NAME else what[0][1]
        names = dict(self.fields(of))
        return next((f"{beside}.{name}".lstrip(".") for name in _FLAGS if name in names), None)

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
        if path is None or _without_keys(path) not in found:
            raise Error(
                f"{self.name}: {topic}: {msgtype} has no list of numbers"
                + (f" {path}; it has {', '.join(found)}" if path and found else "; give another topic")
            )
        return Pressures(topic, self.has_header(msgtype), path, self.flags(msgtype, path))

    def poses(self, topic: str, path: str | None) -> Poses:
        msgtype = self.connections(topic)[0].msgtype
        first = re.split(r"[.[]", path or "")[0]
        if path is None and msgtype not in _POSES:
            raise Error(
                f"{self.name}: {topic}: {msgtype} is no pose; name its field by pose_field, give a topic of "
                f"{', '.join(sorted(_POSES))}, or frames by tf"
            )
        if first and first not in (fields := dict(self.fields(msgtype))):
            raise Error(f"{self.name}: {topic}: {msgtype} has no field {first}; it has {', '.join(fields)}")
        return Poses(topic, self.has_header(msgtype), _POSES[msgtype] if path is None else path)

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
        mend = (
            f"'rosbag reindex {name}'"
            if name.endswith(".bag")
            else f"'mcap recover {name} -o MENDED.mcap'"
            if name.endswith(".mcap")
            else "'ros2 bag reindex'"
        )
        raise Error(
            f"{name}: cannot be read as a bag ({why}); copy it again, or, where its recording was cut off, mend "
            f"it by {mend}"
        ) from None


@contextmanager
def _unpacked(name: str) -> Iterator[Path]:
    """The log's path, of one that is compressed as a whole that of a copy, which goes."""
    if not name.endswith(".zstd") and not name.endswith(".zst"):
        yield Path(name)
        return
    try:
        from compression import zstd
    except ImportError:
        from backports import zstd  # comes with rosbags
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / Path(name).stem
        with _readable(name), zstd.open(name) as packed, path.open("wb") as plain:
            shutil.copyfileobj(packed, plain)
        yield path


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
    if (path.parent / "metadata.yaml").exists() and re.search(r"\.(db3|mcap)(\.zstd?)?$", name):
        name = os.fspath(path.parent)
    with _unpacked(name) as unpacked:
        with _readable(os.fspath(path)):
            reader = AnyReader([unpacked], default_typestore=get_typestore(Stores.LATEST))
            reader.open()
        with contextlib.closing(reader):
            yield Bag(os.fspath(path), reader)
