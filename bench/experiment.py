"""Sec. IV of the paper on simulated letters: histogram and particle filters over touches."""

import argparse
import itertools
import time
from collections.abc import Sequence
from typing import Any

import numpy

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import palpate
from palpate import _charts as charts
from palpate._statistics import errors_over, present
from palpate._tables import Column, Table, column, number, plain

from .measures import calibration, share_record, student_record, with_interval
from .program import Json, at_least_1, begin, main, parser, write
from .trials import TABLE_1, VOWELS, Bins, Floats, Touching, letter_maps, make_trials, recognized

SEED = 1_000
#: Nearly as many bins as Table I's, balanced so that a turn by a bin moves a letter as far as a shift
#: by one.
BALANCED: Bins = (13, 13, 55)
#: What the robot reports of the array's pose is off by these standard deviations, in mm and rad.
NOISE = ((0.0, 0.0), (1.0, 0.05), (2.0, 0.1))

# What the paper reports of letters that it touched with a real sensor.
PUBLISHED_BINS_KNOW_AFTER = {1_000: 46, 10_000: 9}  # touches to an accuracy of 100 %
PUBLISHED_ERROR_MM = 1.3  # mean, of the histogram
PUBLISHED_PARTICLE_ACCURACY = 74.0  # %, where 10,000 particles level out
MOST_PARTICLES = 10_000
MEAN_ERROR = "mean pose error of trials with the right letter (mm)"

_MM = number(".3f")
RUNS: list[Column] = [
    ("filter", "name", plain),
    ("array off by", "off_by", plain),
    ("trials", "trials", plain),
    ("touches", "last/touches", plain),
    ("time, s", "seconds", number(".1f")),
    ("right at the end, %", "last/right", with_interval(".1f", 100.0)),
    ("all right from touch", "all_right_from", plain),
    ("mean error, mm", "last/error_mm/mean", _MM),
    ("median", "last/error_mm/median", _MM),
    ("95 %", "last/error_mm/p95", _MM),
    ("refined: mean error, mm", "last/refined_error_mm/mean", _MM),
    ("95 %", "last/refined_error_mm/p95", _MM),
    ("errs less than the mode from touch", "refined_less_from", plain),
    ("calibration error, %", "calibration/expected_error", number(".1f", 100.0)),
]
COMPARISONS: list[Column] = [
    ("histogram", "histogram", plain),
    ("against", "particles", plain),
    ("array off by", "off_by", plain),
    ("identity: histogram", "identity", plain),
    ("more right over touches, %", "right_lead", number("+.1f", 100.0)),
    ("at the end", "last_right_lead", number("+.1f", 100.0)),
    ("pose, where both locate", "pose", plain),
    ("less error over touches, mm", "lead_mm", number("+.2f")),
    ("at the end", "last_lead_mm", with_interval("+.2f")),
]


def run_filter(
    device: palpate.Device,
    maps: list[palpate.OccupancyGrid],
    trials: Sequence[palpate.Recording],
    kind: str,
    size: Bins | int,
    off_by: str,
) -> Json:
    """One filter over the trials: so many bins of a histogram, or particles, or of "augmented" MCL.

    Each trial has particles of a seed of its own, from 1 on. `count` is of bins per object or of
    particles in all, `steps` is what recognized() gives. off_by: how far the array is off.
    """
    start = time.perf_counter()
    if isinstance(size, tuple):
        steps = recognized(device, maps, trials, bins=size, filter=kind)
    else:
        options: Json = {"filter": "particles", "augmented": kind == "augmented", "particles": size}
        steps = [
            recognized(device, maps, [trial], seed=seed, **options)[0]
            for seed, trial in enumerate(trials, start=1)
        ]
    curve = [point_of(touch, of) for touch, of in enumerate(zip(*steps, strict=True), 1)]
    less = column(curve, "refined_error_mm/mean") < column(curve, "error_mm/mean")
    return {
        "filter": kind,
        "name": f"{'augmented MCL' if kind == 'augmented' else kind} {plain(size)}",
        "count": int(numpy.prod(size)),
        "off_by": off_by,
        "trials": len(trials),
        "seconds": time.perf_counter() - start,
        "curve": curve,
        "last": curve[-1],
        "all_right_from": from_touch(column(curve, "accuracy") == 1.0),
        "refined_less_from": from_touch(less),
        "calibration": calibration(column(steps, "confidence").ravel(), column(steps, "right").ravel()),
        "steps": steps,
    }


