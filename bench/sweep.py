"""Speed against error on simulated letters: every filter, bin counts, map cells, and their limits."""

import argparse
import math
import time
from collections.abc import Sequence
from functools import partial

import numpy
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import palpate
from palpate import _charts as charts
from palpate._tables import Column, Table, count_text, mean_text, number, plain, seconds_text

from .measures import differences, knee_of
from .program import Json, begin, main, parser, write
from .sweep_runs import first_each, measure_bounds, measure_histogram, measure_limits, measure_particles
from .trials import TABLE_1, VOWELS, Bins, Floats, lattice_of, letter_maps, make_trials, training_recordings

EDGED: Json = {"markeredgecolor": "auto"}  # marks have their own colour around them
SEED = 1_000  # the experiment's
TOUCHES = 15
#: The goal's lattice: balanced, about a million bins.
GOAL_BINS: Bins = (64, 64, 244)
GOAL_CELL_MM = 0.5

_MIB = number(".1f", 1.0 / (1 << 20))
_MM = number(".3f")
_NATS = number(".1e")
_PERCENT = number(".0f", 100.0)
_DIFFERENCE = partial(mean_text, sign="+")

RUNS: list[Column] = [
    ("filter", "filter", plain),
    ("map cells, mm", "cell_mm", plain),
    ("bins per object, or particles", "count", count_text),
    ("bins", "bins", plain),
    ("trials", "trials", plain),
    ("in full", "full_trials", plain),
    ("time per touch", "seconds_per_touch", seconds_text),
    ("per unknown", "seconds_per_unknown", seconds_text),
    ("per refined pose", "seconds_refine", seconds_text),
    ("memory, MiB", "device_bytes", _MIB),
    ("recognised, %", "accuracy", _PERCENT),
    ("calibration error", "expected_calibration_error", _MM),
    ("located", "error_mm/trials", plain),
    ("mode: mean error, mm", "error_mm", mean_text),
    ("95 %", "error_mm/p95", _MM),
    ("refined: mean error, mm", "refined_error_mm", mean_text),
    ("95 %", "refined_error_mm/p95", _MM),
    ("nearest bin, mm", "nearest_bin_mm", _MM),
    ("largest deviation, nats", "deviation_nats/largest", _NATS),
    ("RMS", "deviation_nats/rms", _NATS),
]
BOUNDS: list[Column] = [
    ("bins per object", "count", count_text),
    ("bins in all", "bins_in_all", count_text),
    ("trials", "trials", plain),
    ("histogram, asked once", "histogram/once", seconds_text),
    ("bounded", "bounded/once", seconds_text),
    ("histogram, after each touch", "histogram/each_touch", seconds_text),
    ("bounded", "bounded/each_touch", seconds_text),
    ("bins evaluated", "bins_evaluated", count_text),
    ("of all, %", "share_evaluated", number(".3g", 100.0)),
    ("certificate", "certificate", _NATS),
    ("measured error", "measured_error", _NATS),
    ("certificates that hold", "certificates_hold", plain),
    ("same mode", "same_modes", plain),
    ("host memory, MiB", "host_bytes", _MIB),
    ("bounds are faster", "bounds_are_faster", plain),
]
LIMITS: list[Column] = [
    ("what is changed", "name", plain),
    ("elements", "elements", plain),
    ("bins per object", "count", count_text),
    ("mode: mean error, mm", "error_mm", mean_text),
    ("refined: mean error, mm", "refined_error_mm", mean_text),
    ("compared with", "against", plain),
    ("mode: difference, mm", "difference_mm", _DIFFERENCE),
    ("refined: difference, mm", "refined_difference_mm", _DIFFERENCE),
]


def _step_text(step: dict[str, float]) -> str:
    change = 100.0 * (step["to"] / step["from"] - 1.0) if step["from"] > 0.0 else 0.0
    return f"{step['from']:.3f} to {step['to']:.3f} ({change:+.0f} %)"


STEPS: list[Column] = [
    ("map cells, mm", "cell_mm", plain),
    ("from bins", "from", count_text),
    ("to bins", "to", count_text),
    ("trials", "error_mm/trials", plain),
    ("mode: mean error, mm", "error_mm", _step_text),
    ("difference, mm", "error_mm", _DIFFERENCE),
    ("refined: mean error, mm", "refined_error_mm", _step_text),
    ("difference, mm", "refined_error_mm", _DIFFERENCE),
]
VERDICTS: list[Column] = [
    ("goal", "name", plain),
    ("measured, mm", "value", _MM),
    ("at most", "at_most", plain),
    ("reached", "reached", plain),
]


