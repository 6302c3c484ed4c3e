"""Sec. IV of the paper on simulated letters: histogram and particle filters over touches."""

import argparse
import csv
import io
import pathlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from matplotlib.figure import Figure

import palpate
from palpate._statistics import errors_over, mean

from . import charts
from .measures import calibration, mean_interval, wilson_interval
from .report import Json, Measurement, Report, Run, at_least_1, main, parser, write, write_json
from .trials import VOWELS, Touching, letter_maps, make_trials

SEED = 1_000
PARTICLE_SEED = 1
MOST_PARTICLES = 10_000
Bins = tuple[int, int, int]
#: 100, 1,000 and 10,000 bins per object.
TABLE_1: tuple[Bins, ...] = ((5, 5, 4), (10, 10, 10), (25, 25, 16))
#: Nearly as many, balanced so that a turn by a bin moves a letter as far as a shift by one.
BALANCED: Bins = (13, 13, 55)

# What the paper reports of letters that it touched with a real sensor.
PUBLISHED_BINS_KNOW_AFTER = {1_000: 46, 10_000: 9}  # touches to an accuracy of 100 %
PUBLISHED_ERROR_MM = 1.3  # mean, of the histogram
PUBLISHED_PARTICLE_ACCURACY = 74.0  # %, where 10,000 particles level out

FIGURES = (
    "fig6a", "fig6b", "fig7a", "fig7b", "augmented", "errors", "refined", "pose_noise", "calibration",
)  # fmt: skip
TABLES = ("curves.csv", "calibration.csv", "pose_noise.csv", "trials.csv")
REGION: dict[str, Any] = {"x_mm": (-10, 10), "y_mm": (-10, 10), "pivot_mm": (0, 0)}

Step = dict[str, Any]


@dataclass(frozen=True)
class FilterRun:
    """What one filter made of all trials."""

    filter: str  #: "histogram", "particles" or "augmented"
    name: str  #: with its size, such as "histogram 25x25x16"
    count: int  #: bins per object, or particles in all
    steps: list[list[Step]]  #: [trial][touch] records as of `palpate recognize --trace`
    labels: list[str]  #: [trial] the true objects
    seconds: float  #: of all trials

    def after(self, touch: int) -> list[Step]:
        """[trial] What the filter says after `touch` touches."""
        return [steps[touch - 1] for steps in self.steps]

    @property
    def touches(self) -> int:
        """Touches of every trial."""
        return len(self.steps[0])

    def curve(self) -> list[Json]:
        """After 1, 2, ... touches: accuracy, confidence, and errors of modes and refined poses."""
        curve = []
        for touch in range(1, self.touches + 1):
            steps = self.after(touch)
            right = sum(step["right"] for step in steps)
            low, high = wilson_interval(right, len(steps))
            errors = errors_over([step.get("error_mm") for step in steps])
            refined = errors_over([step.get("refined_error_mm") for step in steps])
            curve.append(
                {
                    "touches": touch,
                    "accuracy": right / len(steps),
                    "accuracy_low": low,
                    "accuracy_high": high,
                    "mean_confidence": mean([confidence(step) for step in steps]),
                    "located": errors["trials"] if errors else 0,
                    "error_mm": errors,
                    "refined_error_mm": refined,
                }
            )
        return curve

    def calibration(self) -> dict[str, Any]:
        """Over all trials and touches; see measures.calibration()."""
        steps = [step for steps in self.steps for step in steps]
        return calibration([confidence(step) for step in steps], [step["right"] for step in steps])

    def record(self) -> Json:
        """The run as it stands in the document."""
        return {
            "filter": self.filter,
            "name": self.name,
            "count": self.count,
            "seconds": self.seconds,
            "curve": self.curve(),
            "calibration": self.calibration(),
        }


def confidence(step: Step) -> float:
    """Probability of the most probable object."""
    return float(step["identity"][step["best"]])


def run_histogram(
    device: palpate.Device,
    maps: Sequence[palpate.OccupancyGrid],
    bins: Bins,
    trials: Sequence[palpate.Recording],
) -> FilterRun:
    """The histogram filter over the trials, with a step after every touch."""
    start = time.perf_counter()
    records = palpate.recognize(
        trials, maps, bins=bins, filter="histogram", trace=True, device=device, **REGION
    )
    name = "histogram " + "x".join(map(str, bins))
    return _run("histogram", name, bins[0] * bins[1] * bins[2], records, trials, start)


