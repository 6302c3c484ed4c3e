"""Poses in space over time, and the tree of frames that /tf and /tf_static give."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy
from numpy.typing import NDArray

from ._error import Error

Numbers = NDArray[numpy.float64]  #: poses are [n, 7] mm, and a quaternion x, y, z, w; NaN where unknown
_USUAL_GAP_S = 0.1
_STILL = 1.0  #: mm, and degrees, by which an object that lies still may seem to move
_JITTER_S = 1.0  #: by which messages may come out of order
_BLOCK = 1 << 14  #: rows of a chain at a time


def _row_of(transform: Any) -> tuple[float, ...]:
    """A Transform, m, as a row; empty where it is no rotation, as tf leaves such transforms out, too."""
    p, q = transform.translation, transform.rotation
    length = math.hypot(q.x, q.y, q.z, q.w)
    if not abs(length - 1.0) <= 0.01:
        return ()
    return (1e3 * p.x, 1e3 * p.y, 1e3 * p.z, q.x / length, q.y / length, q.z / length, q.w / length)


def stamp_s(stamp: Any) -> float:
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


class Rows:
    """Rows of numbers at times, as they come, with eight bytes for each number of a long log."""

    def __init__(self) -> None:
        self.time_s = array("d")
        self.latest_s = -math.inf  #: of the stamps
        self.back = ""  #: where they first step back
        self.numbers = array("d")  #: row by row

    def __len__(self) -> int:
        return len(self.time_s)

    def add(self, stamp_s: float, received_s: float, row: "Sequence[float] | Numbers") -> None:
        """A row at its stamp, or at its reception where it has none."""
        if 0.0 < stamp_s < self.latest_s - _JITTER_S and not self.back:
            self.back = f"from {self.latest_s:.3f} to {stamp_s:.3f} s"
        self.latest_s = max(self.latest_s, stamp_s)
        self.time_s.append(stamp_s if stamp_s > 0.0 else received_s)
        self.numbers.frombytes(numpy.asarray(row, numpy.float64).tobytes())

    def in_order(self, where: str) -> tuple[Numbers, Numbers]:
        """Times [n], ascending, and their rows. Raises Error where the clock was set back."""
        if self.back:
            raise Error(f"{where}: the clock steps back {self.back}; split the log there, and read each part")
        time_s: Numbers = numpy.frombuffer(self.time_s)
        width = len(self.numbers) // max(1, len(self))
        rows: Numbers = numpy.frombuffer(self.numbers).reshape(len(self), width)
        if numpy.any(time_s[1:] < time_s[:-1]):
            order = numpy.argsort(time_s, kind="stable")
            time_s, rows = time_s[order], rows[order]
        return time_s, rows


@dataclass
class _Edge:
    """T_parent_child over time; a static one has a single row."""

    parent: str
    static: bool
    moves: bool = False  #: although /tf_static has it, too
    moved: bool = False  #: from another parent, whose rows are forgotten
    rows: Rows = field(default_factory=Rows)


def _gap_s(time_s: Numbers) -> float:
    """The longest step that a regular log takes when its steps jitter or a message is lost."""
    steps = numpy.sort(numpy.diff(time_s))
    return max(_USUAL_GAP_S, 2.5 * float(steps[len(steps) // 2])) if len(steps) else _USUAL_GAP_S


def _interpolated(log: tuple[Numbers, Numbers], at_s: Numbers, gap_s: float) -> Numbers:
    """Numbers at times; NaN outside the log or between rows further apart than the gap.

    The position is on the line and the rotation on the shorter arc between two rows.
    """
    time_s, rows = log
    after = numpy.searchsorted(time_s, at_s).clip(max=len(time_s) - 1)
    before = numpy.where(time_s[after] == at_s, after, (after - 1).clip(min=0))
    step_s = time_s[after] - time_s[before]
    known = (time_s[before] <= at_s) & (at_s <= time_s[after]) & (step_s <= gap_s)
    part = (at_s - time_s[before]) / numpy.where(step_s > 0.0, step_s, 1.0)
    a, b = rows[before], rows[after]
    cosine = numpy.sum(a[:, 3:] * b[:, 3:], axis=1)
    angle = numpy.arccos(numpy.minimum(1.0, numpy.abs(cosine)))
    small = angle < 1e-6
    sine = numpy.where(small, 1.0, numpy.sin(angle))
    u = numpy.where(small, 1.0 - part, numpy.sin((1.0 - part) * angle) / sine)
    v = numpy.where(small, part, numpy.sin(part * angle) / sine)
    v = numpy.where(cosine < 0.0, -v, v)
    q = u[:, None] * a[:, 3:] + v[:, None] * b[:, 3:]
    q /= numpy.linalg.norm(q, axis=1, keepdims=True)
    p = a[:, :3] + part[:, None] * (b[:, :3] - a[:, :3])
    return numpy.where(known[:, None], numpy.hstack([p, q]), math.nan)


def _turned(rotation: Numbers, vector: Numbers) -> Numbers:
    """Vectors [n, 3] turned by rotations [n, 4]."""
    q, w = rotation[:, :3], rotation[:, 3:]
    t = 2.0 * numpy.cross(q, vector)
    return vector + w * t + numpy.cross(q, t)


def _product(a: Numbers, b: Numbers) -> Numbers:
    """T_a_c from T_a_b and T_b_c."""
    p, q, w = a[:, :3], a[:, 3:6], a[:, 6:]
    r, z = b[:, 3:6], b[:, 6:]
    position = p + _turned(a[:, 3:], b[:, :3])
    scalar = w * z - numpy.sum(q * r, axis=1, keepdims=True)
    return numpy.hstack([position, w * r + z * q + numpy.cross(q, r), scalar])


def _inverse(a: Numbers) -> Numbers:
    back = a[:, 3:] * (-1.0, -1.0, -1.0, 1.0)
    return numpy.hstack([-_turned(back, a[:, :3]), back])


class Transforms:
    """The frames of /tf and /tf_static, by their names without a leading slash.

    A frame that both have is one that moves: its transforms of /tf count alone. Once the wanted chains are
    complete, other frames' transforms are not kept.
    """

    def __init__(
        self, log: str, topics: set[str], static: set[str], wanted: Sequence[tuple[str, str]]
    ) -> None:
        self.log = log
        self.topics = topics
        self.static = static
        self.wanted = [(target.lstrip("/"), source.lstrip("/")) for target, source in wanted]
        self.edges: dict[str, _Edge] = {}  #: by child
        self.kept: set[str] | None = None  #: children of the wanted chains; None: not all are known
        self.said: list[str] = []  #: of chains, what is worth a warning

    def add(self, topic: str, message: Any, received_s: float) -> None:
        for transform in message.transforms:
            child = transform.child_frame_id.lstrip("/")
            parent = transform.header.frame_id.lstrip("/")
            edge = self.edges.get(child)
            static = topic in self.static
            if edge is not None and edge.static != static:
                if static:
                    edge.moves = True
                    continue
                edge = self.edges[child] = _Edge(edge.parent, False, moves=True)
            if edge is None or edge.parent != parent:
                edge = self.edges[child] = _Edge(parent, static, edge is not None and edge.moves, edge is not None)
                self._keep_chains()
            if edge.static:
                edge.rows = Rows()
            wanted = edge.static or self.kept is None or child in self.kept
            if wanted and (row := _row_of(transform.transform)):
                edge.rows.add(stamp_s(transform.header.stamp), received_s, row)

    def _keep_chains(self) -> None:
        """Forgets what the wanted chains do not need, now that a frame has a parent."""
        chains = [self._path(*chain) for chain in self.wanted]
        if any(chain is None for chain in chains):
            self.kept = None
            return
        self.kept = {child for chain in chains if chain for up in chain for child in up}
        for child in self.edges.keys() - self.kept:
            if not self.edges[child].static:
                self.edges[child].rows = Rows()

    def _path(self, target: str, source: str) -> tuple[list[str], list[str]] | None:
        """Frames from the source up to below the common ancestor, and from the target."""
        ups = []
        for frame in (source, target):
            up = [frame]
            while up[-1] in self.edges and len(up) <= len(self.edges):
                up.append(self.edges[up[-1]].parent)
            ups.append(up)
        common = next((frame for frame in ups[0] if frame in ups[1]), None)
        if common is None:
            return None
        return ups[0][: ups[0].index(common)], ups[1][: ups[1].index(common)]

    def _chain(self, target: str, source: str, time_s: Numbers, gap_s: float | None) -> Numbers:
        """T_target_source at each time, [n, 7]; NaN where it is not known."""
        where = f"{self.log}: tf {target}:{source}"
        path = self._path(target.lstrip("/"), source.lstrip("/"))
        if path is None:
            known = sorted({*self.edges, *(edge.parent for edge in self.edges.values())})
            raise Error(
                f"{where}: no chain of transforms joins these frames; on {', '.join(sorted(self.topics))} "
                f"are {', '.join(known) or 'none'}; where the array's mount is not among them, name the frame that "
                "carries it and give the mount"
            )
        logs = {child: self.edges[child].rows.in_order(f"{where}: {child}") for up in path for child in up}
        if empty := [child for child, (at_s, _) in logs.items() if not len(at_s)]:
            raise Error(f"{where}: {empty[0]} has no transform whose quaternion is of length 1; publish one")
        gaps = {child: _gap_s(at_s) if gap_s is None else gap_s for child, (at_s, _) in logs.items()}

        def up_to_common(up: list[str], at_s: Numbers) -> Numbers:
            product = numpy.tile((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0), (len(at_s), 1))
            for child in up:
                if self.edges[child].static:
                    rows = numpy.broadcast_to(logs[child][1], (len(at_s), 7))
                else:
                    rows = _interpolated(logs[child], at_s, gaps[child])
                product = _product(rows, product)
            return product

        rows = numpy.empty((len(time_s), 7))
        for begin in range(0, len(time_s), _BLOCK):
            at_s = time_s[begin : begin + _BLOCK]
            source_up, target_up = (up_to_common(up, at_s) for up in path)
            rows[begin : begin + _BLOCK] = _product(_inverse(target_up), source_up)
        if numpy.isnan(rows[:, 0]).all():
            spans = [
                f"{child}{' (whose parent changes)' * self.edges[child].moved} is from {t[0]:.3f} to {t[-1]:.3f} s"
                for child, (t, _) in logs.items() if not self.edges[child].static
            ]  # fmt: skip
            raise Error(
                f"{where}: is not known at any frame's time, {time_s[0]:.3f} to {time_s[-1]:.3f} s; "
                f"{', '.join(spans)}; check the clocks, or give a larger largest_gap_s"
            )
        return rows

    def poses(self, target: str, source: str, time_s: Numbers, gap_s: float | None) -> Numbers:
        """T_target_source of the sensor at each frame's time, [n, 7]; NaN where it is not known."""
        rows = self._chain(target, source, time_s, gap_s)
        if unknown := int(numpy.isnan(rows[:, 0]).sum()):
            self.said.append(
                f"{self.log}: tf {target}:{source}: {unknown} of {len(rows)} frames have no pose, as a "
                "transform is missing, or the ones around them are too far apart (largest_gap_s)"
            )
        return rows

    def still(self, target: str, source: str, time_s: Numbers) -> Numbers | None:
        """T_target_source [7] of a frame that lies still while the frames come; None of one that moves."""
        rows = self._chain(target, source, numpy.unique(time_s), None)
        rows = rows[~numpy.isnan(rows[:, 0])]
        middle: Numbers = rows[len(rows) // 2]
        distance_mm = numpy.linalg.norm(rows[:, :3] - middle[:3], axis=1)
        cosine = numpy.abs(rows[:, 3:] @ middle[3:])
        angle_deg = numpy.degrees(2.0 * numpy.arccos(numpy.minimum(1.0, cosine)))
        # A tracker's outliers are no motion.
        if max(numpy.quantile(distance_mm, 0.95), numpy.quantile(angle_deg, 0.95)) <= _STILL:
            return middle
        self.said.append(
            f"{self.log}: truth_tf {target}:{source}: the frame moves by {distance_mm.max():.1f} mm and "
            f"{angle_deg.max():.1f}°, so that the recording has no truth; give a log in which the object "
            "lies still"
        )
        return None

    def remarks(self) -> list[str]:
        """What is worth a warning of the chains that were asked for, and of their frames."""
        return self.said + [
            f"{self.log}: the frame {child} is in /tf_static, but moves in /tf: its transforms of /tf are taken"
            for child in sorted(self.kept or ())
            if self.edges[child].moves
        ]