def point_of(touches: int, steps: Sequence[Json]) -> Json:
    """After some touches: accuracy, confidence, and errors of modes and refined poses."""
    right = share_record(sum(step["right"] for step in steps), len(steps))
    errors = errors_over(column(steps, "error_mm"))
    return {
        "touches": touches,
        "right": right,
        "accuracy": right["mean"],
        "accuracy_low": right["low"],
        "accuracy_high": right["high"],
        "mean_confidence": float(column(steps, "confidence").mean()),
        "located": errors["trials"] if errors else 0,
        "error_mm": errors,
        "refined_error_mm": errors_over(column(steps, "refined_error_mm")),
    }


def from_touch(holds: NDArray[numpy.bool_]) -> int | None:
    """From which touch on something holds to the end, where it does at the end."""
    touch = 1 + int(numpy.append(0, numpy.flatnonzero(~holds) + 1)[-1])
    return touch if touch <= len(holds) else None


def standing(leads: Floats) -> str:
    """From which touches on one is ahead, tied or behind, by its leads after 1, 2, ... touches."""
    words = {1.0: "ahead", 0.0: "tied", -1.0: "behind"}
    spans = itertools.groupby(enumerate(numpy.sign(leads), 1), lambda each: words.get(each[1], "unknown"))
    return "; ".join(f"{word} from touch {next(span)[0]}" for word, span in spans)


def comparisons_of(runs: Sequence[Json]) -> list[Json]:
    """Each histogram against each particle filter of as many particles as it has bins per object.

    Trials that the histogram has right, minus those of the particles; and the particles' error minus the
    histogram's over the trials that both locate: errors over its own trials would flatter the filter
    that loses the hard ones.
    """
    rows = []
    for particles, histogram in itertools.product(runs, runs):
        if particles["filter"] == "histogram" or histogram["filter"] != "histogram":
            continue
        if not as_many(histogram["count"], particles["count"]):
            continue
        right, leads_mm = (
            sign * (column(histogram["steps"], path) - column(particles["steps"], path))
            for sign, path in ((1.0, "right"), (-1.0, "error_mm"))
        )  # [trial, touch]
        ahead = right.mean(axis=0)
        located = [present(of) for of in leads_mm.T]
        ahead_mm = numpy.array([of.mean() if len(of) else numpy.nan for of in located])
        rows.append(
            {
                "histogram": histogram["name"],
                "particles": particles["name"],
                "off_by": particles["off_by"],
                "identity": standing(ahead),
                "right_lead": float(ahead.mean()),
                "last_right_lead": float(ahead[-1]),
                "pose": standing(ahead_mm),
                "lead_mm": float(numpy.nanmean(ahead_mm)),
                "last_lead_mm": student_record(located[-1]) if len(located[-1]) else None,
            }
        )
    return rows


def as_many(a: int, b: int) -> bool:
    """Whether two counts agree within a tenth.

    Whole numbers of balanced bins along each axis rarely multiply to a given count.
    """
    return 10 * abs(a - b) <= max(a, b)


def plot(axes: Axes, run: Json, path: str, label: str, scale: float = 1.0, **look: Any) -> str | None:
    """A field over touches, with a mark at every fifth, so that the dashes show between: the colour."""
    return charts.series(axes, run["curve"], "touches", path, label, scale, markevery=5, **look)