def run_particles(
    device: palpate.Device,
    maps: Sequence[palpate.OccupancyGrid],
    count: int,
    trials: Sequence[palpate.Recording],
    *,
    augmented: bool = False,
    resampling: Literal["multinomial", "systematic"] = "multinomial",
) -> FilterRun:
    """The particle filter over the trials; each trial has a seed of its own."""
    start = time.perf_counter()
    records = [
        palpate.recognize(
            trial, maps, filter="particles", particles=count, seed=PARTICLE_SEED + i,
            augmented=augmented, resampling=resampling, trace=True, device=device, **REGION,
        )[0]
        for i, trial in enumerate(trials)
    ]  # fmt: skip
    kind = "augmented" if augmented else "systematic" if resampling == "systematic" else "particles"
    name = f"{'augmented MCL' if augmented else kind} {count}"
    return _run(kind, name, count, records, trials, start)


def _run(
    kind: str,
    name: str,
    count: int,
    records: Sequence[palpate.Record],
    trials: Sequence[palpate.Recording],
    start: float,
) -> FilterRun:
    labels = [trial.truth.object for trial in trials if trial.truth]
    seconds = time.perf_counter() - start
    return FilterRun(kind, name, count, [record["trace"] for record in records], labels, seconds)


def as_many(a: int, b: int) -> bool:
    """Whether two counts agree within a tenth.

    Whole numbers of balanced bins along each axis rarely multiply to a given count.
    """
    return 10 * abs(a - b) <= max(a, b)


def equal_counts(runs: Sequence[FilterRun]) -> list[tuple[FilterRun, FilterRun]]:
    """All pairs of a histogram and a particle filter with as many particles as bins per object."""
    return [
        (histogram, particles)
        for particles in runs
        for histogram in runs
        if particles.filter != "histogram" and histogram.filter == "histogram"
        if as_many(histogram.count, particles.count)
    ]


@dataclass(frozen=True)
class PairedPoint:
    """One filter against another over the same trials, after some number of touches."""

    touches: int
    right_lead: int  #: trials that the first has right, minus those of the second
    #: Second minus first error of the trials that both locate: errors over its own trials would
    #: flatter the filter that loses the hard ones.
    leads_mm: list[float]

    def lead(self, name: str) -> list[Measurement]:
        """The mean lead in error; nothing where both locate no trial."""
        if not self.leads_mm:
            return []
        interval = mean_interval(self.leads_mm) if len(self.leads_mm) > 2 else None
        return [Measurement(name, mean(self.leads_mm), "mm", interval=interval)]


def compare(first: FilterRun, second: FilterRun) -> list[PairedPoint]:
    """After 1, 2, ... touches."""
    points = []
    for touch in range(1, first.touches + 1):
        pairs = list(zip(first.after(touch), second.after(touch), strict=True))
        points.append(
            PairedPoint(
                touch,
                sum(a["right"] - b["right"] for a, b in pairs),
                [b["error_mm"] - a["error_mm"] for a, b in pairs if None not in (a["error_mm"], b["error_mm"])],
            )
        )
    return points


def ranges_of(touches: Sequence[int]) -> str:
    """Rising touch counts, such as "1-4, 8"."""
    texts: list[str] = []
    begin = None
    for here, after in zip(touches, [*touches[1:], None], strict=True):
        begin = here if begin is None else begin
        if after != here + 1:
            texts.append(str(here) if begin == here else f"{begin}-{here}")
            begin = None
    return ", ".join(texts)


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


def holds_from(name: str, curve: Sequence[Json], holds: Callable[[Json], bool]) -> list[Measurement]:
    """The number of touches from which something holds to the end, where there is one."""
    touches = len(curve) + 1
    while touches > 1 and holds(curve[touches - 2]):
        touches -= 1
    return [Measurement(name, touches, "touches on")] if touches <= len(curve) else []


def add_run(report: Report, run: FilterRun) -> None:
    """What a run reached beside what the paper reports of its filter."""
    curve = run.curve()
    last = curve[-1]
    rows = [accuracy_of("accuracy at the end", last)]
    rows += holds_from("right in every trial from", curve, lambda point: point["accuracy"] == 1.0)
    known_after = PUBLISHED_BINS_KNOW_AFTER.get(run.count, 0) if run.filter == "histogram" else 0
    if 0 < known_after <= run.touches:
        least = min(curve[known_after - 1 :], key=lambda point: float(point["accuracy"]))
        rows.append(accuracy_of(f"least accuracy from touch {known_after} on", least, 100.0))
    if error := last["error_mm"]:
        most = PUBLISHED_ERROR_MM if run.filter == "histogram" and run.count == 10_000 else None
        rows.append(Measurement("mean error at the end", error["mean"], "mm", most))
        rows.append(Measurement("median error at the end", error["median"], "mm"))
        rows.append(Measurement("95th percentile of the error at the end", error["p95"], "mm"))
    if refined := last["refined_error_mm"]:
        rows.append(Measurement("mean error at the end, refined", refined["mean"], "mm"))
        rows.append(Measurement("95th percentile at the end, refined", refined["p95"], "mm"))
        rows += holds_from(
            "refined poses err less than modes from",
            curve,
            lambda point: bool(
                point["refined_error_mm"]
                and point["refined_error_mm"]["mean"] < point["error_mm"]["mean"]
            ),
        )
    expected = 100.0 * run.calibration()["expected_error"]
    rows.append(Measurement("expected calibration error", expected, "%"))
    facts = {"trials": len(run.steps), "touches": run.touches, "seconds": round(run.seconds, 1)}
    report.add(run.name, facts, rows)


