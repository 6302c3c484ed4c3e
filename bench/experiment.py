"""Sec. IV of the paper on simulated letters: histogram and particle filters over touches."""

import argparse
import time
from collections.abc import Sequence
from itertools import groupby
from typing import Any

import numpy

import palpate
from palpate import _charts as charts
from palpate._statistics import errors_over, present
from palpate._tables import Column, Table, column, number, plain, print_table

from .experiment_charts import MOST_PARTICLES, as_many, draw
from .measures import calibration, share_record, student_record, with_interval
from .program import Json, at_least_1, begin, main, parser, write
from .trials import (
    TABLE_1,
    VOWELS,
    Bins,
    Floats,
    Touching,
    letter_maps,
    make_trials,
    recognized,
)

SEED = 1_000
#: Nearly as many bins as Table I's, balanced so that a turn by a bin moves a letter as far as a shift
#: by one.
BALANCED: Bins = (13, 13, 55)
#: What the robot reports of the array's pose is off by these standard deviations, in mm and rad.
NOISE = ((0.0, 0.0), (1.0, 0.05), (2.0, 0.1))

_MM = number(".3f")
RUNS: list[Column] = [
    ("filter", "name", plain),
    ("array off by", "off_by", plain),
    ("trials", "trials", plain),
    ("touches", "last/touches", plain),
    ("time, s", "seconds", number(".1f")),
    ("right at the end, %", "right", with_interval(".1f", 100.0)),
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
) -> Json:
    """One filter over the trials: so many bins of a histogram, or particles, or of "augmented" MCL.

    Each trial has particles of a seed of its own, from 1 on. `count` is of bins per object or of
    particles in all, `steps` is what recognized() gives.
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
    return {
        "filter": kind,
        "name": f"{'augmented MCL' if kind == 'augmented' else kind} {plain(size)}",
        "count": int(numpy.prod(size)),
        "seconds": time.perf_counter() - start,
        "curve": [point_of(touch, of) for touch, of in enumerate(zip(*steps, strict=True), 1)],
        "calibration": calibration(column(steps, "confidence").ravel(), column(steps, "right").ravel()),
        "steps": steps,
    }


def point_of(touches: int, steps: Sequence[Json]) -> Json:
    """After some touches: accuracy, confidence, and errors of modes and refined poses."""
    right = share_record(sum(step["right"] for step in steps), len(steps))
    errors = errors_over(column(steps, "error_mm"))
    return {
        "touches": touches,
        "accuracy": right["mean"],
        "accuracy_low": right["low"],
        "accuracy_high": right["high"],
        "mean_confidence": float(column(steps, "confidence").mean()),
        "located": errors["trials"] if errors else 0,
        "error_mm": errors,
        "refined_error_mm": errors_over(column(steps, "refined_error_mm")),
    }


def row_of(run: Json, off_by: str) -> Json:
    """A run's row of RUNS."""
    curve, last = run["curve"], run["curve"][-1]

    def from_touch(holds: Any) -> int | None:
        """From which touch on something holds to the end, where it does at the end."""
        fails = numpy.flatnonzero(~holds)
        touch = 1 + (fails[-1] + 1 if len(fails) else 0)
        return touch if touch <= len(curve) else None

    less = column(curve, "refined_error_mm/mean") < column(curve, "error_mm/mean")
    return run | {
        "off_by": off_by,
        "trials": len(run["steps"]),
        "last": last,
        "right": {"mean": last["accuracy"], "low": last["accuracy_low"], "high": last["accuracy_high"]},
        "all_right_from": from_touch(column(curve, "accuracy") == 1.0),
        "refined_less_from": from_touch(less),
    }


def ranges_of(touches: Sequence[int]) -> str:
    """Rising touch counts, such as "1-4, 8"."""
    runs = groupby(enumerate(touches), lambda pair: pair[1] - pair[0])
    ends = [[touch for _, touch in run] for _, run in runs]
    return ", ".join(f"{of[0]}-{of[-1]}" if len(of) > 1 else f"{of[0]}" for of in ends)


def standing(leads: Floats) -> str:
    """Which of two is ahead after 1, 2, ... touches, by their leads; nothing where one is NaN."""
    told = []
    for word, sign in (("ahead", 1), ("tied", 0), ("behind", -1)):
        if len(at := numpy.flatnonzero(numpy.sign(leads) == sign)):
            told.append(f"{word} at touch {ranges_of((at + 1).tolist())}")
    return "; ".join(told)


def comparisons_of(runs: Sequence[Json], off_by: str) -> list[Json]:
    """Each histogram against each particle filter of as many particles as it has bins per object.

    Trials that the histogram has right, minus those of the particles; and the particles' error minus the
    histogram's over the trials that both locate: errors over its own trials would flatter the filter
    that loses the hard ones.
    """
    rows = []
    for particles in (run for run in runs if run["filter"] != "histogram"):
        for histogram in (run for run in runs if run["filter"] == "histogram"):
            if as_many(histogram["count"], particles["count"]):
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
                        "off_by": off_by,
                        "identity": standing(ahead),
                        "right_lead": float(ahead.mean()),
                        "last_right_lead": float(ahead[-1]),
                        "pose": standing(ahead_mm),
                        "lead_mm": float(numpy.nanmean(ahead_mm)),
                        "last_lead_mm": student_record(located[-1]) if len(located[-1]) else None,
                    }
                )
    return rows


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
        exact, off_by = mm == 0.0, f"{mm:g} mm, {rad:g} rad"
        most = touches if exact else min(touches, 20)
        trials = make_trials(VOWELS, each, most, SEED, Touching(noise=(mm, rad)))
        runs = []
        for kind, size in kinds if exact else of_noise:
            runs.append(run_filter(device, maps, trials, kind, size))
            table.append(row_of(runs[-1], off_by))
        comparisons += comparisons_of(runs, off_by)
        without = [{name: of for name, of in run.items() if name != "steps"} for run in runs]
        levels.append({"translation_mm": mm, "rotation_rad": rad, "filters": without})
    print_table(COMPARISONS, comparisons)
    document = facts | {
        "filters": levels[0]["filters"],
        "comparisons": comparisons,
        "pose_noise": levels[1:],
    }
    write(options.json, document)
    if options.plots:
        charts.save(draw(document), options.plots)


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
