"""The readings and poses in messages of a log of ROS, by the fields that hold them."""

import functools
import re
from collections.abc import Sequence
from typing import Any

import numpy

from . import _palpate
from ._bag_transforms import Numbers, Rows, stamp_s
from ._error import Error

#: Fields by which an item of a list is called.
_NAMES = ("name", "label", "id", "child_frame_id", "frame_id", "header.frame_id")


def parts_of(path: str) -> list[str]:
    """The paths that commas separate."""
    return re.split(r",(?![^[]*\])", path)


def _without_keys(path: str) -> str:
    """The path without what names single items: "matrices.data" of "matrices[1].data"."""
    return re.sub(r"\[[^]]*\]", "", path)


def _item(items: Any, key: str) -> Any:
    """The item of this index, else the one of this name, else of this frame."""
    if not hasattr(items, "__len__") or isinstance(items, str):
        raise Error(f"[{key}]: is behind a field that is no list; leave it out")
    if re.fullmatch(r"\d+", key) and int(key) < len(items):
        return items[int(key)]
    called: list[str] = []
    for name in _NAMES:
        names = [str(functools.reduce(lambda of, part: getattr(of, part, ""), name.split("."), item))
                 for item in items]  # fmt: skip
        if names.count(key) == 1:
            return items[names.index(key)]
        if key in names:
            raise Error(f"[{key}]: {names.count(key)} items are called so; give the index, from 0, of one")
        called += [name for name in names if name]
    raise Error(
        f"[{key}]: none of the {len(items)} items has this index, counted from 0, name or frame; they are called "
        f"{', '.join(dict.fromkeys(called)) or 'nothing'}"
    )


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
    return _at(field if not match[2] else _item(field, match[2]), path[match.end():])


def _flat(values: Any) -> list[float]:
    """The numbers of a list, or of lists in it, or of a message: of its fields, or of the pose among them."""
    if isinstance(values, (int, float)):
        return [float(values)]
    if hasattr(values, "tolist"):
        return _flat(values.tolist())
    if hasattr(values, "__msgtype__"):
        fields = vars(values)
        inner = fields.get("pose", fields.get("transform"))
        values = [inner] if inner is not None else [fields[name] for name in fields if name != "__msgtype__"]
    if isinstance(values, str):
        raise TypeError("no number")
    return [number for value in values for number in _flat(value)]


def _spread(flags: Any, values: Any) -> list[float]:
    """The flags of each of the values, of which one beside several is that of each."""
    if not hasattr(flags, "__len__"):
        return _flat(flags) * len(_flat(values))
    if not isinstance(values, list) or len(flags) != len(values):
        return _flat(flags)
    return [number for pair in zip(flags, values) for number in _spread(*pair)]


class _Messages:
    """Rows of numbers of one topic, at the times of the messages' headers, or of their reception."""

    def __init__(self, log: str, topic: str, path: str, has_header: bool) -> None:
        self.where = f"{log}: {topic}"
        self.topics = {topic}
        self.path = path  #: of the numbers in a message
        self.has_header = has_header
        self.received = 0  #: messages without a time of their own
        self.width = 0  #: numbers in a message
        self.rows = Rows()

    def add(self, topic: str, message: Any, received_s: float) -> None:
        try:
            row = self._row_of(message)
            self.width = self.width or len(row)
            if not self.width:
                raise Error("holds no number; give another field")
            if len(row) != self.width:
                raise Error(
                    f"{len(row)} numbers in message {len(self.rows)}, counted from 0, but {self.width} before; "
                    "give a topic or a field of one length"
                )
            stamped_s = stamp_s(message.header.stamp) if self.has_header else 0.0
        except Error as error:
            raise Error(f"{self.where}: {self.path or 'the message'}: {error}") from None
        except (AttributeError, TypeError):
            where = f"{self.where}: message {len(self.rows)}, counted from 0"
            raise Error(f"{where}, has no list of numbers {self.path}; give another field") from None
        self.received += stamped_s <= 0.0
        self.rows.add(stamped_s, received_s, row)

    def _row_of(self, message: Any) -> "Sequence[float] | Numbers":
        raise NotImplementedError

    def in_order(self) -> tuple[Numbers, Numbers]:
        """Times [n], ascending, and their rows. Raises Error where there are none."""
        if not len(self.rows):
            raise Error(f"{self.where}: holds no message; record it, or give another topic")
        return self.rows.in_order(self.where)

    def remarks(self) -> list[str]:
        if not self.received:
            return []
        return [
            f"{self.where}: {self.received} of {len(self.rows)} messages have no time of their own; the "
            "times of their reception are taken"
        ]


class Pressures(_Messages):
    """The readings [e] of a topic, frame by frame."""

    def __init__(self, log: str, topic: str, path: str, has_header: bool, flags: str | None) -> None:
        super().__init__(log, topic, path, has_header)
        self.flags = flags  #: where the flags of valid readings lie
        self.invalid = 0  #: readings
        self.unlike = 0  #: messages whose flags are not as many as the readings
        self.far = 0  #: frames of the first pad that none of this one is near

    def _row_of(self, message: Any) -> Numbers:
        values = _at(message, self.path)
        row = values if hasattr(values, "dtype") and values.ndim == 1 else _flat(values)
        readings = numpy.array(row, numpy.float64)
        flags = [] if self.flags is None else _spread(_at(message, self.flags), values)
        if len(flags) == len(readings):
            readings[numpy.array(flags) == 0.0] = numpy.nan
            self.invalid += flags.count(0.0)
        elif self.flags is not None:
            self.unlike += 1
        return readings

    def remarks(self) -> list[str]:
        said = (
            (self.invalid, f"readings are unknown by their flags {self.flags}"),
            (self.unlike, f"messages have not as many flags {self.flags} as readings, which are all taken"),
            (self.far, "frames of the first pad have none of this one within 0.1 s; its readings are unknown there"),
        )
        return super().remarks() + [f"{self.where}: {count} {words}" for count, words in said if count]


class Poses(_Messages):
    """The poses of a topic, as numbers of which the request of an import says what they are."""

    def __init__(
        self, log: str, topic: str, path: str, has_header: bool, request: _palpate.ImportOptions
    ) -> None:
        super().__init__(log, topic, path, has_header)
        self.parts = parts_of(path)
        self.request = request

    def add(self, topic: str, message: Any, received_s: float) -> None:
        super().add(topic, message, received_s)
        if len(self.rows) == 1:
            _palpate.require_sound(self.request, self.width)

    def _row_of(self, message: Any) -> Sequence[float]:
        return [number for path in self.parts for number in _flat(_at(message, path))]


def together(pads: Sequence[Pressures]) -> tuple[Numbers, Numbers]:
    """The frames of several pads as those of one array: at the times of the first, with the nearest frame of
    each other, whose readings are unknown where that is over 0.1 s away. Raises Error where it always is."""
    time_s, rows = pads[0].in_order()
    if len(pads) == 1:
        return time_s, rows
    beside = [rows]
    for pad in pads[1:]:
        other_s, other = pad.in_order()
        after = numpy.searchsorted(other_s, time_s).clip(max=len(other_s) - 1)
        before = (after - 1).clip(min=0)
        nearest = numpy.where(time_s - other_s[before] < other_s[after] - time_s, before, after)
        far = numpy.abs(other_s[nearest] - time_s) > 0.1
        pad.far = int(far.sum())
        if far.all():
            raise Error(f"{pad.where}: no frame is within 0.1 s of one of {pads[0].where}; check the clocks")
        beside.append(numpy.where(far[:, None], numpy.nan, other[nearest]))
    return time_s, numpy.hstack(beside)
