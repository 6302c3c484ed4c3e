"""The experiment's tables, and the paper's figures drawn from its document."""

import csv
import io
import pathlib
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from . import charts
from .filter_run import FilterRun, as_many, confidence
from .report import Json, write

# What the paper reports of letters that it touched with a real sensor.
PUBLISHED_BINS_KNOW_AFTER = {1_000: 46, 10_000: 9}  # touches to an accuracy of 100 %
PUBLISHED_ERROR_MM = 1.3  # mean, of the histogram
PUBLISHED_PARTICLE_ACCURACY = 74.0  # %, where 10,000 particles level out
MOST_PARTICLES = 10_000

FIGURES = (
    "fig6a", "fig6b", "fig7a", "fig7b", "augmented", "errors", "refined", "pose_noise", "calibration",
)  # fmt: skip
TABLES = ("curves.csv", "calibration.csv", "pose_noise.csv", "trials.csv")

# Tables: what is not there is empty.


def _cells(error: dict[str, float] | None) -> list[str]:
    return [f"{error[name]:.6g}" if error else "" for name in ("mean", "median", "p95")]


CURVE_HEAD = [
    "filter", "count", "touches", "accuracy", "accuracy_low", "accuracy_high", "mean_confidence",
    "located", "error_mean_mm", "error_median_mm", "error_p95_mm", "refined_mean_mm",
    "refined_median_mm", "refined_p95_mm",
]  # fmt: skip


def _curve_rows(runs: Sequence[Json], first: Sequence[object] = ()) -> list[list[object]]:
    shares = ("accuracy", "accuracy_low", "accuracy_high", "mean_confidence")
    return [
        [*first, run["filter"], run["count"], point["touches"], *(f"{point[s]:.6g}" for s in shares),
         point["located"], *_cells(point["error_mm"]), *_cells(point["refined_error_mm"])]
        for run in runs
        for point in run["curve"]
    ]  # fmt: skip


def _trial_rows(runs: Sequence[FilterRun]) -> list[list[object]]:
    def text(value: float | None) -> str:
        return "" if value is None else f"{value:.6g}"

    return [
        [run.filter, run.count, trial, run.labels[trial], touch, int(step["right"]),
         text(confidence(step)), text(step.get("error_mm")), text(step.get("refined_error_mm"))]
        for run in runs
        for trial, steps in enumerate(run.steps)
        for touch, step in enumerate(steps, start=1)
    ]  # fmt: skip


def write_tables(folder: str, document: Json, runs: Sequence[FilterRun]) -> None:
    """Writes TABLES, the last with a line for every touch of every trial."""
    noisy = [
        row
        for noise in document["pose_noise"]
        for row in _curve_rows(
            noise["filters"], (f"{noise['translation_mm']:g}", noise["rotation_rad"])
        )
    ]
    calibrations = [
        [run["filter"], run["count"], f"{part['lower']:.1f}", part["count"],
         f"{part['mean_confidence']:.6g}", f"{part['fraction_right']:.6g}"]
        for run in document["filters"]
        for part in run["calibration"]["bins"]
    ]  # fmt: skip
    calibration_head = "filter,count,confidence_from,estimates,mean_confidence,fraction_right"
    trial_head = "filter,count,trial,object,touches,right,confidence,error_mm,refined_error_mm"
    tables: list[tuple[list[str], list[list[object]]]] = [
        (CURVE_HEAD, _curve_rows(document["filters"])),
        (calibration_head.split(","), calibrations),
        (["noise_mm", "noise_rad", *CURVE_HEAD], noisy),
        (trial_head.split(","), _trial_rows(runs)),
    ]
    for name, (head, rows) in zip(TABLES, tables, strict=True):
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([head, *rows])
        write(pathlib.Path(folder, name), text.getvalue())


# Figures.

MEAN_ERROR = "mean pose error of trials with the right letter (mm)"


