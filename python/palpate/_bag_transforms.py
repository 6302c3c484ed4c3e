"""Poses in space over time, and the tree of frames that /tf and /tf_static give."""

import bisect
import itertools
import math
from array import array as numbers
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ._error import Error

Row = tuple[float, float, float, float, float, float, float]  #: mm, and a quaternion x, y, z, w
UNKNOWN: Row = (math.nan,) * 7
_IDENTITY: Row = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
_USUAL_GAP_S = 0.1


def row_of(pose: Any) -> Row:
    """A Pose or a Transform, m, as a row of mm and a quaternion; NaN where it is no rotation."""
    p = pose.position if hasattr(pose, "position") else pose.translation
    q = pose.orientation if hasattr(pose, "orientation") else pose.rotation
    length = math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
    if not length > 0.0:
        return UNKNOWN
    x, y, z, w = q.x / length, q.y / length, q.z / length, q.w / length
    return (1e3 * p.x, 1e3 * p.y, 1e3 * p.z, x, y, z, w)


def stamp_s(stamp: Any) -> float:
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


@dataclass
class _Edge:
    """T_parent_child over time; of a static one there is a single row."""

    parent: str
    static: bool
    time_s: "numbers[float]" = field(default_factory=lambda: numbers("d"))
    rows: "numbers[float]" = field(default_factory=lambda: numbers("d"))  #: one behind the other

    def row(self, index: int) -> Row:
        return tuple(self.rows[7 * index : 7 * index + 7])  # type: ignore[return-value]

    def sort(self) -> None:
        if self.static or all(a <= b for a, b in itertools.pairwise(self.time_s)):
            return
        order = sorted(range(len(self.time_s)), key=self.time_s.__getitem__)
        rows = numbers("d")
        for i in order:
            rows.extend(self.row(i))
        self.time_s = numbers("d", (self.time_s[i] for i in order))
        self.rows = rows

    def gap_s(self) -> float:
        """The longest step that a regular log takes when its steps jitter or a message is lost."""
        steps = sorted(b - a for a, b in itertools.pairwise(self.time_s))
        return max(_USUAL_GAP_S, 2.5 * steps[len(steps) // 2]) if steps else _USUAL_GAP_S

    def at(self, time_s: float, gap_s: float) -> Row | None:
        """Interpolated; None outside the log or between rows further apart than the gap."""
        if self.static:
            return self.row(0)
        after = bisect.bisect_left(self.time_s, time_s)
        if after < len(self.time_s) and self.time_s[after] == time_s:
            return self.row(after)
        if after in (0, len(self.time_s)) or self.time_s[after] - self.time_s[after - 1] > gap_s:
            return None
        before_s, after_s = self.time_s[after - 1], self.time_s[after]
        return _between(self.row(after - 1), self.row(after), (time_s - before_s) / (after_s - before_s))


def _between(a: Row, b: Row, part: float) -> Row:
    """The position on the line and the rotation on the shorter arc from a to b."""
    p = [x + part * (y - x) for x, y in zip(a[:3], b[:3], strict=True)]
    cosine = sum(x * y for x, y in zip(a[3:], b[3:], strict=True))
    sign = -1.0 if cosine < 0.0 else 1.0
    angle = math.acos(min(1.0, abs(cosine)))
    if angle < 1e-6:
        u, v = 1.0 - part, part
    else:
        u, v = (math.sin(x * angle) / math.sin(angle) for x in (1.0 - part, part))
    q = [u * x + sign * v * y for x, y in zip(a[3:], b[3:], strict=True)]
    length = math.sqrt(sum(x * x for x in q))
    return (p[0], p[1], p[2], q[0] / length, q[1] / length, q[2] / length, q[3] / length)


def _turned(row: Row, x: float, y: float, z: float) -> tuple[float, float, float]:
    """The vector turned by the row's rotation."""
    qx, qy, qz, qw = row[3:]
    tx, ty, tz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        x + qw * tx + qy * tz - qz * ty,
        y + qw * ty + qz * tx - qx * tz,
        z + qw * tz + qx * ty - qy * tx,
    )


def _product(a: Row, b: Row) -> Row:
    """T_a_c from T_a_b and T_b_c."""
    x, y, z = _turned(a, *b[:3])
    ax, ay, az, aw = a[3:]
    bx, by, bz, bw = b[3:]
    return (
        a[0] + x,
        a[1] + y,
        a[2] + z,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _inverse(a: Row) -> Row:
    back: Row = (0.0, 0.0, 0.0, -a[3], -a[4], -a[5], a[6])
    x, y, z = _turned(back, *a[:3])
    return (-x, -y, -z, *back[3:])


class Transforms:
    """The frames of /tf and /tf_static, by their names without a leading slash."""

    def __init__(self, topics: set[str], static: set[str]) -> None:
        self.topics = topics
        self.static = static
        self.edges: dict[str, _Edge] = {}  #: by child

    def add(self, topic: str, message: Any, received_s: float) -> None:
        for transform in message.transforms:
            child = transform.child_frame_id.lstrip("/")
            parent = transform.header.frame_id.lstrip("/")
            edge = self.edges.get(child)
            if edge is None or edge.parent != parent:
                edge = self.edges[child] = _Edge(parent, topic in self.static)
            row = row_of(transform.transform)
            if edge.static:
                edge.rows = numbers("d", row)
            elif not math.isnan(row[3]):
                edge.time_s.append(stamp_s(transform.header.stamp) or received_s)
                edge.rows.extend(row)

    def path(self, log: str, target: str, source: str) -> tuple[list[_Edge], list[_Edge]]:
        """The edges from the source up to the common ancestor, and from the target up to it."""
        ups = []
        for frame in (source.lstrip("/"), target.lstrip("/")):
            up = [frame]
            while up[-1] in self.edges and len(up) <= len(self.edges):
                up.append(self.edges[up[-1]].parent)
            ups.append(up)
        common = next((frame for frame in ups[0] if frame in ups[1]), None)
        if common is None:
            known = sorted({*self.edges, *(edge.parent for edge in self.edges.values())})
            raise Error(
                f"{log}: tf {target}:{source}: no chain of transforms joins these frames; the log has "
                f"{', '.join(known) or 'none'}"
            )
        source_up, target_up = (
            [self.edges[frame] for frame in up[: up.index(common)]] for up in ups
        )
        return source_up, target_up

    def chain(
        self, log: str, target: str, source: str, time_s: Sequence[float], gap_s: float | None
    ) -> "numbers[float]":
        """Rows T_target_source, one behind the other, at each time; NaN where it is not known."""
        source_up, target_up = self.path(log, target, source)
        gaps: dict[int, float] = {}
        for edge in (*source_up, *target_up):
            edge.sort()
            gaps[id(edge)] = edge.gap_s() if gap_s is None else gap_s

        def up_to_common(edges: list[_Edge], at_s: float) -> Row | None:
            product = _IDENTITY
            for edge in edges:
                row = edge.at(at_s, gaps[id(edge)])
                if row is None:
                    return None
                product = _product(row, product)
            return product

        rows = numbers("d")
        for at_s in time_s:
            a, b = up_to_common(target_up, at_s), up_to_common(source_up, at_s)
            rows.extend(UNKNOWN if a is None or b is None else _product(_inverse(a), b))
        if all(map(math.isnan, rows[::7])):
            raise Error(
                f"{log}: tf {target}:{source}: is not known at any frame's time; check the clocks"
            )
        return rows

    def still(self, log: str, target: str, source: str, time_s: Sequence[float]) -> Row:
        """T_target_source of a frame that does not move: at the middle of the times when it is known."""
        times = sorted(set(time_s))
        rows = self.chain(log, target, source, times, None)
        known = [i for i in range(len(times)) if not math.isnan(rows[7 * i])]
        middle = 7 * known[len(known) // 2]
        return tuple(rows[middle : middle + 7])  # type: ignore[return-value]

    def remarks(self, log: str, chain: tuple[str, str], rows: Sequence[float]) -> list[str]:
        """What is worth saying of rows that chain() gave."""
        unknown = sum(map(math.isnan, rows[::7]))
        if not unknown:
            return []
        return [
            f"{log}: tf {':'.join(chain)}: {unknown} of {len(rows) // 7} frames have no pose, as a "
            "transform is missing, or the ones around them are too far apart (largest_gap_s)"
        ]
