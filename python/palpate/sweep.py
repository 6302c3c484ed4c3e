"""How many bins do your objects need? `python -m palpate.sweep` answers by your own recordings.

It recognises them with more and more bins on your device, and says beyond which number nothing
improves, and what bins cost. docs/bins.md explains its tables.
"""

import argparse
import math
import os
import time
from collections.abc import Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy

from . import __version__
from ._error import Error
from ._palpate import Device, PoseLattice
from ._program import begin, main, write
from ._statistics import LEAST_GAIN, present
from ._sweep_runs import Data, Document, Run, lattices_of, measure
from ._tables import Column, Table, count_text, mean_text, number, plain, seconds_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The files of --plots, without their endings.
CHARTS = ("sweep_own_bins", "sweep_own_time")
_LEAST_TRUE_POSES = 3  # by which errors are judged


def sweep(
    recordings: Iterable[str | os.PathLike[str]],
    maps: Iterable[str | os.PathLike[str]] = (),
    *,
    max_bins: int | None = None,
    quick: bool = False,
    device: Device | None = None,
    **options: Any,
) -> Document:
    """Recognises recordings over rising numbers of bins, and prints the table as it comes.

    recordings: unknowns, folders of them, or manifests, as `palpate batch` takes them; maps: files or
    folders; options: scene, sensor_model, x_mm, y_mm, theta_deg, pivot_mm, threshold and ratio of
    recognize(); max_bins: per object, 10,000,000 by default; quick: at most 100,000, with one unknown
    for the histogram's time in the place of three.

    Returns what docs/bins.md explains: `points`, one for every lattice, `auto_count` and `fine_count`,
    the bins that --bins auto and fine take, `mode_count` and `refined_count`, from which on nothing
    improves (None where only the finest would do), and `advice`. Raises Error in the words of the
    command.
    """
    paths, map_paths = ([os.fspath(path) for path in given] for given in (recordings, maps))
    data = Data(paths, map_paths, device or Device.open(), options)
    automatic = data.open(bins="auto", filter="auto").lattice
    batch = data.open(bins="fine", filter="auto")
    fine = batch.lattice
    data.maps = {(name, given.mirrored): given for name, given in batch.maps}
    data.auto_pivot = batch.auto_pivot
    del batch  # gives its memory back
    lattices = lattices_of(fine, max_bins or (100_000 if quick else 10_000_000))
    dense = 1 if quick else 3
    finest = measure(data, lattices[-1], dense)
    true_poses = sum(record.get("truth", {}).get("T_robot_object") is not None for record in finest.records)
    table, runs = Table(_columns(true_poses > 0)), []
    for lattice in lattices:
        runs.append(finest if lattice is lattices[-1] else measure(data, lattice, dense))
        runs[-1].compare_with(finest, data)
        table.append(runs[-1].point)
    mode, refined = (_first_that_suffices(runs, kind) for kind in ("mode", "refined"))
    return {
        "maps": len(data.maps),
        "recordings": len(finest.records),
        "true_poses": true_poses,
        "points": table,
        "auto_count": automatic.bins,
        "fine_count": fine.bins,
        "mode_count": mode and mode.point["count"],
        "refined_count": refined and refined.point["count"],
        "advice": _advice(mode, refined, finest, data, automatic, fine),
    }


def _columns(truth_known: bool) -> list[Column]:
    """Errors where the truth is known, else distances from the finest run."""
    mib, mm = number(".1f", 1.0 / (1 << 20)), number(".3f")
    errors: list[Column] = [
        ("mode: from the finest, mm", "from_finest_mm/mean", mm),
        ("refined: from the finest, mm", "refined_from_finest_mm/mean", mm),
    ]
    if truth_known:
        errors = [
            ("mode: mean error, mm", "error_mm", mean_text),
            ("refined: mean error, mm", "refined_error_mm", mean_text),
        ]
    return [
        ("bins per object", "count", count_text),
        ("bins", "bins", plain),
        ("step, mm", "step_mm", number(".2f")),
        ("recognised, %", "accuracy", number(".0f", 100.0)),
        ("object of the finest, %", "same_object", number(".0f", 100.0)),
        *errors,
        ("sd of the place, mm", "sd_mm", mm),
        ("of theta, deg", "sd_deg", number(".2f")),
        ("per unknown, histogram", "seconds_histogram", seconds_text),
        ("by bounds", "seconds_bounds", seconds_text),
        ("device memory, MiB", "device_bytes", mib),
        ("bounds' memory, MiB", "host_bytes", mib),
    ]


