"""Sec. IV of the paper on simulated letters: histogram and particle filters over touches."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from palpate._statistics import mean

from . import charts
from .experiment_files import (
    FIGURES,
    MOST_PARTICLES,
    PUBLISHED_BINS_KNOW_AFTER,
    PUBLISHED_ERROR_MM,
    TABLES,
    draw,
    write_tables,
)
from .filter_run import FilterRun, equal_counts, run_histogram, run_particles
from .measures import mean_interval
from .report import Json, Measurement, Report, Run, at_least_1, main, parser, write_json
from .trials import TABLE_1, VOWELS, Bins, Touching, letter_maps, make_trials

SEED = 1_000
#: Nearly as many, balanced so that a turn by a bin moves a letter as far as a shift by one.
BALANCED: Bins = (13, 13, 55)


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
                [
                    b["error_mm"] - a["error_mm"]
                    for a, b in pairs
                    if None not in (a["error_mm"], b["error_mm"])
                ],
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


def holds_from(
    name: str, curve: Sequence[Json], holds: Callable[[Json], bool]
) -> list[Measurement]:
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
        name = (
            f"{histogram.name}: error less than of {particles.name}, where both locate, at the end"
        )
        rows += compare(histogram, particles)[-1].lead(name)
    facts = {"trials": len(runs[0].steps), "touches": runs[0].touches}
    report.add(f"array off by {noise[0]:g} mm, {noise[1]:g} rad", facts, rows)


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
    flags.add_argument(
        "--trials", type=at_least_1, help="trials per letter [10, or 4 with --quick]"
    )
    flags.add_argument(
        "--touches", type=at_least_1, help="touches per trial, at most 192 [50, or 12 with --quick]"
    )
    flags.add_argument("--csv", metavar="FOLDER", help="write tables to this folder")
    options = flags.parse_args()
    measure(Run(options, {"csv": TABLES, "plots": charts.files(FIGURES)}), options)


if __name__ == "__main__":
    main(program)
