"""Speed against error on simulated letters: every filter, bin counts, map cells, and their limits."""

import argparse
import json
import math
import os
import pathlib
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy

import palpate
from palpate.sweep import errors_record
from palpate._statistics import Errors, errors_over, mean, median
from palpate import reference

from .certificates import check_certificate, dense_posterior
from .measures import Paired, calibration, knee_of, pareto_front
from .report import Json, Measurement, Run, at_least_1, main, parser, write, write_json
from .sweep_page import CHARTS, charts_of, page_of, print_document, print_point_head, print_point
from palpate._tables import count_text, plain
from .trials import (
    EXACT,
    VOWELS,
    Floats,
    Step,
    Touching,
    judged,
    lattice_of,
    letter_maps,
    make_trials,
    training_recordings,
    truth_of,
)
from .windows import estimate_in_window, map_of, nearest_bin_mm, placed
from . import charts

Bins = tuple[int, int, int]
Maps = Sequence[palpate.OccupancyGrid]
Trials = Sequence[palpate.Recording]

#: The goal's lattice: balanced, about a million bins.
GOAL_BINS: Bins = (64, 64, 244)
GOAL_CELL_MM = 0.5
GOALS_MM = {"error_mm": ("mean error by the mode", 0.3), "refined_error_mm": ("mean error refined", 0.2)}
TABLE_1: tuple[Bins, ...] = ((5, 5, 4), (10, 10, 10), (25, 25, 16))
TOUCHES = 15
SEED = 1_000  # the experiment's
#: Bins of every object, or particles for each, whose log-likelihood is held against float64.
SAMPLED = 200
#: Bins of all objects above which --filter auto takes bounds.
AUTO_RULE = 100_000


def product(bins: Bins) -> int:
    """Bins per object."""
    return math.prod(bins)


def scaled(count: float) -> Bins:
    """A lattice of some number of bins in the proportions of the goal's."""
    factor = (count / product(GOAL_BINS)) ** (1.0 / 3.0)
    x, y, theta = (max(1, math.floor(factor * n + 0.5)) for n in GOAL_BINS)
    return x, y, theta


@dataclass(frozen=True)
class CellPlan:
    """What is run on maps of one cell size."""

    cell_mm: float
    lattices: list[Bins]
    particles: list[int] = field(default_factory=list)
    bounded: list[Bins] = field(default_factory=list)


@dataclass(frozen=True)
class Plan:
    """What is measured, in this order."""

    quick: bool
    trials_each: int  #: for every letter
    cells: list[CellPlan]
    limits: list[Bins]

    def full_each(self, cell_mm: float, bins: Bins) -> int:
        """Trials of every letter that get the full posterior: all of them on the goal's lattice."""
        most_full, most_twice = (50_000, 50_000) if self.quick else (320_000, 1_200_000)
        if product(bins) <= most_full or (bins, cell_mm) == (GOAL_BINS, GOAL_CELL_MM):
            return self.trials_each
        return min(self.trials_each, 2 if product(bins) <= most_twice else 1)

    def bounded_each(self, bins: Bins) -> int:
        """Trials of every letter for measure_bounds()."""
        return min(self.trials_each, 1 if self.quick or product(bins) > 1_200_000 else 4)

    def trials(self, each: int) -> list[palpate.Recording]:
        """The first trials of every letter."""
        return make_trials(VOWELS, each, TOUCHES, SEED)

    @staticmethod
    def of(options: argparse.Namespace) -> "Plan":
        """By the flags --quick, --trials and --max-bins."""
        quick = options.quick
        # Counts are those nearest to what was asked for.
        most = 1.1 * (options.max_bins or (100_000 if quick else 10_000_000))

        def lattices(counts: Sequence[float], others: Sequence[Bins] = ()) -> list[Bins]:
            some = [bins for bins in (*map(scaled, counts), *others) if product(bins) <= most]
            return sorted(some, key=product)

        decades = [10.0**power for power in range(2, 8)]
        if quick:
            cells = [
                CellPlan(1.0, lattices([1e3, 1e4, 1e5])),
                CellPlan(GOAL_CELL_MM, lattices([1e2, 1e3, 1e4, 1e5], TABLE_1), [1_000, 10_000],
                         lattices([1e2, 1e3, 1e4, 1e5])),
            ]  # fmt: skip
        else:
            counts = [1e2, 1e3, 1e4, 3e4, 1e5, 3e5, 1e6, 3e6, 1e7]
            cells = [
                CellPlan(1.0, lattices(decades)),
                CellPlan(GOAL_CELL_MM, lattices(counts, TABLE_1),
                         [100, 1_000, 10_000, 100_000, 1_000_000],
                         lattices([1e3, 3e3, 1e4, 2e4, 3e4, 1e5, 1e6, 1e7])),
                CellPlan(0.25, lattices(decades)),
            ]  # fmt: skip
        limits = [scaled(1e5)] if quick else [GOAL_BINS, scaled(3e5), scaled(3e6)]
        return Plan(quick, options.trials or (4 if quick else 10), cells, limits)


