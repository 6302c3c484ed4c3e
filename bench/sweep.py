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
from palpate._sweep_runs import counts_of
from palpate._tables import count_text, plain, print_head, print_row

from . import charts
from .measures import differences, knee_of, pareto_front
from .report import Json, Measurement, Run, at_least, main, parser, write, write_json
from .sweep_limits import measure_limits
from .sweep_page import CHARTS, charts_of, page_of
from .sweep_runs import AUTO_RULE, first_each, measure_bounds, measure_histogram, measure_particles
from .sweep_tables import PRINTED, print_document
from .trials import TABLE_1, VOWELS, Bins, lattice_of, letter_maps, make_trials

SEED = 1_000  # the experiment's
TOUCHES = 15
#: The goal's lattice: balanced, about a million bins.
GOAL_BINS: Bins = (64, 64, 244)
GOAL_CELL_MM = 0.5
GOALS_MM = {
    "error_mm": ("mean error by the mode", 0.3),
    "refined_error_mm": ("mean error refined", 0.2),
}


def scaled(count: float) -> Bins:
    """A lattice of some number of bins in the proportions of the goal's."""
    factor = (count / math.prod(GOAL_BINS)) ** (1.0 / 3.0)
    x, y, theta = (max(1, math.floor(factor * n + 0.5)) for n in GOAL_BINS)
    return x, y, theta


def auto_rule_of(bounds: Sequence[Json]) -> Json:
    """From how many bins on the bounded posterior is faster than the histogram, beside the rule.

    None where one of the two is faster on every lattice; else by straight lines between the logarithms
    of bins and times.
    """

    def crossing(asked: str) -> tuple[float | None, str]:
        excess = [math.log(of["bounded"][asked] / of["histogram"][asked]) for of in bounds]
        first = len(bounds)
        while first > 0 and excess[first - 1] < 0.0:
            first -= 1
        if first in (0, len(bounds)):
            return None, "on all of these lattices" if first == 0 else "on none of these lattices"
        above, below = excess[first - 1], excess[first]
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
        for coarser in [run for run in runs if 5 * run["count"] <= to["count"]][-1:]:
            step: Json = {"cell_mm": cell_mm, "from": coarser["count"], "to": to["count"]}
            for name in ("error", "refined_error"):
                step[f"{name}_mm"] = differences(to[f"{name}s_mm"], coarser[f"{name}s_mm"])
            step["trials"] = step["error_mm"] and step["error_mm"]["trials"]
            steps.append(step)
    return {
        "cell_mm": cell_mm,
        "balanced_bins": list(fine),
        "balanced_count": math.prod(fine),
        "mode_knee": knees["errors_mm"],
        "refined_knee": knees["refined_errors_mm"],
        "floor_mm": runs[-1]["refined_error_mm"],
        "sentence": f"Maps with cells of {cell_mm:g} mm need {text(knees['errors_mm'])} bins for the mode "
        f"and {text(knees['refined_errors_mm'])} for the refined pose; --bins fine takes {plain(fine)} = "
        f"{count_text(math.prod(fine))}.",
        "steps": steps,
    }


def compare_paths(options: argparse.Namespace) -> list[Json]:
    """The ways to evaluate the likelihood, which `palpate-bench paths` times in C++."""
    program = os.environ.get("PALPATE_BENCH", "build/palpate-bench")
    flags = ["--quick"] if options.quick else []
    flags += ["--device", options.device] if options.device else []
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "paths.json")
        subprocess.run(
            [program, "paths", "--json", file, *flags], check=True, stdout=subprocess.DEVNULL
        )
        paths: list[Json] = json.loads(file.read_text())["precisions"]
        return paths


