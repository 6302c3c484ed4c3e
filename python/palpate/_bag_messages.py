"""The topics of a log of ROS, and which of their fields hold pressures and poses."""

import contextlib
import importlib
import re
import shlex
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from . import _palpate
from ._bag_fields import Poses, Pressures, _without_keys, parts_of
from ._bag_transforms import Transforms
from ._error import Error

#: Where the pressures of known types lie; of another type, the only list of numbers is taken.
_PRESSURES = {
    "tactile_msgs/msg/TactileState": "sensors.values",
    "takktile_ros/msg/Touch": "pressure",
    "xela_server_ros2/msg/SensStream": "sensors.taxels.z",
    "xela_server_ros/msg/SensStream": "sensors.taxels.z",
}
#: Types that hold a pose.
_POSES = (
    *(f"geometry_msgs/msg/Pose{what}" for what in ("", "2D", "Stamped", "WithCovariance", "WithCovarianceStamped")),
    "geometry_msgs/msg/Transform", "geometry_msgs/msg/TransformStamped", "nav_msgs/msg/Odometry",
)  # fmt: skip
#: Lists of flags beside the readings that say which of them are valid.
_FLAGS = ("valid", "validity", "is_valid", "mask", "valid_mask")
_FLAG = r"'(bool|byte|char|u?int\d+|float\d+)'"  #: kinds of numbers in definitions of rosbags
_NO_READINGS = ("/MultiArrayDimension", "/Time", "/Duration")  #: ends of types
#: Kinds of fields in definitions of rosbags: Nodetype.
_NAME, _LISTS = 2, (3, 4)
#: What mends a log that was cut off.
_MENDED_BY = {".bag": "rosbag reindex {}", ".mcap": "mcap recover {} -o MENDED.mcap",
              ".db3": "sqlite3 {} .recover | sqlite3 MENDED.db3"}  # fmt: skip
_PACKED = (".zstd", ".zst")
_TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")


@dataclass(frozen=True)
class Topic:
    """A topic of a log."""

    name: str
    type: str
    messages: int
    rate_hz: float  #: mean; 0 of a single message
    guess: str  #: "pressures", "poses", "transforms" or ""


class Bag:
    """An open log."""

    def __init__(self, name: str, reader: Any) -> None:
        self.name = name
        self.reader = reader

    def type_of(self, topic: str) -> str:
        topics = self.reader.topics
        if topic not in topics:
            raise Error(f"{self.name}: has no topic {topic}; it has {', '.join(topics) or 'none'}")
        return str(topics[topic].connections[0].msgtype)

    def fields(self, msgtype: str) -> dict[str, Any]:
        return dict(self.reader.typestore.fielddefs[msgtype][1])

    def has_header(self, msgtype: str) -> bool:
        _, kind = self.fields(msgtype).get("header", (0, ""))
        return bool(kind == "std_msgs/msg/Header")

    def lists(
        self, msgtype: str, path: str = "", in_list: bool = False, within: tuple[str, ...] = (), flags: str = ""
    ) -> Iterator[tuple[str, str]]:
        """The dotted paths of lists of numbers, also of one number in each item of a list, and the path of the
        flags beside each, or beside a list it is in; "" where there are none."""
        fields = self.fields(msgtype)
        own = (name for name in _FLAGS if re.search(_FLAG, str(fields.get(name))))
        flags = next((f"{path}.{name}".lstrip(".") for name in own), flags)
        for name, (kind, what) in fields.items():
            here = f"{path}.{name}" if path else name
            is_list = kind in _LISTS
            of, inner = what[0] if is_list else (kind, what)
            if of == _NAME:
                if name != "header" and inner not in within and not inner.endswith(_NO_READINGS):
                    yield from self.lists(inner, here, is_list or in_list, (*within, msgtype), flags)
            elif (is_list or in_list) and inner[0].startswith(("float", "int", "uint")):
                yield here, flags

    def pressure_path(self, msgtype: str) -> str | None:
        """Where the pressures of a type lie; None where several lists may be meant, or none."""
        found = dict(self.lists(msgtype))
        known = _PRESSURES.get(msgtype)
        readings = [path for path in found if path.rpartition(".")[2] not in _FLAGS]
        return known if known in found else readings[0] if len(readings) == 1 else None

    def pressures(self, topic: str, path: str | None) -> Pressures:
        msgtype = self.type_of(topic)
        where = f"{self.name}: {topic}: {msgtype}"
        if path is None:
            path = self.pressure_path(msgtype)
        found = dict(self.lists(msgtype))
        if path is None and found:
            raise Error(f"{where} has the lists {', '.join(found)}; name one by pressure_field")
        if path is None or _without_keys(path) not in found:
            raise Error(
                f"{where} has no list of numbers"
                + (f" {path}; it has {', '.join(found)}" if path and found else "; give another topic")
            )
        flags = found[_without_keys(path)].split(".")
        parts = re.findall(r"[^.[]+(?:\[[^]]*\])?", path)  # whose keys single out the flags, too
        beside = ".".join([*parts[: len(flags) - 1], flags[-1]])
        return Pressures(self.name, topic, path, self.has_header(msgtype), beside or None)

    def poses(self, topic: str, path: str | None, request: _palpate.ImportOptions) -> Poses:
        msgtype = self.type_of(topic)
        where = f"{self.name}: {topic}: {msgtype}"
        if path is None and msgtype not in _POSES:
            raise Error(
                f"{where} is no pose; name its field by pose_field, give a topic of "
                f"{', '.join(_POSES)}, or frames by tf"
            )
        fields = self.fields(msgtype)
        for first in [re.split(r"[.[]", part)[0] for part in parts_of(path or "")]:
            if first and first not in fields:
                raise Error(f"{where} has no field {first}; it has {', '.join(fields)}")
        return Poses(self.name, topic, path or "", self.has_header(msgtype), request)

    def transforms(self, wanted: list[tuple[str, str]]) -> Transforms:
        """The frames of all topics of transforms, of which these chains are wanted."""
        topics = {c.topic for c in self.reader.connections if c.msgtype in _TRANSFORMS if wanted}
        if wanted and not topics:
            raise Error(
                f"{self.name}: tf {':'.join(wanted[0])}: the log has no topic of transforms; give "
                "pose_topic"
            )
        if "/tf" in topics:  # of another robot, or of the past, are others
            topics &= {"/tf", "/tf_static"}
        static = {topic for topic in topics if topic.endswith("tf_static")}
        robots = {topic.rpartition("/")[0] for topic in topics} - {""}
        if len(topics - static) > 1 or len(robots) > 1:
            names = ", ".join(sorted(topics))
            raise Error(f"{self.name}: {names} may be of several robots; give a log of one, or pose_topic")
        return Transforms(self.name, topics, static, wanted)

    def read(
        self, parts: Sequence[Pressures | Poses | Transforms], progress: Callable[[float], object] | None
    ) -> None:
        """Gives every message of the parts' topics to them."""
        connections = [c for c in self.reader.connections if any(c.topic in part.topics for part in parts)]
        total = max(1, sum(c.msgcount for c in connections))
        for done, (topic, received_s, message) in enumerate(self._messages(connections), start=1):
            for part in parts:
                if topic in part.topics:
                    part.add(topic, message, received_s)
            if progress is not None and done % 1000 == 0:
                progress(done / total)

    def _messages(self, connections: list[Any]) -> Iterator[tuple[str, float, Any]]:
        """Topic, time of reception and message of each."""
        with _readable(self.name):
            for connection, received_ns, data in self.reader.messages(connections):
                message = self.reader.deserialize(data, connection.msgtype)
                yield connection.topic, 1e-9 * received_ns, message

    def topics(self) -> list[Topic]:
        duration_s = 1e-9 * self.reader.duration
        found = []
        for name, topic in self.reader.topics.items():
            msgtype, count = self.type_of(name), topic.msgcount
            rate = (count - 1) / duration_s if count > 1 and duration_s > 0.0 else 0.0
            found.append(Topic(name, msgtype, count, rate, self._guess(msgtype)))
        return found

    def _guess(self, msgtype: str) -> str:
        if msgtype in _TRANSFORMS:
            return "transforms"
        if msgtype in _POSES:
            return "poses"
        return "pressures" if self.pressure_path(msgtype) else ""


