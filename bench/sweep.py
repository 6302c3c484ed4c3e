"""Speed against error on simulated letters: every filter, bin counts, map cells, and their limits."""

import argparse
import json
import math
import os
import pathlib
import subprocess
import tempfile
import time
from collections.abc import Sequence

import palpate
from palpate._tables import count_text, plain

from . import charts
from .measures import Paired, knee_of, pareto_front
from .report import Json, Measurement, Run, at_least_1, main, parser, write, write_json
from .sweep_limits import measure_limits
from .sweep_page import CHARTS, charts_of, page_of
from .sweep_plan import AUTO_RULE, GOAL_BINS, GOAL_CELL_MM, TOUCHES, Plan, product
from .sweep_runs import measure_bounds, measure_histogram, measure_particles
from .sweep_tables import print_document, print_point, print_point_head
from .trials import Bins, lattice_of, letter_maps

GOALS_MM = {
    "error_mm": ("mean error by the mode", 0.3),
    "refined_error_mm": ("mean error refined", 0.2),
}


def auto_rule_of(bounds: Sequence[Json]) -> Json:
    """From how many bins on the bounded posterior is faster than the histogram, beside the rule.

    None where one of the two is faster on every lattice; else by straight lines between the logarithms
    of bins and times.
    """

    def excess(record: Json, asked: str) -> float:
        return math.log(record["bounded"][asked] / record["histogram"][asked])

    def crossing(asked: str) -> tuple[float | None, str]:
        first = len(bounds)
        while first > 0 and excess(bounds[first - 1], asked) < 0.0:
            first -= 1
        if first in (0, len(bounds)):
            return None, "on all of these lattices" if first == 0 else "on none of these lattices"
        above, below = excess(bounds[first - 1], asked), excess(bounds[first], asked)
        lower, upper = (math.log(bounds[i]["bins_in_all"]) for i in (first - 1, first))
        at = math.exp(lower + above / (above - below) * (upper - lower))
        return at, f"from {count_text(at)} bins in all on"

    (once, once_text), (each, each_text) = crossing("once"), crossing("each_touch")
    return {
        "once": once,
        "each_touch": each,
        "rule": AUTO_RULE,
        "sentence": f"The bounded posterior answers sooner than the histogram {once_text} where it is "
        f"asked once, and {each_text} where it is asked after each of {TOUCHES} touches; --filter auto "
        f"takes it above {count_text(AUTO_RULE)} bins in all.",
    }


def knee_record(points: Sequence[Json], cell_mm: float, fine: Bins) -> Json:
    """Where more bins stop helping on maps of one cell size.

    The fewest bins that suffice, the error on the finest lattice, the lattice that --bins fine takes,
    and what more bins gain from step to step: to each run from the finest of at most a fifth of its
    bins, over the trials that both locate.
    """
    runs = [point for point in points if point["balanced"] and point["cell_mm"] == cell_mm]
    knees = {}
    for name in ("errors_mm", "refined_errors_mm"):
        knee = knee_of([run[name] for run in runs])
        knees[name] = None if knee is None else runs[knee]["count"]

    def text(count: int | None) -> str:
        return f"at least {count_text(runs[-1]['count'])}" if count is None else count_text(count)

    steps = []
    for to in runs:
        coarser = [run for run in runs if 5 * run["count"] <= to["count"]]
        if coarser:
            step: Json = {"cell_mm": cell_mm, "from": coarser[-1]["count"], "to": to["count"]}
            for name in ("error", "refined_error"):
                paired = Paired.of(to[f"{name}s_mm"], coarser[-1][f"{name}s_mm"])
                step.setdefault("trials", paired.trials)
                step[f"{name}_mm"] = {
                    "from": paired.second_mm,
                    "to": paired.first_mm,
                } | paired.difference()
            steps.append(step)
    return {
        "cell_mm": cell_mm,
        "balanced_bins": list(fine),
        "balanced_count": product(fine),
        "mode_knee": knees["errors_mm"],
        "refined_knee": knees["refined_errors_mm"],
        "floor_mm": runs[-1]["refined_error_mm"],
        "sentence": f"Maps with cells of {cell_mm:g} mm need {text(knees['errors_mm'])} bins for the mode "
        f"and {text(knees['refined_errors_mm'])} for the refined pose; --bins fine takes {plain(fine)} = "
        f"{count_text(product(fine))}.",
        "steps": steps,
    }


def compare_paths(options: argparse.Namespace) -> list[Json]:
    """The ways to evaluate the likelihood, which `palpate-bench paths` times in C++."""
    program = os.environ.get("PALPATE_BENCH", "build/palpate-bench")
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "paths.json")
        flags = ["--quick"] if options.quick else []
        flags += ["--device", options.device] if options.device else []
        subprocess.run(
            [program, "paths", "--json", file, *flags], check=True, stdout=subprocess.DEVNULL
        )
        paths: list[Json] = json.loads(file.read_text())["precisions"]
        return paths


