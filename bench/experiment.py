"""Sec. IV of the paper on simulated letters: histogram and particle filters over touches."""

import argparse
import csv
import io
import math
import pathlib
import time
from collections.abc import Callable, Sequence
from statistics import fmean
from typing import Any, NamedTuple

import palpate
from palpate._statistics import errors_over
from palpate._tables import plain, value_of

from . import charts
from .experiment_charts import (
    FIGURES,
    MOST_PARTICLES,
    PUBLISHED_BINS_KNOW_AFTER,
    PUBLISHED_ERROR_MM,
    as_many,
    draw,
)
from .measures import calibration, mean_interval, wilson_interval
from .report import Json, Measurement, Report, Run, at_least, main, parser, write, write_json
from .trials import TABLE_1, VOWELS, Bins, Touching, letter_maps, make_trials, truth_of

SEED = 1_000
PARTICLE_SEED = 1
#: Nearly as many bins as Table I's, balanced so that a turn by a bin moves a letter as far as a shift
#: by one.
BALANCED: Bins = (13, 13, 55)
TABLES = ("curves.csv", "calibration.csv", "pose_noise.csv", "trials.csv")


class FilterRun(NamedTuple):
    """What one filter made of all trials."""

    #: As it stands in the document: filter, "histogram", "particles" or "augmented"; name, with its
    #: size; count of bins per object or of particles in all; seconds; curve; calibration.
    record: Json
    steps: list[list[Json]]  #: [trial][touch] records as of `palpate recognize --trace`

    @property
    def name(self) -> str:
        """Filter and size, such as "histogram 25x25x16"."""
        return str(self.record["name"])


def confidence(step: Json) -> float:
    """Probability of the most probable object."""
    return float(step["identity"][step["best"]])


class Filters(NamedTuple):
    """What the filters work on."""

    device: palpate.Device
    maps: list[palpate.OccupancyGrid]

    def histogram(self, bins: Bins, trials: Sequence[palpate.Recording]) -> FilterRun:
        """The histogram filter over the trials, with a step after every touch."""
        start = time.perf_counter()
        records = self._recognize(trials, bins=bins, filter="histogram")
        return _run("histogram", plain(bins), math.prod(bins), records, start)

    def particles(
        self, count: int, trials: Sequence[palpate.Recording], kind: str = "particles"
    ) -> FilterRun:
        """The particle filter, or "augmented" MCL, over the trials; each has a seed of its own."""
        start = time.perf_counter()
        options = {"filter": "particles", "particles": count, "augmented": kind == "augmented"}
        records = [
            self._recognize([trial], seed=seed, **options)[0]
            for seed, trial in enumerate(trials, start=PARTICLE_SEED)
        ]
        return _run(kind, str(count), count, records, start)

    def _recognize(self, trials: Sequence[palpate.Recording], **options: Any) -> list[Any]:
        region: Any = {"x_mm": (-10, 10), "y_mm": (-10, 10), "pivot_mm": (0, 0)}
        return palpate.recognize(
            trials, self.maps, trace=True, device=self.device, **region, **options
        )


def _run(
    kind: str, size: str, count: int, records: Sequence[palpate.Record], start: float
) -> FilterRun:
    """The run whose filter, with its size, gave the records of all trials since the start."""
    steps: list[list[Json]] = [record["trace"] for record in records]
    every = [step for of_trial in steps for step in of_trial]
    record = {
        "filter": kind,
        "name": f"{'augmented MCL' if kind == 'augmented' else kind} {size}",
        "count": count,
        "seconds": time.perf_counter() - start,
        "curve": [point_of(touch, of) for touch, of in enumerate(zip(*steps, strict=True), 1)],
        "calibration": calibration([*map(confidence, every)], [step["right"] for step in every]),
    }
    return FilterRun(record, steps)