@contextmanager
def _readable(name: str) -> Iterator[None]:
    """Says of any failure of the reader that the log is at fault."""
    try:
        yield
    except Exception as error:  # a damaged bag may fail anywhere in rosbags
        memory = isinstance(error, MemoryError)  # for a length that is damaged, in all likelihood
        why = "a part of it does not fit into memory" if memory else str(error) or type(error).__name__
        raise Error(
            f"{name}: cannot be read as a bag ({' '.join(why.split())}); copy it again, or, where its recording "
            f"was cut off, mend it by: {_mended_by(Path(name), why)}"
        ) from None


def _mended_by(log: Path, why: str) -> str:
    """The command that mends a log, or of a folder, whose metadata are sound, its last file."""
    files = [file for file in log.glob("*.*") if file.suffix in (*_MENDED_BY, *_PACKED)]
    log = max(files, default=log) if "metadata" not in why else log
    if log.suffix in _PACKED:
        plain = f"UNPACKED{Path(log.stem).suffix}"
        return f"zstd -dc {shlex.quote(str(log))} > {plain}; {_mended_by(Path(plain), why)}"
    return _MENDED_BY.get(log.suffix, "ros2 bag reindex {}").format(shlex.quote(str(log)))


def _zstd() -> Any:
    """The module that reads Zstandard, Python's own or the one that rosbags brings."""
    for name in ("compression.zstd", "backports.zstd", "zstandard"):
        with contextlib.suppress(ImportError):
            return importlib.import_module(name)
    raise Error("a reader of Zstandard is missing; pip install 'palpate[bag]'")


def place(log: Path) -> Path:
    """What is read of a log: the folder of a file that stands in the folder's metadata.yaml, else itself."""
    metadata = log.parent / "metadata.yaml"
    text = metadata.read_text(errors="replace") if metadata.is_file() else ""
    listed = rf"^\s*-\s+['\"]?(?:.*/)?{re.escape(log.name)}['\"]?\s*$"
    return log.parent if re.search(listed, text, re.MULTILINE) else log


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
    path = place(path)
    kind = Path(path.stem).suffix if path.suffix in _PACKED else path.suffix
    if not path.is_dir() and kind not in _MENDED_BY:
        raise Error(f"{name}: is no bag; unpack it, or give a .bag, .db3, .mcap or .mcap.zstd file, or a folder")
    with contextlib.ExitStack() as stack:
        if path.suffix in _PACKED:  # compressed as a whole: a copy is read, which goes
            path = Path(stack.enter_context(tempfile.TemporaryDirectory())) / path.stem
            with _readable(name), _zstd().open(name, "rb") as packed, path.open("wb") as plain:
                shutil.copyfileobj(packed, plain)
        with _readable(name):
            reader = AnyReader([path], default_typestore=get_typestore(Stores.LATEST))
            reader.open()
        yield Bag(name, stack.enter_context(contextlib.closing(reader)))