def fronts_of(document: Json) -> Json:
    """The Pareto fronts of time and error: of poses, and of the likelihood's evaluations.

    The poses are of runs that recognise and locate all trials, as errors over some would flatter.
    """
    poses = []
    for point in document["points"]:
        for pose, name, more_s in (
            ("mode", "error_mm", 0.0),
            ("refined", "refined_error_mm", point["seconds_refine"]),
        ):
            error = point[name]
            if error and point["accuracy"] == 1.0 and error["trials"] == document["trials"]:
                same = {
                    key: point[key]
                    for key in ("filter", "cell_mm", "count", "full_trials", "accuracy")
                }
                costs = {"cost": point["seconds_per_unknown"] + more_s, "error": error["mean"]}
                poses.append(
                    {"pose": pose, "standard_error": error["standard_error"]} | same | costs
                )
    paths = [
        {"path": path["path"], "count": path["count"], "cost": path["nanoseconds"],
         "error": path["deviation_nats"]["largest"]}
        for path in document["precisions"]
    ]  # fmt: skip

    def front(entries: list[Json]) -> list[Json]:
        return [entries[i] for i in pareto_front([(e["cost"], e["error"]) for e in entries])]

    return {
        "seconds per unknown, mean error in mm": front(poses),
        "ns per pose, element and touch, largest deviation in nats": front(paths),
    }


def window_sentence(points: Sequence[Json]) -> str:
    """How well windows agree with the full posterior."""
    windows = [point["windows"] for point in points if point["windows"]]
    trials = sum(of["compared_trials"] for of in windows)
    mode_mm = max((of["mode_difference_mm"] for of in windows), default=0.0)
    refined_mm = max((of["refined_difference_mm"] for of in windows), default=0.0)
    return (
        f"Of {trials} trials with the full posterior on the same lattices, modes lie within "
        f"{mode_mm:.1e} mm of the windows', and refined poses within {refined_mm:.1e} mm."
    )


def verdicts_of(points: Sequence[Json]) -> list[Json]:
    """The mean errors on the goal's lattice against their goals."""
    size = " x ".join(map(str, GOAL_BINS))
    return [
        Measurement(
            f"{words}, {size} bins, {TOUCHES} touches, {point[name]['trials']} of {point['trials']} trials",
            point[name]["mean"],
            "mm",
            at_most=goal_mm,
        ).record()
        for point in points
        if point["bins"] == list(GOAL_BINS) and point["cell_mm"] == GOAL_CELL_MM
        for name, (words, goal_mm) in GOALS_MM.items()
        if point[name]
    ]


def measure(run: Run, options: argparse.Namespace) -> Json:
    """Runs everything, and prints every run of a filter once it is known."""
    plan, device = Plan.of(options), run.device
    points: list[Json] = []
    bounds: list[Json] = []
    knees: list[Json] = []
    trials = plan.trials(plan.trials_each)

    def add(point: Json) -> None:
        print_point(point)
        points.append(point)

    start = time.perf_counter()
    print_point_head()
    for cells in plan.cells:
        maps = letter_maps(device, cell_mm=cells.cell_mm)
        for bins in cells.lattices:
            full_each = plan.full_each(cells.cell_mm, bins)
            add(measure_histogram(device, maps, trials, full_each, bins))
        multinomial, systematic = palpate.Resampling.multinomial, palpate.Resampling.systematic
        for resampling, augmented in (
            (multinomial, False),
            (systematic, False),
            (multinomial, True),
        ):
            for particles in cells.particles:
                some = plan.trials(1) if particles > 300_000 else trials
                add(
                    measure_particles(
                        device,
                        maps,
                        some,
                        particles=particles,
                        resampling=resampling,
                        augmented=augmented,
                    )
                )
        for bins in cells.bounded:
            bounds.append(measure_bounds(device, maps, plan.trials(plan.bounded_each(bins)), bins))
        if cells.lattices:
            fine = palpate.balanced_lattice(lattice_of(*GOAL_BINS), maps, "fine")
            counts = (fine.x_mm.count, fine.y_mm.count, fine.theta_rad.count)
            knees.append(knee_record(points, cells.cell_mm, counts))
    document = run.facts | {
        "touches": TOUCHES,
        "trials": len(trials),
        "points": points,
        "windows": window_sentence(points),
        "precisions": compare_paths(options),
        "bounds": bounds,
        "auto_rule": auto_rule_of(bounds),
        "knees": knees,
        "limits": measure_limits(device, plan),
        "verdicts": verdicts_of(points),
    }
    document["fronts"] = fronts_of(document)
    return document | {"seconds in all": round(time.perf_counter() - start, 1)}


def at_least_1000(text: str) -> int:
    """A number of bins."""
    value = int(text)
    if value < 1_000:
        raise argparse.ArgumentTypeError(f"{value}: give 1000 or more")
    return value


def program() -> None:
    """Reads the flags and measures."""
    flags = parser(
        "sweep",
        "Measures speed against error on simulated letters, in some 20 minutes on two CPU cores: every "
        "filter, from 100 to 10,000,000 bins per object, on maps of several cell sizes. The same of "
        "your own objects: python -m palpate.sweep.",
        plots="draw the page's charts in this folder",
    )
    flags.add_argument(
        "--html", metavar="FILE", help="write the results as a page with charts and tables"
    )
    flags.add_argument(
        "--trials", type=at_least_1, help="trials per letter [10, or 4 with --quick]"
    )
    flags.add_argument("--max-bins", type=at_least_1000, metavar="N",
                       help="most bins per object [10000000, or 100000 with --quick]")  # fmt: skip
    options = flags.parse_args()
    document = measure(Run(options, {"plots": charts.files(CHARTS)}), options)
    print_document(document)
    write_json(options.json, document)
    figures = charts_of(document)
    if options.html:
        write(options.html, page_of(document, figures))
    charts.save({name: figure for name, (figure, _) in figures.items()}, options.plots)


if __name__ == "__main__":
    main(program)