def draw(document: Json) -> dict[str, Figure]:
    """Fig. 6a, 6b, 7a and 7b with the paper's headline numbers, and what goes beyond the paper."""
    runs: dict[str, list[Json]] = {}
    for run in document["filters"]:
        runs.setdefault(run["filter"], []).append(run)

    def start(y: str, title: str = "", log: str = "") -> tuple[Figure, Any]:
        return charts.chart("touches", y, title=title, log=log)

    def curve(axes: Any, run: Json, path: str, label: str, **look: Any) -> None:
        # A mark at every fifth touch, so that the dashes show between.
        charts.line(axes, run["curve"], "touches", path, label=label, markevery=5, **look)

    def accuracy(kind: str) -> tuple[Figure, Any]:
        figure, axes = start("trials with the right letter, and 95 % interval (%)")
        charts.percent(axes)
        for i, run in enumerate(runs[kind]):
            curve(axes, run, "accuracy", run["name"], scale=100.0, band=True,
                  interval=("accuracy_low", "accuracy_high"), **charts.like(i))  # fmt: skip
        return figure, axes

    def errors(kind: str) -> tuple[Figure, Any]:
        figure, axes = start(MEAN_ERROR)
        for i, run in enumerate(runs[kind]):
            curve(axes, run, "error_mm/mean", run["name"], **charts.like(i))
        axes.set_ylim(bottom=0.0)
        return figure, axes

    fig6a, axes_6a = accuracy("particles")
    charts.rule(axes_6a, PUBLISHED_PARTICLE_ACCURACY, "paper: 10,000 particles level out")
    fig6b, axes_6b = errors("particles")
    fig7a, axes_7a = accuracy("histogram")
    for mark, (count, touches) in zip("PD", PUBLISHED_BINS_KNOW_AFTER.items(), strict=True):
        axes_7a.plot(touches, 100.0, mark, color=charts.GREY, label=f"paper: {count:,} bins reach 100 %",
                     markersize=8, **charts.EDGE)  # fmt: skip
    fig7b, axes_7b = errors("histogram")
    charts.rule(axes_7b, PUBLISHED_ERROR_MM, "paper: 1.3 mm")

    augmented, axes_augmented = start("trials with the right letter (%)")
    charts.percent(axes_augmented)
    for kind, dash in (("particles", "-"), ("augmented", "--")):
        for i, run in enumerate(runs[kind]):
            look = charts.like(i) | {"linestyle": dash}
            curve(axes_augmented, run, "accuracy", run["name"], scale=100.0, **look)

    most = max(run["count"] for run in runs["histogram"])
    finest = next(run for run in runs["histogram"] if run["count"] == most)
    of_finest, axes_finest = start(
        "pose error of trials with the right letter (mm)", finest["name"], log="y"
    )
    for i, (label, path) in enumerate(
        (
            ("mode, mean", "error_mm/mean"),
            ("mode, 95th percentile", "error_mm/p95"),
            ("mode, median", "error_mm/median"),
            ("refined, 95th percentile", "refined_error_mm/p95"),
            ("refined, mean", "refined_error_mm/mean"),
        )
    ):
        curve(axes_finest, finest, path, label, **charts.like(i))

    refined, axes_refined = start(MEAN_ERROR, log="y")
    largest = [run for run in runs["histogram"] if as_many(run["count"], most)]
    for i, run in enumerate(largest):
        for j, (kind, path) in enumerate(
            (("mode", "error_mm/mean"), ("refined", "refined_error_mm/mean"))
        ):
            curve(axes_refined, run, path, f"{run['name']}, {kind}", **charts.like(2 * i + j))

    all_axes = [axes_6a, axes_6b, axes_7a, axes_7b, axes_augmented, axes_finest, axes_refined]
    noise, axes_noise = _draw_noise(document, most, start, curve)
    calibrated, axes_calibrated = _draw_calibration(runs)
    for axes in all_axes:
        axes.set_xlim(left=0.0)
    for axes in [*all_axes, axes_noise, axes_calibrated]:
        charts.legend(axes)
    figures = (fig6a, fig6b, fig7a, fig7b, augmented, of_finest, refined, noise, calibrated)
    return dict(zip(FIGURES, figures, strict=True))


def _draw_noise(document: Json, most: int, start: Any, curve: Any) -> tuple[Figure, Any]:
    """Colours tell the noise apart, dashes the filters, each with its largest count."""
    title = "standard deviation of the error of the reported sensor pose"
    figure, axes = start(MEAN_ERROR, title, log="y")
    exact = {"translation_mm": 0.0, "rotation_rad": 0.0, "filters": document["filters"]}
    for kind, count, look in (
        ("histogram", most, {"marker": "o", "linestyle": "-", **charts.EDGE}),
        ("particles", MOST_PARTICLES, {"marker": "s", "linestyle": "--", **charts.HOLLOW}),
    ):
        for colour, level in zip(charts.COLOURS, [exact, *document["pose_noise"]], strict=False):
            for run in level["filters"]:
                if run["filter"] == kind and run["count"] == count:
                    off = f"{level['translation_mm']:g} mm, {level['rotation_rad']:g} rad"
                    curve(axes, run, "error_mm/mean", f"{run['name']}, {off}", color=colour, **look)
    axes.set_xlim(0.0, len(document["pose_noise"][0]["filters"][0]["curve"]) + 0.5)
    return figure, axes


def _draw_calibration(runs: dict[str, list[Json]]) -> tuple[Figure, Any]:
    fewest = 10  # estimates of which a fraction says something
    figure, axes = charts.chart(
        "confidence: probability of the most probable letter (%)",
        "estimates that are right (%)",
        title=f"expected calibration error in brackets; at least {fewest} estimates per point",
    )
    axes.plot([0, 100], [0, 100], ":", color=charts.GREY, label="perfectly calibrated")
    # All particle filters would hide more than they show.
    for i, run in enumerate([*runs["histogram"], runs["particles"][-1]]):
        bins = [part for part in run["calibration"]["bins"] if part["count"] >= fewest]
        axes.plot(
            [100.0 * part["mean_confidence"] for part in bins],
            [100.0 * part["fraction_right"] for part in bins],
            label=f"{run['name']} ({100.0 * run['calibration']['expected_error']:.1f} %)",
            **charts.like(i),
        )
    charts.percent(axes, "x", 100.0)
    charts.percent(axes)
    return figure, axes
