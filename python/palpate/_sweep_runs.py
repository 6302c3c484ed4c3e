"""What palpate.sweep measures of one lattice."""

import json
import math
import os
from dataclasses import dataclass, field
from statistics import median_low
from typing import Any

from . import _palpate
from ._error import Error
from ._palpate import Device, Hypothesis, PoseLattice, pose_error_mm
from ._statistics import Errors, errors_over
from .recognition import request_of
from .results import Record

_FEWEST_BINS = 1e3  # of the coarsest lattice; of a small region, a thirtieth of the finest one's
_MOST_HISTOGRAM = 100_000_000  # bins of all objects

Document = dict[str, Any]


@dataclass
class Data:
    """A user's own maps and recordings."""

    paths: list[str]
    map_paths: list[str]
    device: Device
    options: dict[str, Any]
    maps: dict[tuple[str, bool], Hypothesis] = field(default_factory=dict)
    auto_pivot: bool = False
    entries: list[tuple[str, int]] = field(default_factory=list)

    def open(self, **options: Any) -> "_palpate.OpenBatch":
        """The batch of all recordings, as `palpate batch` settles it."""
        # What bins are worth shows among learned objects; wide ones would take them for strangers.
        request = request_of({"none": 0} | self.options | options)
        threads = len(os.sched_getaffinity(0))
        head, self.entries, _ = _palpate.settle_batch(
            self.paths, self.map_paths, request, self.device, threads
        )
        return _palpate.OpenBatch.open(head, self.device, threads)

    def on(self, lattice: PoseLattice, filter: str) -> "_palpate.OpenBatch":
        """The batch of all recordings on given bins."""
        x, y, theta = lattice.x_mm, lattice.y_mm, lattice.theta_rad
        return self.open(
            bins=lattice.shape[::-1],
            x_mm=(x.lower, x.upper),
            y_mm=(y.lower, y.upper),
            theta_deg=(math.degrees(theta.lower), math.degrees(theta.upper)),
            pivot_mm="auto" if self.auto_pivot else tuple(lattice.pivot_mm.tolist()),
            filter=filter,
        )

    def recognize(self, batch: "_palpate.OpenBatch", unknowns: int) -> tuple[list[Record], float]:
        """The first unknowns' records, and the median of their seconds.

        The first recording is recognised once more before, which does not count: it warms up.
        """
        lines: list[tuple[str, str, float]] = []
        batch.recognize([self.entries[0][0]])
        for entry, _ in self.entries:
            if len(lines) < unknowns:
                lines += batch.recognize([entry])[0]
        records = [Record(json.loads(line)) for line, _, _ in lines[:unknowns]]
        for record in records:
            if "error" in record:
                raise Error(record["error"])
        return records, median_low([seconds for _, _, seconds in lines[:unknowns]])


def lattices_of(fine: PoseLattice, most_bins: int) -> list[PoseLattice]:
    """Lattices of the region in the proportions of `fine`, by rising count.

    Up to three times as many bins; each has about three times as many as the one before.
    """
    count = min(3.0 * fine.bins, float(most_bins))
    fewest = 0.9 * min(_FEWEST_BINS, count / 30.0)  # counts of bins are near to what is asked for
    free = max(1, sum(n > 1 for n in fine.shape))
    lattices: list[PoseLattice] = []
    while count >= fewest:
        factor = (count / fine.bins) ** (1.0 / free)
        x, y, theta = (
            (axis.lower, axis.upper, max(1, math.floor(factor * axis.count + 0.5)))
            for axis in (fine.x_mm, fine.y_mm, fine.theta_rad)
        )
        lattice = PoseLattice(x, y, theta, fine.pivot_mm)
        if not lattices or lattice.bins < lattices[-1].bins:
            lattices.append(lattice)
        count /= math.sqrt(10.0)
    return lattices[::-1]


@dataclass
class Run:
    """What one lattice is worth and what it costs."""

    lattice: PoseLattice
    records: list[Record]  #: [unknown] after all touches
    point: Document  #: for the table, the charts and the document
    #: By "mode" and "refined": distances from the finest run by the pose error, None where that has
    #: another object.
    from_finest_mm: dict[str, Errors] = field(default_factory=dict)

    def compare_with(self, finest: "Run", data: Data) -> None:
        """Says how far the poses lie from those of the finest run."""
        pairs = list(zip(self.records, finest.records, strict=True))

        def distance_mm(kind: str, *records: Record) -> float | None:
            here, there = ((of["mode"]["map"], of["mode"].get("mirrored", False)) for of in records)
            if here != there or any(kind not in of for of in records):
                return None
            poses = ([of[kind][name] for name in ("x_mm", "y_mm", "theta_rad")] for of in records)
            return float(pose_error_mm(data.maps[here].map, *poses))

        for kind, name in (("mode", "from_finest_mm"), ("refined", "refined_from_finest_mm")):
            self.from_finest_mm[kind] = [distance_mm(kind, *pair) for pair in pairs]
            self.point[name] = errors_over(self.from_finest_mm[kind], 20)
        same = sum(record["best"] == other["best"] for record, other in pairs)
        self.point["same_object"] = same / len(pairs)

    @property
    def recognised(self) -> float:
        """Share that is right or, where no label is known, as the finest run has it."""
        accuracy = self.point["accuracy"]
        return float(self.point["same_object"] if accuracy is None else accuracy)


def measure(data: Data, lattice: PoseLattice, dense: int) -> Run:
    """Recognises all unknowns by bounds, and some by the histogram.

    All by the histogram where the search by bounds would take too much memory, or objects slip.
    """
    unknowns = sum(count for _, count in data.entries)
    point: Document = dict.fromkeys(("seconds_histogram", "seconds_bounds", "device_bytes", "host_bytes"))
    records: list[Record] = []
    try:
        bounds = data.on(lattice, "bounded")
        by_bounds = bounds.on_host
    except Error:
        by_bounds = False
    # Half of the device's memory, as --bins auto has it.
    room = lattice.bins * len(data.maps) <= min(_MOST_HISTOGRAM, data.device.memory_bytes // 16)
    dense = (min(dense, unknowns) if room else 0) if by_bounds else unknowns
    if dense:
        histogram = data.on(lattice, "histogram")
        records, point["seconds_histogram"] = data.recognize(histogram, dense)
        point["device_bytes"] = histogram.memory_bytes
        del histogram
    if by_bounds:
        records, point["seconds_bounds"] = data.recognize(bounds, unknowns)
        point["host_bytes"] = bounds.memory_bytes
    known = [record["right"] for record in records if record.get("right") is not None]
    sd = [record["refined"]["sd"] for record in records if "refined" in record]
    point |= {
        "count": lattice.bins,
        "bins": list(lattice.shape[::-1]),
        "step_mm": max(lattice.x_mm.step, lattice.y_mm.step),
        "recordings": unknowns,
        "histogram_recordings": dense,
        "accuracy": sum(known) / len(known) if known else None,
        "sd_mm": median_low([math.hypot(x, y) for x, y, _ in sd]) if sd else None,
        "sd_deg": median_low([math.degrees(theta) for _, _, theta in sd]) if sd else None,
    }
    for name in ("error", "refined_error"):
        errors = [record.get(f"{name}_mm") for record in records]
        point |= {f"{name}_mm": errors_over(errors, 20), f"{name}s_mm": errors}
    return Run(lattice, records, point)