def fronts_of(document: Json) -> Json:
    """The Pareto fronts of time and error: of poses, and of the likelihood's evaluations.

    The poses are of runs that recognise and locate all trials, as errors over some would flatter.
    """
    poses = [
        {name: point[name] for name in ("filter", "cell_mm", "count", "full_trials", "accuracy")}
        | {
            "pose": pose,
            "standard_error": point[name]["standard_error"],
            "cost": point["seconds_per_unknown"] + (refine_s or 0.0),
            "error": point[name]["mean"],
        }
        for point in document["points"]
        for pose, name, refine_s in (
            ("mode", "error_mm", 0.0),
            ("refined", "refined_error_mm", point["seconds_refine"]),
        )
        if point[name] and point["accuracy"] == 1.0
        if point[name]["trials"] == document["trials"]
    ]
    paths = [
        {"path": path["path"], "count": path["count"], "cost": path["nanoseconds"]}
        | {"error": path["deviation_nats"]["largest"]}
        for path in document["precisions"]
    ]
    return {
        "seconds per unknown, mean error in mm": pareto_front(poses),
        "ns per pose, element and touch, largest deviation in nats": pareto_front(paths),
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
    start, quick, device = time.perf_counter(), options.quick, run.device
    trials = make_trials(VOWELS, options.trials or (4 if quick else 10), TOUCHES, SEED)
    # Counts are those nearest to what was asked for.
    most = 1.1 * (options.max_bins or (100_000 if quick else 10_000_000))

    def lattices(counts: Sequence[float], others: Sequence[Bins] = ()) -> list[Bins]:
        some = [bins for bins in (*map(scaled, counts), *others) if math.prod(bins) <= most]
        return sorted(some, key=math.prod)

    # What gets the full posterior: all trials of a letter, two of them, or one.
    most_full, most_twice = (50_000, 50_000) if quick else (320_000, 1_200_000)
    decades = [1e3, 1e4, 1e5] if quick else [1e2, 1e3, 1e4, 1e5, 1e6, 1e7]
    counts = [1e2, 1e3, 1e4, 1e5] if quick else [1e2, 1e3, 1e4, 3e4, 1e5, 3e5, 1e6, 3e6, 1e7]
    particles = [1_000, 10_000] if quick else [100, 1_000, 10_000, 100_000, 1_000_000]
    bounded = counts if quick else [1e3, 3e3, 1e4, 2e4, 3e4, 1e5, 1e6, 1e7]
    points: list[Json] = []
    bounds: list[Json] = []
    knees: list[Json] = []

    def add(point: Json) -> None:
        print_row(PRINTED, point)
        points.append(point)

    print_head(PRINTED)
    for cell_mm in (1.0, GOAL_CELL_MM) if quick else (1.0, GOAL_CELL_MM, 0.25):
        maps = letter_maps(device, cell_mm=cell_mm)
        goal = cell_mm == GOAL_CELL_MM
        of_cells = lattices(counts, TABLE_1) if goal else lattices(decades)
        for bins in of_cells:
            size = math.prod(bins)
            few = 2 if size <= most_twice else 1
            full = len(trials) if size <= most_full or (goal and bins == GOAL_BINS) else few
            add(measure_histogram(device, maps, trials, full, bins))
        for kind in ("particles", "systematic", "augmented") if goal else ():
            for count in particles:
                some = first_each(trials, 1) if count > 300_000 else trials
                add(measure_particles(device, maps, some, kind, count))
        for bins in lattices(bounded) if goal else ():
            some = first_each(trials, 1 if quick or math.prod(bins) > 1_200_000 else 4)
            bounds.append(measure_bounds(device, maps, some, bins))
        if of_cells:
            fine = palpate.balanced_lattice(lattice_of(*GOAL_BINS), maps, "fine")
            knees.append(knee_record(points, cell_mm, counts_of(fine)))
    limits = [scaled(1e5)] if quick else [GOAL_BINS, scaled(3e5), scaled(3e6)]
    each = min(len(trials) // len(VOWELS), 2 if quick else len(trials))
    document = run.facts | {
        "touches": TOUCHES,
        "trials": len(trials),
        "points": points,
        "windows": window_sentence(points),
        "precisions": compare_paths(options),
        "bounds": bounds,
        "auto_rule": auto_rule_of(bounds),
        "knees": knees,
        "limits": measure_limits(device, quick, limits, each, TOUCHES, SEED),
        "verdicts": verdicts_of(points),
    }
    document["fronts"] = fronts_of(document)
    return document | {"seconds in all": round(time.perf_counter() - start, 1)}


def program() -> None:
    """Reads the flags and measures."""
    flags = parser(
        "sweep",
        "Measures speed against error on simulated letters, in some 20 minutes on two CPU cores: every "
        "filter, from 100 to 10,000,000 bins per object, on maps of several cell sizes. The same of "
        "your own objects: python -m palpate.sweep.",
        plots="draw the page's charts in this folder",
        trials="trials per letter [10, or 4 with --quick]",
    )
    flags.add_argument(
        "--html", metavar="FILE", help="write the results as a page with charts and tables"
    )
    flags.add_argument(
        "--max-bins",
        type=at_least(1_000),
        metavar="N",
        help="most bins per object [10000000, or 100000 with --quick]",
    )
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