@dataclass
class Costs:
    """What a filter takes over some trials, and what it says."""

    touch_s: list[float] = field(default_factory=list)  #: from a touch to its estimate
    unknown_s: list[float] = field(default_factory=list)  #: of all touches, an estimate each
    refine_s: list[float] = field(default_factory=list)
    confidences: list[float] = field(default_factory=list)  #: over all touches
    right: list[bool] = field(default_factory=list)
    last: list[Json] = field(default_factory=list)  #: what is said of each trial in the end

    def run(self, belief: Any, maps: Maps, trial: palpate.Recording) -> None:
        """Asks a belief after each touch of one more trial."""
        truth = truth_of(trial)
        seconds = []
        for i in range(len(trial)):
            start = time.perf_counter()
            belief.update(trial[i])
            estimate = belief.estimate()
            seconds.append(time.perf_counter() - start)
            best = int(numpy.argmax(estimate.identity))
            self.confidences.append(float(estimate.identity[best]))
            self.right.append(maps[best].label == truth.object)
        self.touch_s += seconds
        self.unknown_s.append(sum(seconds))
        self.last.append({"mode": estimate.mode, "refined": None})
        if isinstance(belief, palpate.PoseHistogram):
            start = time.perf_counter()
            self.last[-1]["refined"] = belief.refine(estimate.mode)
            self.refine_s.append(time.perf_counter() - start)

    def record(self, kind: str, cell_mm: float, count: int, device_bytes: int) -> Json:
        """What a run cost, as medians, and how well it knows the objects."""
        ends = slice(TOUCHES - 1, None, TOUCHES)
        return {
            "filter": kind,
            "cell_mm": cell_mm,
            "count": count,
            "bins": None,
            "balanced": False,
            "full_trials": len(self.last),
            "seconds_per_touch": median(self.touch_s),
            "seconds_per_unknown": median(self.unknown_s),
            "seconds_refine": median(self.refine_s) if self.refine_s else None,
            "device_bytes": device_bytes,
            "accuracy": mean(self.right[ends]),
            "least_confidence": min(self.confidences[ends]),
            "expected_calibration_error": calibration(self.confidences, self.right)["expected_error"],
            "windows": None,
        }


def error_of(grid: palpate.OccupancyGrid, trial: palpate.Recording, pose: Any) -> float | None:
    """The pose error; None where the pose is of another object, or missing."""
    truth = truth_of(trial)
    if pose is None or grid.label != truth.object:
        return None
    return palpate.pose_error_mm(grid, pose.T_object_robot, truth.T_object_robot)


def set_errors(record: Json, modes_mm: Errors, refined_mm: Errors) -> None:
    """Puts pose errors into the record of a run: those of each trial, and what they are over all."""
    record["trials"] = len(modes_mm)
    for name, errors in (("error", modes_mm), ("refined_error", refined_mm)):
        record[f"{name}_mm"] = errors_record(errors)
        record[f"{name}s_mm"] = list(errors)


def deviation_record(deviations: Sequence[float]) -> Json:
    """How far log-likelihoods are from float64, in nats."""
    off = numpy.abs(deviations)
    return {
        "largest": float(off.max()),
        "rms": float(numpy.sqrt(numpy.mean(off**2))),
        "samples": len(off),
    }


