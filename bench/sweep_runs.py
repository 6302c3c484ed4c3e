"""What the sweep measures of one lattice or one number of particles."""

import math
import time
from collections.abc import Sequence
from statistics import fmean, median_low
from typing import Any, TypeVar

import numpy

import palpate
from palpate import reference
from palpate._statistics import errors_over

from .certificates import check_certificate, dense_posterior
from .measures import calibration
from .report import Json
from .trials import TABLE_1, VOWELS, Bins, error_of, lattice_of, truth_of
from .windows import estimate_in_window, map_of, nearest_bin_mm, placed

Maps = Sequence[palpate.OccupancyGrid]
Trials = Sequence[palpate.Recording]
T = TypeVar("T")

#: Bins of every object, or particles for each, whose log-likelihood is held against float64.
SAMPLED = 200
#: Bins of all objects above which --filter auto takes bounds.
AUTO_RULE = 100_000


def first_each(of_trials: Sequence[T], each: int) -> list[T]:
    """Picks what belongs to the first `each` trials of every letter, of all trials in order."""
    of_letter = len(of_trials) // len(VOWELS)
    return [of_trial for i, of_trial in enumerate(of_trials) if i % of_letter < each]


def follow(belief: Any, maps: Maps, trial: palpate.Recording) -> Json:
    """Asks a belief after each touch of a trial: times in s, what it says, its poses in the end."""
    asked: Json = {"touch_s": [], "refine_s": [], "confidence": [], "right": [], "refined": None}
    truth = truth_of(trial)
    for touch in trial:
        start = time.perf_counter()
        belief.update(touch)
        estimate = belief.estimate()
        asked["touch_s"].append(time.perf_counter() - start)
        best = int(numpy.argmax(estimate.identity))
        asked["confidence"].append(float(estimate.identity[best]))
        asked["right"].append(maps[best].label == truth.object)
    grid, asked["mode"] = maps[estimate.mode.object], estimate.mode
    if isinstance(belief, palpate.PoseHistogram):
        start = time.perf_counter()
        asked["refined"] = belief.refine(estimate.mode)
        asked["refine_s"].append(time.perf_counter() - start)
    asked["error_mm"] = error_of(grid, truth, asked["mode"])
    asked["refined_error_mm"] = error_of(grid, truth, asked["refined"])
    return asked


def costs_record(kind: str, cell_mm: float, count: int, device_bytes: int, of: list[Json]) -> Json:
    """What a run over some trials cost, as medians, and how well it knows the objects."""
    touch_s, refine_s, confidence, right = (
        [value for asked in of for value in asked[name]]
        for name in ("touch_s", "refine_s", "confidence", "right")
    )
    return {
        "filter": kind,
        "cell_mm": cell_mm,
        "count": count,
        "bins": None,
        "balanced": False,
        "full_trials": len(of),
        "seconds_per_touch": median_low(touch_s),
        "seconds_per_unknown": median_low([sum(asked["touch_s"]) for asked in of]),
        "seconds_refine": median_low(refine_s) if refine_s else None,
        "device_bytes": device_bytes,
        "accuracy": fmean(asked["right"][-1] for asked in of),
        "least_confidence": min(asked["confidence"][-1] for asked in of),
        "expected_calibration_error": calibration(confidence, right)["expected_error"],
        "windows": None,
    }


def errors_of(steps: Sequence[Json]) -> Json:
    """Pose errors in the record of a run: those of each trial, and what they are over all."""
    record: Json = {"trials": len(steps)}
    for name in ("error", "refined_error"):
        errors = [step[f"{name}_mm"] for step in steps]
        record |= {f"{name}_mm": errors_over(errors, 20), f"{name}s_mm": errors}
    return record


def deviation_record(deviations: Sequence[float]) -> Json:
    """How far log-likelihoods are from float64, in nats."""
    off = numpy.abs(deviations)
    rms = float(numpy.sqrt(numpy.mean(off**2)))
    return {"largest": float(off.max()), "rms": rms, "samples": len(off)}


def measure_histogram(
    device: palpate.Device, maps: Maps, trials: Trials, full_each: int, bins: Bins
) -> Json:
    """What the histogram costs and what it is worth over the first `full_each` trials of every letter.

    Where these are not all, the errors are those of all trials in windows.
    """
    lattice = lattice_of(*bins)
    belief = palpate.PoseHistogram(device, maps, lattice)
    full = first_each(trials, full_each)
    ends = []
    for trial in full:
        belief.reset()
        ends.append(follow(belief, maps, trial))
    record = costs_record("histogram", maps[0].cell_mm, lattice.bins, belief.device_bytes, ends)
    record |= {"bins": list(bins), "balanced": bins not in TABLE_1}
    steps = ends
    if len(full) < len(trials):
        found = [estimate_in_window(device, maps, trial, lattice) for trial in trials]
        steps = [step._asdict() for step in found]
        record["windows"] = windows_record(maps, full, ends, first_each(steps, full_each))
    record |= errors_of(steps)
    nearest_mm = [nearest_bin_mm(lattice, placed(maps, trial)) for trial in trials]
    record["nearest_bin_mm"] = fmean(nearest_mm)
    belief.reset()
    belief.update(trials[0][0])
    record["deviation_nats"] = deviation_record(bin_deviations(belief, maps, trials[0][0]))
    return record