def draw_accuracy(runs: list[Json]) -> Axes:
    """With 95 % intervals as shades."""
    axes = charts.chart("touches", "trials with the right letter, and 95 % interval (%)")
    for run in runs:
        colour = plot(axes, run, "accuracy", run["name"], 100.0)
        touches, low, high = (column(run["curve"], of) for of in ("touches", "accuracy_low", "accuracy_high"))
        axes.fill_between(touches, 100.0 * low, 100.0 * high, color=colour, alpha=0.12, linewidth=0)
    axes.set_ylim(0.0, 105.0)
    return axes


def draw_errors(runs: list[Json]) -> Axes:
    """Mean errors of modes."""
    axes = charts.chart("touches", MEAN_ERROR)
    for run in runs:
        plot(axes, run, "error_mm/mean", run["name"])
    axes.set_ylim(bottom=0.0)
    return axes


def draw_noise(levels: Sequence[Json], largest_count: int) -> Axes:
    """Colours tell the noise apart, dashes the filters, each with its largest count."""
    title = "standard deviation of the error of the reported sensor pose"
    axes = charts.chart("touches", MEAN_ERROR, title, yscale="log")
    for kind, count, look in (
        ("histogram", largest_count, charts.SOLID),
        ("particles", MOST_PARTICLES, charts.DASHED),
    ):
        for colour, level in zip(charts.COLOURS, levels, strict=False):
            for run in level["filters"]:
                if run["filter"] == kind and run["count"] == count:
                    off = f"{level['translation_mm']:g} mm, {level['rotation_rad']:g} rad"
                    plot(axes, run, "error_mm/mean", f"{run['name']}, {off}", color=colour, **look)
    axes.set_xlim(right=len(levels[-1]["filters"][0]["curve"]) + 0.5)
    return axes


def draw_calibration(runs: list[Json]) -> Axes:
    """The share that is right against the probability that was told."""
    fewest = 10  # estimates of which a fraction says something
    axes = charts.chart(
        "confidence: probability of the most probable letter (%)",
        "estimates that are right (%)",
        f"expected calibration error in brackets; at least {fewest} estimates per point",
    )
    for run in runs:
        bins = [part for part in run["calibration"]["bins"] if part["count"] >= fewest]
        confidence, right = (100.0 * column(bins, of) for of in ("mean_confidence", "fraction_right"))
        error = 100.0 * run["calibration"]["expected_error"]
        axes.plot(confidence, right, label=f"{run['name']} ({error:.1f} %)")
    axes.plot([0, 100], [0, 100], ":", marker="", color=charts.GREY, label="perfectly calibrated")
    axes.set(xlim=(0.0, 100.0), ylim=(0.0, 105.0))
    return axes