def measure_histogram(
    device: palpate.Device, maps: Maps, trials: Trials, full_each: int, bins: Bins
) -> Json:
    """What the histogram costs and what it is worth over the first `full_each` trials of every letter.

    Where these are not all, the errors are those of all trials in windows.
    """
    lattice = lattice_of(*bins)
    belief = palpate.PoseHistogram(device, maps, lattice)
    each = len(trials) // len(maps)
    full = [trial for i, trial in enumerate(trials) if i % each < full_each]
    costs = Costs()
    for trial in full:
        belief.reset()
        costs.run(belief, maps, trial)
    record = costs.record("histogram", maps[0].cell_mm, lattice.bins, belief.device_bytes)
    record |= {"bins": list(bins), "balanced": bins not in TABLE_1}
    located = [maps[end["mode"].object] for end in costs.last]
    if full_each == each:
        errors = [
            [error_of(grid, trial, end[pose]) for grid, trial, end in zip(located, full, costs.last, strict=True)]
            for pose in ("mode", "refined")
        ]
    else:
        steps = [estimate_in_window(device, maps, trial, lattice) for trial in trials]
        errors = [[step.error_mm for step in steps], [step.refined_error_mm for step in steps]]
        record["windows"] = windows_record(maps, full, costs.last,
                                           [s for i, s in enumerate(steps) if i % each < full_each])  # fmt: skip
    set_errors(record, *errors)
    record["nearest_bin_mm"] = mean([nearest_bin_mm(lattice, placed(maps, trial)) for trial in trials])
    belief.reset()
    belief.update(trials[0][0])
    record["deviation_nats"] = deviation_record(bin_deviations(belief, maps, trials[0][0]))
    return record


def windows_record(maps: Maps, full: Trials, ends: Sequence[Json], steps: Sequence[Step]) -> Json:
    """How far apart the two poses of a trial lie at the most, by the full posterior and in a window."""
    apart: dict[str, list[float]] = {"mode": [], "refined": []}
    for trial, end, step in zip(full, ends, steps, strict=True):
        grid = map_of(maps, trial)
        if maps[end["mode"].object].label == grid.label:
            whole = palpate.OccupancyGrid(
                grid.label, grid.log_odds, cell_mm=grid.cell_mm, origin_mm=grid.origin_mm
            )  # without symmetry
            for pose, distances in apart.items():
                a, b = end[pose].T_object_robot, getattr(step, pose).T_object_robot
                distances.append(palpate.pose_error_mm(whole, a, b))
    return {
        "compared_trials": len(apart["mode"]),
        "mode_difference_mm": max(apart["mode"], default=0.0),
        "refined_difference_mm": max(apart["refined"], default=0.0),
    }


def bin_deviations(belief: palpate.PoseHistogram, maps: Maps, touch: palpate.Touch) -> list[float]:
    """The log-likelihood of some bins of every object beside the float64 reference, in nats."""
    contact = palpate.ContactModel(prior=maps[0].prior)
    random = numpy.random.default_rng(7)
    deviations = []
    for i, grid in enumerate(maps):
        logs = belief.log_likelihood(i).reshape(-1)
        for bin_ in random.integers(len(logs), size=SAMPLED).tolist():
            pose = belief.lattice.T_object_robot(bin_)
            deviations.append(
                float(logs[bin_]) - reference.log_likelihood(touch, pose, grid, contact)
            )
    return deviations