def windows_record(maps: Maps, full: Trials, ends: Sequence[Json], steps: Sequence[Json]) -> Json:
    """How far apart the two poses of a trial lie at the most, by the full posterior and in a window."""
    apart: dict[str, list[float]] = {"mode": [], "refined": []}
    for trial, end, step in zip(full, ends, steps, strict=True):
        grid = map_of(maps, trial)
        if end["error_mm"] is not None:
            whole = palpate.OccupancyGrid(
                grid.label, grid.log_odds, cell_mm=grid.cell_mm, origin_mm=grid.origin_mm
            )  # without symmetry
            for pose, distances in apart.items():
                a, b = end[pose].T_object_robot, step[pose].T_object_robot
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
            expected = reference.log_likelihood(touch, pose, grid, contact)
            deviations.append(float(logs[bin_]) - expected)
    return deviations


def measure_particles(
    device: palpate.Device, maps: Maps, trials: Trials, kind: str, particles: int
) -> Json:
    """What a particle filter costs and what it is worth over all trials; trial i has the seed 1 + i.

    kind: "particles", "systematic" or "augmented". The deviation is that of the weights after one
    touch, which nothing has resampled yet. Weights are relative, so both sides are taken relative to
    the heaviest particle.
    """
    resampling = "systematic" if kind == "systematic" else "multinomial"

    def filter_of(seed: int) -> palpate.ParticleFilter:
        return palpate.ParticleFilter(
            device,
            maps,
            lattice_of(1, 1, 1),
            seed=seed,
            particles=particles,
            resampling=palpate.Resampling[resampling],
            augmented=kind == "augmented",
        )

    ends, most_bytes = [], 0
    for seed, trial in enumerate(trials, start=1):
        belief = filter_of(seed)
        ends.append(follow(belief, maps, trial))
        most_bytes = max(most_bytes, belief.device_bytes)
    record = costs_record(kind, maps[0].cell_mm, particles, most_bytes, ends)
    record |= errors_of(ends) | {"nearest_bin_mm": None}
    touch, belief = trials[0][0], filter_of(len(trials) + 1)
    belief.update(touch)
    objects, poses, weights = belief.particles()
    contact = palpate.ContactModel(prior=maps[0].prior)

    def log_likelihood(i: int) -> float:
        return reference.log_likelihood(touch, poses[i], maps[objects[i]], contact)

    heaviest = int(numpy.argmax(weights))
    expected = log_likelihood(heaviest)
    drawn = numpy.random.default_rng(7).integers(len(weights), size=SAMPLED * len(maps)).tolist()
    record["deviation_nats"] = deviation_record(
        [math.log(weights[i] / weights[heaviest]) - (log_likelihood(i) - expected) for i in drawn]
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

    def ask(belief: Any, parts: Sequence[palpate.Recording]) -> float:
        belief.reset()
        start = time.perf_counter()
        for part in parts:
            belief.update(part)
            belief.estimate()
        return time.perf_counter() - start

    beliefs = {"bounded": bounded, "histogram": histogram}
    seconds: dict[str, Json] = {name: {"once": [], "each_touch": []} for name in beliefs}
    checks, evaluated = [], []
    for belief in beliefs.values():
        ask(belief, [trials[0]])  # warms up
    for trial in trials:
        one_by_one = [trial[i : i + 1] for i in range(len(trial))]
        for name, belief in beliefs.items():
            seconds[name]["each_touch"].append(ask(belief, one_by_one))
            seconds[name]["once"].append(ask(belief, [trial]))
        checks.append(check_certificate(bounded, dense_posterior(histogram, maps, trial)))
        certificate = bounded.estimate().certificate
        assert certificate is not None
        evaluated.append(certificate.bins_evaluated)
    times = {
        name: {asked: median_low(of) for asked, of in both.items()}
        for name, both in seconds.items()
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
        "bins_evaluated": median_low(evaluated),
        "share_evaluated": median_low(evaluated) / in_all,
        "certificate": max(check.promised for check in checks),
        "measured_error": max(check.measured for check in checks),
        "certificates_hold": sum(check.holds for check in checks),
        "same_modes": sum(check.same_mode for check in checks),
        "host_bytes": bounded.host_bytes,
        "auto": "bounded" if in_all > AUTO_RULE else "histogram",
        "auto_is_faster": (in_all > AUTO_RULE) == faster,
    }