def _rests(run: Run, finest: Run, kind: str) -> bool:
    """Whether a run's poses rest where those of the finest run are.

    An error e and a distance d make sqrt(e^2 + d^2) together; e is the finest run's error by the truth
    or, where too few true poses are known, its standard deviation.
    """
    errors_mm = finest.point["errors_mm" if kind == "mode" else "refined_errors_mm"]
    if len(present(finest.point["errors_mm"])) < _LEAST_TRUE_POSES:
        errors_mm = [
            math.hypot(*record["refined"]["sd"][:2]) if "refined" in record else None
            for record in finest.records
        ]
    pairs = numpy.array([run.from_finest_mm[kind], errors_mm], numpy.float64)
    distance, error = numpy.linalg.norm(pairs[:, ~numpy.isnan(pairs).any(axis=0)], axis=1)
    return bool(error > 0.0 and math.hypot(error, distance) <= (1.0 + LEAST_GAIN) * error)


def _first_that_suffices(runs: Sequence[Run], kind: str) -> Run | None:
    """The first run from which on none recognises more and all poses rest.

    None where only the finest run would do, which no finer run confirms.
    """
    first, most_recognised = None, runs[-1].recognised
    for run in reversed(runs[:-1]):
        if run.recognised < most_recognised or not _rests(run, runs[-1], kind):
            break
        first, most_recognised = run, max(most_recognised, run.recognised)
    return first


def _flags(lattice: PoseLattice, auto_pivot: bool) -> str:
    """The flags of `palpate recognize` that give the lattice."""
    x, y, theta = lattice.x_mm, lattice.y_mm, lattice.theta_rad
    ranges = {"x-mm": (x.lower, x.upper), "y-mm": (y.lower, y.upper)}
    if theta.upper - theta.lower < 2.0 * math.pi - 1e-9:
        ranges["theta-deg"] = (math.degrees(theta.lower), math.degrees(theta.upper))
    flags = [f"--bins {plain(lattice.shape[::-1])}"]
    flags += [f"--{name}={lower:.6g}:{upper:.6g}" for name, (lower, upper) in ranges.items()]
    if auto_pivot:
        flags.append("--pivot-mm auto")
    elif lattice.pivot_mm.any():
        flags.append("--pivot-mm={:.6g},{:.6g}".format(*lattice.pivot_mm))
    return " ".join(flags)


def _advice(
    mode: Run | None, refined: Run | None, finest: Run, data: Data, automatic: PoseLattice, fine: PoseLattice
) -> str:
    advised = refined or finest
    count, flags = count_text(advised.point["count"]), _flags(advised.lattice, data.auto_pivot)
    words = (
        f"Poses move up to the finest bins, {count} per object ({flags}): give a larger --max-bins, or a "
        "smaller region."
    )
    if refined:
        needs = f"needs {count_text(mode.point['count'])}" if mode else "gains up to the finest bins"
        words = (
            f"Beyond {count} bins per object ({flags}) neither recognition nor the refined pose improves; "
            f"the mode {needs}."
        )
    costs = [
        f"{seconds_text(advised.point[name])} by {by}"
        for name, by in (("seconds_histogram", "the histogram"), ("seconds_bounds", "bounds"))
        if advised.point[name] is not None
    ]
    auto_takes, fine_takes = (f"{plain(of.shape[::-1])} = {count_text(of.bins)}" for of in (automatic, fine))
    return (
        f"{words}\nAn unknown then costs {' and '.join(costs)}. --bins auto takes {auto_takes}, and "
        f"--bins fine {fine_takes}."
    )