def point_of(touches: int, steps: Sequence[Json]) -> Json:
    """After some touches: accuracy, confidence, and errors of modes and refined poses."""
    right = sum(step["right"] for step in steps)
    low, high = wilson_interval(right, len(steps))
    errors = errors_over([step.get("error_mm") for step in steps])
    return {
        "touches": touches,
        "accuracy": right / len(steps),
        "accuracy_low": low,
        "accuracy_high": high,
        "mean_confidence": fmean(map(confidence, steps)),
        "located": errors["trials"] if errors else 0,
        "error_mm": errors,
        "refined_error_mm": errors_over([step.get("refined_error_mm") for step in steps]),
    }


def equal_counts(runs: Sequence[FilterRun]) -> list[tuple[FilterRun, FilterRun]]:
    """All pairs of a histogram and a particle filter with as many particles as bins per object."""
    return [
        (histogram, particles)
        for particles in runs
        for histogram in runs
        if particles.record["filter"] != "histogram" and histogram.record["filter"] == "histogram"
        if as_many(histogram.record["count"], particles.record["count"])
    ]


def compare(first: FilterRun, second: FilterRun) -> list[tuple[int, list[float]]]:
    """One filter against another over the same trials, after 1, 2, ... touches.

    Trials that the first has right, minus those of the second, and second minus first error of the
    trials that both locate: errors over its own trials would flatter the filter that loses the hard
    ones.
    """
    points = []
    for steps in zip(zip(*first.steps, strict=True), zip(*second.steps, strict=True), strict=True):
        pairs = list(zip(*steps, strict=True))
        leads_mm = [
            b["error_mm"] - a["error_mm"]
            for a, b in pairs
            if None not in (a["error_mm"], b["error_mm"])
        ]
        points.append((sum(a["right"] - b["right"] for a, b in pairs), leads_mm))
    return points


def lead_of(name: str, leads_mm: Sequence[float]) -> list[Measurement]:
    """The mean lead in error; nothing where both locate no trial."""
    if not leads_mm:
        return []
    return [Measurement(name, fmean(leads_mm), "mm", interval=mean_interval(leads_mm))]


def ranges_of(touches: Sequence[int]) -> str:
    """Rising touch counts, such as "1-4, 8"."""
    ranges: list[list[int]] = []
    for touch in touches:
        if ranges and ranges[-1][-1] == touch - 1:
            ranges[-1] = [ranges[-1][0], touch]
        else:
            ranges.append([touch])
    return ", ".join("-".join(map(str, ends)) for ends in ranges)


def standing(leads: Sequence[tuple[int, float]]) -> str:
    """Which of two is ahead after how many touches, by (touches, lead)."""
    told = []
    for word, sign in (("ahead", 1), ("tied", 0), ("behind", -1)):
        if touches := [touches for touches, lead in leads if (lead > 0) - (lead < 0) == sign]:
            told.append(f"{word} at touch {ranges_of(touches)}")
    return "; ".join(told)


def accuracy_of(name: str, point: Json, at_least: float | None = None) -> Measurement:
    """A curve's accuracy in percent, with its interval."""
    interval = (100.0 * point["accuracy_low"], 100.0 * point["accuracy_high"])
    return Measurement(name, 100.0 * point["accuracy"], "%", at_least=at_least, interval=interval)


def holds_from(
    name: str, curve: Sequence[Json], holds: Callable[[Json], bool]
) -> list[Measurement]:
    """The number of touches from which something holds to the end, where there is one."""
    fails = [point["touches"] for point in curve if not holds(point)]
    touches = max(fails, default=0) + 1
    return [Measurement(name, touches, "touches on")] if touches <= len(curve) else []


def refined_errs_less(point: Json) -> bool:
    """Whether refined poses err less than modes."""
    refined = point["refined_error_mm"]
    return bool(refined and refined["mean"] < point["error_mm"]["mean"])