def add_comparison(report: Report, histogram: FilterRun, particles: FilterRun) -> None:
    """A histogram against particles over the same trials, over all touches and at the end."""
    points = compare(histogram, particles)
    trials = len(histogram.steps)
    located = [(point.touches, mean(point.leads_mm)) for point in points if point.leads_mm]
    right = [(point.touches, point.right_lead) for point in points]
    ahead = 100.0 * sum(lead for _, lead in right) / trials / len(points)
    rows = [
        Measurement("accuracy ahead, mean over touches", ahead, "% points"),
        Measurement("accuracy ahead at the end", 100.0 * right[-1][1] / trials, "% points"),
    ]
    if located:
        over = mean([lead for _, lead in located])
        rows.append(Measurement("error less where both locate, over touches", over, "mm"))
    rows += points[-1].lead("error less where both locate, at the end")
    facts = {
        "equal count": f"{histogram.count} bins for every object; {particles.count} particles over all",
        "identity": standing(right),
        "pose, where both locate": standing(located),
    }
    report.add(f"{histogram.name} against {particles.name}", facts, rows)


def add_noise(report: Report, noise: tuple[float, float], runs: Sequence[FilterRun]) -> None:
    """Filters over trials in which the array is not quite where the robot reports it."""
    rows = []
    for run in runs:
        last = run.curve()[-1]
        rows.append(accuracy_of(f"{run.name}: accuracy at the end", last))
        if last["error_mm"]:
            error_mm = last["error_mm"]["mean"]
            rows.append(Measurement(f"{run.name}: mean error at the end", error_mm, "mm"))
    for histogram, particles in equal_counts(runs):
        name = f"{histogram.name}: error less than of {particles.name}, where both locate, at the end"
        rows += compare(histogram, particles)[-1].lead(name)
    facts = {"trials": len(runs[0].steps), "touches": runs[0].touches}
    report.add(f"array off by {noise[0]:g} mm, {noise[1]:g} rad", facts, rows)


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
        for row in _curve_rows(noise["filters"], (f"{noise['translation_mm']:g}", noise["rotation_rad"]))
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


def measure(run: Run, options: argparse.Namespace) -> None:
    """Runs all filters, prints their cases, and writes what the options name."""
    trials_each = options.trials or (4 if options.quick else 10)
    touches = options.touches or (12 if options.quick else 50)
    trials = make_trials(VOWELS, trials_each, touches, SEED)
    maps = letter_maps(run.device)
    report = Report(run.facts)
    runs: list[FilterRun] = []
    for bins in (*TABLE_1, BALANCED):
        runs.append(run_histogram(run.device, maps, bins, trials))
        add_run(report, runs[-1])
    for augmented in (False, True):
        for count in (100, 1_000, MOST_PARTICLES):
            if not options.quick or count > 100:
                runs.append(run_particles(run.device, maps, count, trials, augmented=augmented))
                add_run(report, runs[-1])
    for pair in equal_counts(runs):
        add_comparison(report, *pair)
    levels = []
    for noise in ((1.0, 0.05), (2.0, 0.1)):
        noisy = make_trials(VOWELS, trials_each, min(touches, 20), SEED, Touching(noise=noise))
        of_level = [run_histogram(run.device, maps, bins, noisy) for bins in TABLE_1[1:]]
        of_level.append(run_particles(run.device, maps, MOST_PARTICLES, noisy))
        add_noise(report, noise, of_level)
        levels.append(
            {
                "translation_mm": noise[0],
                "rotation_rad": noise[1],
                "filters": [one.record() for one in of_level],
            }
        )
    document = report.document() | {"filters": [one.record() for one in runs], "pose_noise": levels}
    write_json(options.json, document)
    if options.csv:
        write_tables(options.csv, document, runs)
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
    )
    flags.add_argument("--trials", type=at_least_1, help="trials per letter [10, or 4 with --quick]")
    flags.add_argument(
        "--touches", type=at_least_1, help="touches per trial, at most 192 [50, or 12 with --quick]"
    )
    flags.add_argument("--csv", metavar="FOLDER", help="write tables to this folder")
    options = flags.parse_args()
    measure(Run(options, {"csv": TABLES, "plots": charts.files(FIGURES)}), options)


if __name__ == "__main__":
    main(program)