def _charts_of(document: Document) -> "dict[str, Figure]":
    """The charts of a sweep: error and time against bins."""
    from . import _charts as charts

    points, truth_known = document["points"], document["true_poses"] > 0
    y = "mean pose error (mm)" if truth_known else "mean distance from the pose of the finest bins (mm)"
    errors, times = (
        charts.chart("bins per object", of, xscale="log", yscale="log") for of in (y, "time per unknown")
    )
    charts.ticks(times.yaxis, seconds_text, (1.0, 2.0, 5.0))
    field = "error_mm" if truth_known else "from_finest_mm"
    spread: Document = {"color": charts.GREY, "linestyle": ":", "marker": ""}
    for axes, path, label, look in (
        (errors, f"{field}/mean", "mode", charts.SOLID),
        (errors, f"refined_{field}/mean", "refined pose", charts.DASHED),
        (errors, "sd_mm", "standard deviation of x and y, median", spread),
        (times, "seconds_histogram", "histogram", charts.SOLID),
        (times, "seconds_bounds", "by bounds", charts.DASHED),
    ):
        charts.series(axes, points, "count", path, label, **look)
    for name, label, colour in (
        ("auto_count", "--bins auto", charts.GREY),
        ("fine_count", "--bins fine", charts.GREY),
        ("refined_count", "enough", "black"),
    ):
        at = document[name]
        if at is not None and points[0]["count"] <= at <= points[-1]["count"]:
            charts.rule(errors, at, label, vertical=True, colour=colour)
    for axes in (errors, times):
        charts.ticks(axes.xaxis, count_text)
    return dict(zip(CHARTS, map(charts.finished, (errors, times)), strict=True))


def _pair(flag: str, text: str) -> tuple[float, float] | str:
    """LOWER:UPPER, or X,Y or auto of a pivot. Raises Error."""
    pivot = flag == "--pivot-mm"
    if pivot and text == "auto":
        return text
    try:
        first, second = map(float, text.split("," if pivot else ":"))
    except ValueError:
        raise Error(f"{flag} {text}: give {'X,Y or auto' if pivot else 'LOWER:UPPER'}") from None
    return first, second


def _flag_parser() -> argparse.ArgumentParser:
    flags = argparse.ArgumentParser(
        "python -m palpate.sweep",
        description="Recognises your own recordings with more and more bins: how many bins your "
        "objects need, and what bins cost on this device.",
    )
    add = flags.add_argument
    add("--maps", nargs="+", default=[], metavar="MAP",
        help="maps of your objects, or folders of maps")  # fmt: skip
    add("--recordings", nargs="+", required=True, metavar="RECORDING",
        help="recordings of unknowns, folders of them, or manifests as of palpate batch; where they know "
        "the object or its pose, the sweep tells accuracy and errors")  # fmt: skip
    add("--scene", metavar="FILE", help="scene file (YAML), as of palpate recognize")
    add("--sensor-model", metavar="FILE", help="what palpate calibrate has learned")
    for flag, metavar, words in (
        ("--x-mm", "LOWER:UPPER", "range of x, as of palpate recognize [every place of an array that touches "
         "an object of the maps]"),
        ("--y-mm", "LOWER:UPPER", "range of y"),
        ("--theta-deg", "LOWER:UPPER", "range of theta, degrees [0:360]"),
        ("--pivot-mm", "X,Y|auto", "point about which theta turns"),
    ):  # fmt: skip
        add(flag, metavar=metavar, type=partial(_pair, flag), help=words)
    add("--threshold", type=float, help="contact threshold, in the recordings' unit")
    add("--ratio", type=float, help="threshold as a fraction of the largest pressure")
    add("--max-bins", type=int, metavar="N",
        help="most bins per object [10000000, or 100000 with --quick]")  # fmt: skip
    add("--quick", action="store_true", help="at most 100,000 bins per object")
    add("--device", default="", help="Vulkan device, by a part of its name or index")
    add("--json", metavar="FILE", help="write the results to this file")
    add("--plots", metavar="FOLDER", help="draw charts in this folder, as PNG and SVG")
    return flags


def _run() -> None:
    arguments = _flag_parser().parse_args()
    if arguments.max_bins is not None and arguments.max_bins < 1_000:
        raise Error(f"--max-bins = {arguments.max_bins}: give 1000 or more")
    options = vars(arguments).copy()
    for own in ("device", "json", "plots"):
        del options[own]
    if arguments.plots:
        try:
            from ._charts import save
        except ImportError as missing:
            raise Error("--plots: Matplotlib is missing; pip install 'palpate[plot]'") from missing
    device, facts = begin(arguments, palpate=__version__)
    start = time.perf_counter()
    document = facts | sweep(device=device, **options)
    document["seconds in all"] = round(time.perf_counter() - start, 1)
    print(f"\n{document['advice']}")
    if arguments.plots:
        save(_charts_of(document), arguments.plots)
    write(arguments.json, document)


if __name__ == "__main__":
    main(_run, "palpate.sweep")