def scaled(count: float) -> Bins:
    """A lattice of some number of bins in the proportions of the goal's."""
    factor = (count / math.prod(GOAL_BINS)) ** (1.0 / 3.0)
    x, y, theta = (max(1, math.floor(factor * n + 0.5)) for n in GOAL_BINS)
    return x, y, theta


def knee_record(points: Sequence[Json], cell_mm: float, fine: Bins) -> Json:
    """Where more bins stop helping on maps of one cell size.

    The fewest bins that suffice, the error on the finest lattice, the lattice that --bins fine takes,
    and what more bins gain from step to step: to each run from the finest of at most a fifth of its
    bins, over the trials that both locate.
    """
    runs = [point for point in points if point["balanced"] and point["cell_mm"] == cell_mm]
    finest, fine_count = runs[-1], math.prod(fine)
    mode, refined = (knee_of([run[name] for run in runs]) for name in ("errors_mm", "refined_errors_mm"))

    def text(knee: int | None) -> str:
        return f"at least {count_text(finest['count'])}" if knee is None else count_text(runs[knee]["count"])

    steps = []
    for to in runs:
        for coarser in [run for run in runs if 5 * run["count"] <= to["count"]][-1:]:
            step: Json = {"cell_mm": cell_mm, "from": coarser["count"], "to": to["count"]}
            for name in ("error", "refined_error"):
                step[f"{name}_mm"] = differences(to[f"{name}s_mm"], coarser[f"{name}s_mm"])
            steps.append(step)
    return {
        "cell_mm": cell_mm,
        "balanced_count": fine_count,
        "floor_mm": finest["refined_error_mm"],
        "sentence": f"Maps with cells of {cell_mm:g} mm need {text(mode)} bins for the mode and "
        f"{text(refined)} for the refined pose; --bins fine takes {plain(fine)} = {count_text(fine_count)}.",
        "steps": steps,
    }


def bounds_sentence(points: Sequence[Json]) -> str:
    """How well bounds agree with the histogram."""
    compared = [point["by_bounds"] for point in points if point["by_bounds"]]
    mode_mm, refined_mm = (
        max((of[f"{kind}_difference_mm"] for of in compared), default=0.0) for kind in ("mode", "refined")
    )
    return (
        f"Of {sum(of['compared_trials'] for of in compared)} trials with the full posterior on the same "
        f"lattices, modes lie within {mode_mm:.1e} mm of those by bounds, and refined poses within "
        f"{refined_mm:.1e} mm."
    )


def verdicts_of(points: Sequence[Json]) -> list[Json]:
    """The mean errors on the goal's lattice against their goals."""
    size = " x ".join(map(str, GOAL_BINS))
    return [
        {
            "name": f"mean error {words}, {size} bins, {TOUCHES} touches, "
            f"{point[field]['trials']} of {point['trials']} trials",
            "value": point[field]["mean"],
            "at_most": goal_mm,
            "reached": point[field]["mean"] <= goal_mm,
        }
        for point in points
        if point["bins"] == list(GOAL_BINS) and point["cell_mm"] == GOAL_CELL_MM
        for field, words, goal_mm in (
            ("error_mm", "by the mode", 0.3),
            ("refined_error_mm", "refined", 0.2),
        )
        if point[field]
    ]