def add_run(report: Report, run: FilterRun) -> None:
    """What a run reached beside what the paper reports of its filter."""
    record, curve = run.record, run.record["curve"]
    histogram, count, last = record["filter"] == "histogram", record["count"], curve[-1]
    rows: list[tuple[Any, ...]] = [accuracy_of("accuracy at the end", last)]
    rows += holds_from("right in every trial from", curve, lambda point: point["accuracy"] == 1.0)
    known_after = PUBLISHED_BINS_KNOW_AFTER.get(count, 0) if histogram else 0
    if 0 < known_after <= len(curve):
        least = min(curve[known_after - 1 :], key=lambda point: float(point["accuracy"]))
        rows.append(accuracy_of(f"least accuracy from touch {known_after} on", least, 100.0))
    if error := last["error_mm"]:
        most = PUBLISHED_ERROR_MM if histogram and count == 10_000 else None
        rows.append(("mean error at the end", error["mean"], "mm", most))
        rows.append(("median error at the end", error["median"], "mm"))
        rows.append(("95th percentile of the error at the end", error["p95"], "mm"))
    if refined := last["refined_error_mm"]:
        rows.append(("mean error at the end, refined", refined["mean"], "mm"))
        rows.append(("95th percentile at the end, refined", refined["p95"], "mm"))
        rows += holds_from("refined poses err less than modes from", curve, refined_errs_less)
    expected = 100.0 * record["calibration"]["expected_error"]
    rows.append(("expected calibration error", expected, "%"))
    facts = {
        "trials": len(run.steps),
        "touches": len(curve),
        "seconds": round(record["seconds"], 1),
    }
    report.add(run.name, facts, rows)


def add_comparison(report: Report, histogram: FilterRun, particles: FilterRun) -> None:
    """A histogram against particles over the same trials, over all touches and at the end."""
    points = compare(histogram, particles)
    right = [(touches, lead) for touches, (lead, _) in enumerate(points, start=1)]
    located = [(touches, fmean(of)) for touches, (_, of) in enumerate(points, start=1) if of]
    per_cent = 100.0 / len(histogram.steps)
    ahead = per_cent * fmean(lead for _, lead in right)
    rows: list[tuple[Any, ...]] = [
        ("accuracy ahead, mean over touches", ahead, "% points"),
        ("accuracy ahead at the end", per_cent * right[-1][1], "% points"),
    ]
    if located:
        over = fmean(lead for _, lead in located)
        rows.append(("error less where both locate, over touches", over, "mm"))
    rows += lead_of("error less where both locate, at the end", points[-1][1])
    facts = {
        "equal count": f"{histogram.record['count']} bins for every object; "
        f"{particles.record['count']} particles over all",
        "identity": standing(right),
        "pose, where both locate": standing(located),
    }
    report.add(f"{histogram.name} against {particles.name}", facts, rows)


def add_noise(report: Report, noise: tuple[float, float], runs: Sequence[FilterRun]) -> None:
    """Filters over trials in which the array is not quite where the robot reports it."""
    rows: list[tuple[Any, ...]] = []
    for run in runs:
        last = run.record["curve"][-1]
        rows.append(accuracy_of(f"{run.name}: accuracy at the end", last))
        if error := last["error_mm"]:
            rows.append((f"{run.name}: mean error at the end", error["mean"], "mm"))
    for histogram, particles in equal_counts(runs):
        name = (
            f"{histogram.name}: error less than of {particles.name}, where both locate, at the end"
        )
        rows += lead_of(name, compare(histogram, particles)[-1][1])
    facts = {"trials": len(runs[0].steps), "touches": len(runs[0].record["curve"])}
    report.add(f"array off by {noise[0]:g} mm, {noise[1]:g} rad", facts, rows)