def draw(levels: Sequence[Json]) -> dict[str, Figure]:
    """Fig. 6a, 6b, 7a and 7b with the paper's headline numbers, and what goes beyond the paper."""
    histograms, particles, augmented = (
        [run for run in levels[0]["filters"] if run["filter"] == kind]
        for kind in ("histogram", "particles", "augmented")
    )
    most = max(run["count"] for run in histograms)
    largest = [run for run in histograms if as_many(run["count"], most)]
    finest = next(run for run in largest if run["count"] == most)
    y = "pose error of trials with the right letter (mm)"
    drawn = {
        "fig6a": draw_accuracy(particles),
        "fig6b": draw_errors(particles),
        "fig7a": draw_accuracy(histograms),
        "fig7b": draw_errors(histograms),
        "augmented": charts.chart("touches", "trials with the right letter (%)"),
        "errors": charts.chart("touches", y, finest["name"], yscale="log"),
        "refined": charts.chart("touches", MEAN_ERROR, yscale="log"),
        "pose_noise": draw_noise(levels, most),
        # All particle filters would hide more than they show.
        "calibration": draw_calibration([*histograms, particles[-1]]),
    }
    charts.rule(drawn["fig6a"], PUBLISHED_PARTICLE_ACCURACY, "paper: 10,000 particles level out")
    charts.rule(drawn["fig7b"], PUBLISHED_ERROR_MM, f"paper: {PUBLISHED_ERROR_MM} mm")
    for mark, (count, touches) in zip("PD", PUBLISHED_BINS_KNOW_AFTER.items(), strict=True):
        look: Json = {"color": charts.GREY, "markersize": 8, "linestyle": ""}
        label = f"paper: {count:,} bins reach 100 %"
        drawn["fig7a"].plot(touches, 100.0, marker=mark, label=label, **look)
    for runs, dash in ((particles, "-"), (augmented, "--")):
        for colour, run in zip(charts.COLOURS, runs, strict=False):
            look = {"color": colour, "linestyle": dash}
            plot(drawn["augmented"], run, "accuracy", run["name"], 100.0, **look)
    drawn["augmented"].set_ylim(0.0, 105.0)
    for label, path in (
        ("mode, mean", "error_mm/mean"),
        ("mode, 95th percentile", "error_mm/p95"),
        ("mode, median", "error_mm/median"),
        ("refined, 95th percentile", "refined_error_mm/p95"),
        ("refined, mean", "refined_error_mm/mean"),
    ):
        plot(drawn["errors"], finest, path, label)
    for run in largest:
        plot(drawn["refined"], run, "error_mm/mean", f"{run['name']}, mode")
        plot(drawn["refined"], run, "refined_error_mm/mean", f"{run['name']}, refined")
    return {name: charts.finished(axes) for name, axes in drawn.items()}


def measure(options: argparse.Namespace) -> None:
    """Runs all filters, prints their rows, and writes what the options name."""
    device, facts = begin(options)
    maps, quick = letter_maps(device), options.quick
    each, touches = options.trials or (4 if quick else 10), options.touches or (12 if quick else 50)
    particles = (1_000, MOST_PARTICLES) if quick else (100, 1_000, MOST_PARTICLES)
    kinds: list[tuple[str, Bins | int]] = [("histogram", bins) for bins in (*TABLE_1, BALANCED)]
    kinds += [(kind, count) for kind in ("particles", "augmented") for count in particles]
    of_noise = [*kinds[1:3], ("particles", MOST_PARTICLES)]
    comparisons: list[Json] = []
    levels, table = [], Table(RUNS)
    for mm, rad in NOISE:
        undisplaced, off_by = mm == 0.0, f"{mm:g} mm, {rad:g} rad"
        limit = touches if undisplaced else min(touches, 20)
        trials = make_trials(VOWELS, each, limit, SEED, Touching(noise=(mm, rad)))
        runs = []
        for kind, size in kinds if undisplaced else of_noise:
            runs.append(run_filter(device, maps, trials, kind, size, off_by))
            table.append(runs[-1])
        comparisons += comparisons_of(runs)
        without = [{name: of for name, of in run.items() if name != "steps"} for run in runs]
        levels.append({"translation_mm": mm, "rotation_rad": rad, "filters": without})
    Table(COMPARISONS, comparisons)
    document = {"filters": levels[0]["filters"], "comparisons": comparisons, "pose_noise": levels[1:]}
    write(options.json, facts | document)
    if options.plots:
        charts.save(draw(levels), options.plots)


def program() -> None:
    """Reads the flags and measures."""
    flags = parser(
        "experiment",
        "Repeats Sec. IV of the paper on simulated letters, in some two minutes on two CPU cores: "
        "identity and pose error against the number of touches, for histogram and particle filters; "
        "calibration; misplaced touches.",
        plots="draw the paper's figures in this folder",
        trials="trials per letter [10, or 4 with --quick]",
    )
    flags.add_argument("--touches", type=at_least_1, metavar="N",
                       help="touches per trial, at most 192 [50, or 12 with --quick]")  # fmt: skip
    measure(flags.parse_args())


if __name__ == "__main__":
    main(program)
