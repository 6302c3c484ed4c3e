"""The readings and poses in messages of a log of ROS, by the fields that hold them."""

import re
from array import array as numbers
from collections.abc import Sequence
from typing import Any

import numpy
from numpy.typing import NDArray

from ._bag_transforms import in_order, row_of, row_of_numbers, stamp_s
from ._error import Error

#: Fields by which an item of a list is called.
_NAMES = ("name", "label", "frame_id", "id")


def _without_keys(path: str) -> str:
    """The path without what names single items: "matrices.data" of "matrices[1].data"."""
    return re.sub(r"\[[^]]*\]", "", path)


def _item(items: Sequence[Any], key: str) -> Any:
    """The item of this index, or of this name or frame."""
    if re.fullmatch(r"\d+", key):
        if int(key) < len(items):
            return items[int(key)]
        raise Error(f"[{key}]: the list has {len(items)} items, counted from 0; give another one")
    called: list[str] = []
    for item in items:
        header = getattr(item, "header", None)
        names = [getattr(item, name) for name in _NAMES if hasattr(item, name)]
        names += [header.frame_id] if header is not None else []
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
        return in_order(self.time_s, self.values, self.elements)


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