def measure(device: palpate.Device, options: argparse.Namespace) -> Json:
    """Runs everything, and prints what is known as soon as it is."""
    quick = options.quick
    trials = make_trials(VOWELS, options.trials or (4 if quick else 10), TOUCHES, SEED)
    # What gets the full posterior: all trials of a letter, two of them, or one.
    most_full, most_twice = (5_000, 5_000) if quick else (320_000, 1_200_000)
    decades = [1e3, 1e4] if quick else [1e2, 1e3, 1e4, 1e5, 1e6, 1e7]
    counts = [1e2, 1e3, 1e4] if quick else [1e2, 1e3, 1e4, 3e4, 1e5, 3e5, 1e6, 3e6, 1e7]
    particles = [1_000, 10_000] if quick else [100, 1_000, 10_000, 100_000, 1_000_000]
    bounded = [1e2, 1e3, 1e4, 3e4] if quick else [1e3, 3e3, 1e4, 2e4, 3e4, 1e5, 1e6, 1e7]
    training = [one[:: 3 if quick else 1] for one in training_recordings()]
    points = Table(RUNS)
    bounds: list[Json] = []
    knees: list[Json] = []

    for cell_mm in (1.0, GOAL_CELL_MM) if quick else (1.0, GOAL_CELL_MM, 0.25):
        maps = letter_maps(device, training, cell_mm=cell_mm)
        goal = cell_mm == GOAL_CELL_MM
        lattices = sorted([*map(scaled, counts), *TABLE_1], key=math.prod)
        for bins in lattices if goal else map(scaled, decades):
            size = math.prod(bins)
            few = 2 if size <= most_twice else 1
            full = len(trials) if size <= most_full or (goal and bins == GOAL_BINS) else few
            points.append(measure_histogram(device, maps, trials, full, bins))
        for kind in ("particles", "systematic", "augmented") if goal else ():
            for count in particles:
                some = first_each(trials, 1) if count > 300_000 else trials
                points.append(measure_particles(device, maps, some, kind, count))
        for bins in map(scaled, bounded) if goal else ():
            some = first_each(trials, 1 if quick or math.prod(bins) > 1_200_000 else 4)
            bounds.append(measure_bounds(device, maps, some, bins))
        fine = palpate.balanced_lattice(lattice_of(GOAL_BINS), maps, "fine")
        knees.append(knee_record(points, cell_mm, fine.shape[::-1]))
    Table(BOUNDS, bounds)
    lattices = [scaled(1e4)] if quick else [GOAL_BINS, scaled(3e5), scaled(3e6)]
    each = min(len(trials) // len(VOWELS), 2 if quick else len(trials))
    limits = measure_limits(device, quick, lattices, each, TOUCHES, SEED)
    Table(LIMITS, limits)
    print("", *(f"- {knee['sentence']}" for knee in knees), sep="\n")
    Table(STEPS, [step for knee in knees for step in knee["steps"]])
    agreement, verdicts = bounds_sentence(points), verdicts_of(points)
    print(f"\n{agreement}")
    Table(VERDICTS, verdicts)
    return {
        "touches": TOUCHES,
        "trials": len(trials),
        "points": points,
        "agreement": agreement,
        "bounds": bounds,
        "knees": knees,
        "limits": limits,
        "verdicts": verdicts,
    }


def front_of(costs: Floats, errors: Floats) -> NDArray[numpy.intp]:
    """Which are on the Pareto front of costs and errors, by rising cost; of equals the first."""
    rising = numpy.lexsort((errors, costs))
    least = numpy.minimum.accumulate(errors[rising])
    return numpy.compress(numpy.diff(least, prepend=numpy.inf) < 0.0, rising)


def pose_chart(document: Json) -> Axes:
    """The front is over runs that recognise and locate all trials, as errors over some would flatter."""
    x = f"time per unknown of {document['touches']} touches, an estimate after each"
    axes = charts.chart(x, "mean pose error (mm)", xscale="log", yscale="log")
    charts.ticks(axes.xaxis, seconds_text)
    fills: dict[float, Json] = {0.25: {"alpha": 0.4}, 0.5: {}, 1.0: charts.HOLLOW}
    best = []
    for colour, (kind, of, name, mark, side) in zip(
        charts.COLOURS,
        (
            # The refined pose stands right below its mode, and particles by their like.
            ("histogram", "error_mm", "histogram, mode", "o", ""),
            ("histogram", "refined_error_mm", "histogram, refined", "s", "right"),
            ("particles", "error_mm", "particles", "^", "left"),
            ("augmented", "error_mm", "Augmented MCL", "D", ""),
            ("systematic", "error_mm", "systematic resampling", "^", ""),
        ),
        strict=False,
    ):
        for cell_mm, fill in fills.items():
            points = [
                point | {"seconds": point["seconds_per_unknown"] + refine_s}
                for point in document["points"]
                if (point["filter"], point["cell_mm"]) == (kind, cell_mm) and point[of]
                for refine_s in [point["seconds_refine"] if of == "refined_error_mm" else 0.0]
            ]
            look: Json = {"linestyle": "", "marker": mark, "color": colour} | EDGED | fill
            if points:
                label = name if cell_mm == 0.5 else ""
                charts.series(axes, points, "seconds", f"{of}/mean", label, **look)
            for point in points:
                place = point["seconds"], point[of]["mean"]
                if side and cell_mm == 0.5:  # below the mark and left of it, or above and right
                    text: Json = {"textcoords": "offset points", "fontsize": 8, "color": colour, "ha": side}
                    axes.annotate(count_text(point["count"]), place, (6, 3) if side == "left" else (2, -13), **text)
                if point["accuracy"] == 1.0 and point[of]["trials"] == document["trials"]:
                    best.append(place)
    if best:
        costs, errors = numpy.transpose(best)
        front = front_of(costs, errors)
        look = {"color": charts.GREY, "linestyle": "-", "marker": "", "zorder": 1}
        axes.plot(costs[front], errors[front], label="Pareto front", **look)
    return axes


def knee_chart(document: Json) -> Axes:
    """Errors over balanced bins, by colours for map cells."""
    axes = charts.chart("bins per object", "mean pose error (mm)", xscale="log", yscale="log")
    charts.ticks(axes.xaxis, count_text)
    balanced = [point for point in document["points"] if point["balanced"]]
    finest = max(point["count"] for point in balanced)
    for colour, knee in zip(charts.COLOURS, document["knees"], strict=False):
        cell_mm = knee["cell_mm"]
        own = [point for point in balanced if point["cell_mm"] == cell_mm]
        for path, label, look in (
            ("error_mm/mean", f"{cell_mm:g} mm cells, mode", charts.SOLID),
            ("refined_error_mm/mean", f"{cell_mm:g} mm, refined", charts.DASHED | {"linestyle": "-"}),
        ):
            charts.series(axes, own, "count", path, label, color=colour, **EDGED | look)
        if knee["balanced_count"] <= 2.0 * finest:
            charts.rule(axes, knee["balanced_count"], f"fine, {cell_mm:g} mm", vertical=True, colour=colour)
        if cell_mm == 0.5:
            look = {"color": charts.GREY, "linestyle": "--", "marker": ""}
            charts.series(axes, own, "count", "nearest_bin_mm", "nearest bin", **look)
    floors = [knee["floor_mm"] for knee in document["knees"] if knee["floor_mm"]]
    for least in sorted(floors, key=lambda floor: float(floor["mean"]))[:1]:
        charts.rule(axes, least["mean"], f"least error {mean_text(least)} mm, {least['trials']} trials")
    return axes


def bounds_chart(document: Json) -> Axes:
    """Times of histogram and bounds over bins."""
    y = f"time per unknown of {document['touches']} touches"
    axes = charts.chart("bins in all", y, xscale="log", yscale="log")
    charts.ticks(axes.xaxis, count_text)
    charts.ticks(axes.yaxis, seconds_text)
    for colour, kind, name in (
        (charts.COLOURS[0], "histogram", "histogram"),
        (charts.COLOURS[1], "bounded", "by bounds"),
    ):
        for asked, words, look in (
            ("once", "asked once", charts.SOLID),
            ("each_touch", "asked after each touch", charts.DASHED),
        ):
            look = EDGED | {"color": colour} | look
            label = f"{name}, {words}"
            charts.series(axes, document["bounds"], "bins_in_all", f"{kind}/{asked}", label, **look)
    return axes


def charts_of(document: Json) -> dict[str, Figure]:
    """All charts, by the names of their files."""
    drawn = {
        "sweep_front": pose_chart(document),
        "sweep_bins": knee_chart(document),
        "sweep_bounds": bounds_chart(document),
    }
    return {name: charts.finished(axes) for name, axes in drawn.items()}


def program() -> None:
    """Reads the flags and measures."""
    flags = parser(
        "sweep",
        "Measures speed against error on simulated letters, in some 20 minutes on two CPU cores: every "
        "filter, from 100 to 10,000,000 bins per object, on maps of several cell sizes. The same of "
        "your own objects: python -m palpate.sweep.",
        plots="draw the charts in this folder",
        trials="trials per letter [10, or 4 with --quick]",
    )
    options = flags.parse_args()
    start = time.perf_counter()
    device, facts = begin(options)
    document = facts | measure(device, options)
    document["seconds in all"] = round(time.perf_counter() - start, 1)
    write(options.json, document)
    charts.save(charts_of(document), options.plots)


if __name__ == "__main__":
    main(program)