def measure_particles(device: palpate.Device, maps: Maps, trials: Trials, **options: Any) -> Json:
    """The same of the particle filter or Augmented MCL over all trials; trial i has the seed 1 + i.

    The deviation is that of the weights after one touch, which nothing has resampled yet. Weights are
    relative, so both sides are taken relative to the heaviest particle.
    """
    costs = Costs()
    most_bytes = 0
    for seed, trial in enumerate([*trials, trials[0]], start=1):
        belief = palpate.ParticleFilter(device, maps, lattice_of(1, 1, 1), seed=seed, **options)
        if seed <= len(trials):
            costs.run(belief, maps, trial)
            most_bytes = max(most_bytes, belief.device_bytes)
    augmented, systematic = options["augmented"], options["resampling"] == palpate.Resampling.systematic
    kind = "augmented" if augmented else "systematic" if systematic else "particles"
    record = costs.record(kind, maps[0].cell_mm, options["particles"], most_bytes)
    modes_mm = [
        error_of(maps[end["mode"].object], trial, end["mode"])
        for trial, end in zip(trials, costs.last, strict=True)
    ]
    set_errors(record, modes_mm, [None] * len(trials))
    record["nearest_bin_mm"] = None
    touch = trials[0][0]
    belief.update(touch)
    objects, poses, weights = belief.particles()
    contact = palpate.ContactModel(prior=maps[0].prior)

    def log_likelihood(i: int) -> float:
        return reference.log_likelihood(touch, poses[i], maps[objects[i]], contact)

    heaviest = int(numpy.argmax(weights))
    drawn = numpy.random.default_rng(7).integers(len(weights), size=SAMPLED * len(maps)).tolist()
    record["deviation_nats"] = deviation_record(
        [
            math.log(weights[i] / weights[heaviest]) - (log_likelihood(i) - log_likelihood(heaviest))
            for i in drawn
        ]
    )
    return record