def write_tables(
    folder: str, document: Json, runs: Sequence[FilterRun], labels: Sequence[str]
) -> None:
    """Writes TABLES, the last with a line for every touch of every trial; labels: the true objects."""
    filters, levels = document["filters"], document["pose_noise"]
    points = [{"run": run, "point": point} for run in filters for point in run["curve"]]
    bins = [{"run": run, "bin": bin_} for run in filters for bin_ in run["calibration"]["bins"]]
    noisy = [
        {"noise": level, "run": run, "point": point}
        for level in levels
        for run in level["filters"]
        for point in run["curve"]
    ]
    trials = [
        {
            "run": run.record,
            "trial": trial,
            "object": labels[trial],
            "touches": touches,
            "step": step,
        }
        | {"right": int(step["right"]), "confidence": confidence(step)}
        for run in runs
        for trial, steps in enumerate(run.steps)
        for touches, step in enumerate(steps, start=1)
    ]
    of_run = {"filter": "run/filter", "count": "run/count"}
    shares = ("touches", "accuracy", "accuracy_low", "accuracy_high", "mean_confidence", "located")
    curve = of_run | {name: f"point/{name}" for name in shares}
    for kind, field in (("error", "error_mm"), ("refined", "refined_error_mm")):
        curve |= {f"{kind}_{of}_mm": f"point/{field}/{of}" for of in ("mean", "median", "p95")}
    of_bin = {"confidence_from": "bin/lower", "estimates": "bin/count"}
    of_bin |= {name: f"bin/{name}" for name in ("mean_confidence", "fraction_right")}
    of_noise = {"noise_mm": "noise/translation_mm", "noise_rad": "noise/rotation_rad"}
    of_trial = {of: of for of in ("trial", "object", "touches", "right", "confidence")}
    of_trial |= {of: f"step/{of}" for of in ("error_mm", "refined_error_mm")}
    columns_of = (curve, of_run | of_bin, of_noise | curve, of_run | of_trial)
    for name, columns, rows in zip(TABLES, columns_of, (points, bins, noisy, trials), strict=True):
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(columns)
        for row in rows:
            values = [value_of(row, path) for path in columns.values()]
            table.writerow([f"{v:.6g}" if isinstance(v, float) else v for v in values])
        write(pathlib.Path(folder, name), text.getvalue())


def measure(run: Run, options: argparse.Namespace) -> None:
    """Runs all filters, prints their cases, and writes what the options name."""
    trials_each = options.trials or (4 if options.quick else 10)
    touches = options.touches or (12 if options.quick else 50)
    trials = make_trials(VOWELS, trials_each, touches, SEED)
    filters = Filters(run.device, letter_maps(run.device))
    report = Report(run.facts)
    runs: list[FilterRun] = []
    for bins in (*TABLE_1, BALANCED):
        runs.append(filters.histogram(bins, trials))
        add_run(report, runs[-1])
    for kind in ("particles", "augmented"):
        for count in (1_000, MOST_PARTICLES) if options.quick else (100, 1_000, MOST_PARTICLES):
            runs.append(filters.particles(count, trials, kind))
            add_run(report, runs[-1])
    for pair in equal_counts(runs):
        add_comparison(report, *pair)
    levels = []
    for noise in ((1.0, 0.05), (2.0, 0.1)):
        noisy = make_trials(VOWELS, trials_each, min(touches, 20), SEED, Touching(noise=noise))
        of_level = [filters.histogram(bins, noisy) for bins in TABLE_1[1:]]
        of_level.append(filters.particles(MOST_PARTICLES, noisy))
        add_noise(report, noise, of_level)
        level = {"translation_mm": noise[0], "rotation_rad": noise[1]}
        levels.append(level | {"filters": [one.record for one in of_level]})
    document = report.document() | {"filters": [one.record for one in runs], "pose_noise": levels}
    write_json(options.json, document)
    if options.csv:
        write_tables(options.csv, document, runs, [truth_of(trial).object for trial in trials])
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
    flags.add_argument(
        "--touches",
        type=at_least(1),
        help="touches per trial, at most 192 [50, or 12 with --quick]",
    )
    flags.add_argument("--csv", metavar="FOLDER", help="write tables to this folder")
    options = flags.parse_args()
    measure(Run(options, {"csv": TABLES, "plots": charts.files(FIGURES)}), options)


if __name__ == "__main__":
    main(program)
