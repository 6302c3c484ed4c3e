"""What the sweep measures of one lattice or one number of particles."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy

import palpate
from palpate import reference
from palpate._statistics import Errors, mean, median
from palpate._sweep_runs import errors_record

from .certificates import check_certificate, dense_posterior
from .measures import calibration
from .report import Json
from .sweep_plan import AUTO_RULE, SAMPLED, TOUCHES, Maps, Trials
from .trials import TABLE_1, Bins, Step, lattice_of, truth_of
from .windows import estimate_in_window, map_of, nearest_bin_mm, placed


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
            "expected_calibration_error": calibration(self.confidences, self.right)[
                "expected_error"
            ],
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
            [
                error_of(grid, trial, end[pose])
                for grid, trial, end in zip(located, full, costs.last, strict=True)
            ]
            for pose in ("mode", "refined")
        ]
    else:
        steps = [estimate_in_window(device, maps, trial, lattice) for trial in trials]
        errors = [[step.error_mm for step in steps], [step.refined_error_mm for step in steps]]
        first = [step for i, step in enumerate(steps) if i % each < full_each]
        record["windows"] = windows_record(maps, full, costs.last, first)
    set_errors(record, *errors)
    record["nearest_bin_mm"] = mean(
        [nearest_bin_mm(lattice, placed(maps, trial)) for trial in trials]
    )
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
    augmented, systematic = (
        options["augmented"],
        options["resampling"] == palpate.Resampling.systematic,
    )
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
            math.log(weights[i] / weights[heaviest])
            - (log_likelihood(i) - log_likelihood(heaviest))
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
    times = {
        name: {asked: median(of) for asked, of in both.items()} for name, both in seconds.items()
    }
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