def measure_bounds(device: palpate.Device, maps: Maps, trials: Trials, bins: Bins) -> Json:
    """Times the bounded posterior beside the histogram on one lattice, over all of the trials.

    They are asked once after all touches, and after every touch. Holds the certificates against the
    histogram's bins in float64, and says what --filter auto takes and whether it is the faster of the
    two where they are asked once.
    """
    lattice = lattice_of(*bins)
    bounded = palpate.BoundedPosterior(device, maps, lattice)
    histogram = palpate.PoseHistogram(device, maps, lattice)
    seconds: dict[str, dict[str, list[float]]] = {
        name: {"once": [], "each_touch": []} for name in ("histogram", "bounded")
    }

    def ask(belief: Any, parts: Sequence[palpate.Recording]) -> float:
        belief.reset()
        start = time.perf_counter()
        for part in parts:
            belief.update(part)
            belief.estimate()
        return time.perf_counter() - start

    checks, evaluated = [], []
    for belief in (bounded, histogram):
        ask(belief, [trials[0]])  # warms up
    for trial in trials:
        for name, belief in (("bounded", bounded), ("histogram", histogram)):
            one_by_one = [trial[i : i + 1] for i in range(len(trial))]
            seconds[name]["each_touch"].append(ask(belief, one_by_one))
            seconds[name]["once"].append(ask(belief, [trial]))
        checks.append(check_certificate(bounded, dense_posterior(histogram, maps, trial)))
        certificate = bounded.estimate().certificate
        assert certificate is not None
        evaluated.append(certificate.bins_evaluated)
    times = {name: {asked: median(of) for asked, of in both.items()} for name, both in seconds.items()}
    in_all = lattice.bins * len(maps)
    faster = times["bounded"]["once"] < times["histogram"]["once"]
    return {
        "cell_mm": maps[0].cell_mm,
        "count": lattice.bins,
        "bins": list(bins),
        "bins_in_all": in_all,
        "trials": len(trials),
        **times,
        "bins_evaluated": median(evaluated),
        "share_evaluated": median(evaluated) / in_all,
        "certificate": max(check.promised for check in checks),
        "measured_error": max(check.measured for check in checks),
        "certificates_hold": sum(check.holds for check in checks),
        "same_modes": sum(check.same_mode for check in checks),
        "host_bytes": bounded.host_bytes,
        "auto": "bounded" if in_all > AUTO_RULE else "histogram",
        "auto_is_faster": (in_all > AUTO_RULE) == faster,
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
                step[f"{name}_mm"] = {"from": paired.second_mm, "to": paired.first_mm} | paired.difference()
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


@dataclass(frozen=True)
class Variant:
    """What is changed. The sensor holds for training and trials alike."""

    name: str
    touching: Touching = EXACT
    cell_mm: float = 0.5
    spread_mm: float = 0.5
    more_training: bool = False
    all_lattices: bool = False


def variants_of(quick: bool) -> list[Variant]:
    """One thing at a time; the first changes nothing."""

    def sensor(**changed: float) -> Touching:
        return Touching(sensor=palpate.SensorModel(**changed))

    variants = [
        Variant("as it is", all_lattices=True),
        Variant("a sensor without noise", sensor(noise_kpa=0.0)),
    ]
    if quick:
        return variants
    sharp = sensor(psf_mm=0.25)
    return [
        *variants,
        Variant("equal gains and press forces", sensor(force_spread=0.0, gain_spread=0.0)),
        Variant("a point spread of 0.25 mm", sharp),
        Variant("a point spread of 0.25 mm, and maps of that spread and cells", sharp, 0.25, 0.125),
        Variant("maps of 0.25 mm cells", cell_mm=0.25),
        Variant("8 times the training touches", more_training=True),
        Variant("touches at random poses", Touching(at_random_poses=True)),
        Variant("touches displaced by 1 mm and 0.05 rad", Touching(noise=(1.0, 0.05))),
        Variant("an array of 16 x 16", Touching(palpate.grid_array(16, 16, 1.9)), all_lattices=True),
        Variant(
            "a sparse array of 3 x 3, twice the pitch",
            Touching(palpate.grid_array(3, 3, 3.8)),
            all_lattices=True,
        ),
    ]


def measure_limits(device: palpate.Device, plan: Plan) -> list[Json]:
    """Where the errors come from that more bins do not mend, in windows.

    Every variant is compared with the first on the first of the plan's lattices; arrays also run on
    the others, each compared with the same array on the first.
    """
    each = min(plan.trials_each, 2) if plan.quick else plan.trials_each
    limits: list[Json] = []
    unchanged: tuple[str, Errors, Errors] | None = None
    for variant in variants_of(plan.quick):
        grid = palpate.training_grid()
        poses = numpy.concatenate([grid, palpate.random_poses(7 * len(grid), 12)])
        training = training_recordings(replace(variant.touching, noise=(0.0, 0.0)),
                                       poses if variant.more_training else grid)  # fmt: skip
        maps = letter_maps(device, training, cell_mm=variant.cell_mm, spread_mm=variant.spread_mm)
        trials = make_trials(VOWELS, each, TOUCHES, SEED, variant.touching)
        against = unchanged
        for bins in plan.limits if variant.all_lattices else plan.limits[:1]:
            lattice = lattice_of(*bins)
            steps = [estimate_in_window(device, maps, trial, lattice) for trial in trials]
            modes, refined = [s.error_mm for s in steps], [s.refined_error_mm for s in steps]
            limits.append(
                {
                    "name": variant.name,
                    "count": product(bins),
                    "elements": len(numpy.asarray(variant.touching.elements_mm)),
                    "error_mm": errors_record(modes),
                    "refined_error_mm": errors_record(refined),
                    "against": against and against[0],
                    "difference_mm": against and Paired.of(modes, against[1]).difference(),
                    "refined_difference_mm": against and Paired.of(refined, against[2]).difference(),
                }
            )
            unchanged = unchanged or (variant.name, modes, refined)
            if bins == plan.limits[0]:
                against = (f"{count_text(product(bins))} bins", modes, refined)
    return limits


def compare_paths(options: argparse.Namespace) -> list[Json]:
    """The ways to evaluate the likelihood, which `palpate-bench paths` times in C++."""
    program = os.environ.get("PALPATE_BENCH", "build/palpate-bench")
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "paths.json")
        flags = ["--quick"] if options.quick else []
        flags += ["--device", options.device] if options.device else []
        subprocess.run([program, "paths", "--json", file, *flags], check=True, stdout=subprocess.DEVNULL)
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
                same = {key: point[key] for key in ("filter", "cell_mm", "count", "full_trials", "accuracy")}
                costs = {"cost": point["seconds_per_unknown"] + more_s, "error": error["mean"]}
                poses.append({"pose": pose, "standard_error": error["standard_error"]} | same | costs)
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
        for resampling, augmented in ((multinomial, False), (systematic, False), (multinomial, True)):
            for particles in cells.particles:
                some = plan.trials(1) if particles > 300_000 else trials
                add(
                    measure_particles(
                        device, maps, some, particles=particles, resampling=resampling, augmented=augmented
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
    flags.add_argument("--html", metavar="FILE", help="write the results as a page with charts and tables")
    flags.add_argument("--trials", type=at_least_1, help="trials per letter [10, or 4 with --quick]")
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
