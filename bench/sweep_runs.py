"""What the sweep measures of one lattice or one number of particles, and of what bounds the errors."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import numpy

import palpate
from palpate import reference
from palpate._statistics import errors_over, quantile
from palpate._tables import column, count_text

from .certificates import check_certificate, dense_posterior
from .measures import calibration, differences, wrapped
from .program import Json
from .trials import EXACT, TABLE_1, VOWELS, Bins, Body, Floats, Touching, error_of, lattice_of, letter_maps
from .trials import make_trials, map_of, recognized, training_recordings, truth_of

Maps = Sequence[palpate.OccupancyGrid]
Trials = Sequence[palpate.Recording]
T = TypeVar("T")

#: Bins of every object, or particles for each, whose log-likelihood is held against float64.
SAMPLED = 200


def first_each(of_trials: Sequence[T], each: int) -> list[T]:
    """Picks what belongs to the first `each` trials of every letter, of all trials in order."""
    of_letter = len(of_trials) // len(VOWELS)
    return [of_trial for i, of_trial in enumerate(of_trials) if i % of_letter < each]


def seconds_of(call: Callable[[], T]) -> tuple[float, T]:
    """How long a call takes, and what it gives."""
    start = time.perf_counter()
    value = call()
    return time.perf_counter() - start, value


def asked_after(belief: Any, touches: palpate.Recording | palpate.Touch) -> tuple[float, Any]:
    """Seconds of taking in touches and of an estimate, and the estimate."""
    return seconds_of(lambda: (belief.update(touches), belief.estimate())[1])


def follow(belief: Any, maps: Maps, trial: palpate.Recording) -> Json:
    """Asks a belief after each touch of a trial: times in s, what it says, its poses in the end."""
    truth, refined, refine_s = truth_of(trial), None, None
    touch_s, estimates = zip(*[asked_after(belief, touch) for touch in trial], strict=True)
    mode = estimates[-1].mode
    if isinstance(belief, palpate.PoseHistogram):
        refine_s, refined = seconds_of(lambda: belief.refine(mode))
    return {
        "touch_s": touch_s,
        "refine_s": refine_s,
        "confidence": [max(of.identity) for of in estimates],
        "right": [maps[int(numpy.argmax(of.identity))].label == truth.object for of in estimates],
        "mode": mode,
        "refined": refined,
        "error_mm": error_of(maps[mode.object], truth, mode),
        "refined_error_mm": error_of(maps[mode.object], truth, refined),
    }


def record_of(
    kind: str, maps: Maps, belief: Any, ends: Sequence[Json], steps: Sequence[Json], off_nats: Sequence[float]
) -> Json:
    """What a run cost, as medians, how well it knows the objects, by follow(), and its errors.

    off_nats: how far log-likelihoods are from float64.
    """
    touch_s, confidence, right = (column(ends, of) for of in ("touch_s", "confidence", "right"))
    refine_s, off = column(ends, "refine_s"), numpy.abs(off_nats)
    record: Json = {
        "filter": kind,
        "cell_mm": maps[0].cell_mm,
        "bins": None,
        "balanced": False,
        "trials": len(steps),
        "full_trials": len(ends),
        "seconds_per_touch": quantile(touch_s, 0.5),
        "seconds_per_unknown": quantile(touch_s.sum(axis=1), 0.5),
        "seconds_refine": None if numpy.isnan(refine_s).any() else quantile(refine_s, 0.5),
        "device_bytes": belief.device_bytes,
        "accuracy": float(right[:, -1].mean()),
        "expected_calibration_error": calibration(confidence.ravel(), right.ravel())["expected_error"],
        "by_bounds": None,
        "nearest_bin_mm": None,
        "deviation_nats": {
            "largest": float(off.max()),
            "rms": float(numpy.sqrt(numpy.mean(off**2))),
            "samples": len(off),
        },
    }
    for name in ("error", "refined_error"):
        errors = [step.get(f"{name}_mm") for step in steps]
        record |= {f"{name}_mm": errors_over(errors, 20), f"{name}s_mm": errors}
    return record


def nearest_bin_mm(lattice: palpate.PoseLattice, body: Body, pose: Floats) -> float:
    """Least error that a bin of the lattice has for a body at a pose: what the lattice alone costs.

    At a given theta the error grows with the distance between the places of the body's centroid, so that
    the nearest bin is that of x and y by themselves.
    """
    theta = lattice.theta_rad
    thetas = numpy.array([theta.centre(k) for k in range(theta.count)])
    p = palpate.transform(palpate.inverse(pose), [body.centroid_mm])[0] - lattice.pivot_mm
    c, s = numpy.cos(thetas), numpy.sin(thetas)
    places = body.centroid_mm[:, None] - numpy.stack([c * p[0] - s * p[1], s * p[0] + c * p[1]])
    squared = numpy.zeros(theta.count)
    for axis, place in zip((lattice.x_mm, lattice.y_mm), places, strict=True):
        nearest = numpy.clip(numpy.floor((place - axis.lower) / axis.step), 0, axis.count - 1)
        squared += (axis.lower + (nearest + 0.5) * axis.step - place) ** 2
    if body.symmetry > 0:
        turns = wrapped(thetas - pose[2], 2.0 * math.pi / body.symmetry)
        squared += 4.0 * body.inertia_mm2 * numpy.sin(turns / 2.0) ** 2
    return float(numpy.sqrt(squared.min()))


def by_bounds(device: palpate.Device, maps: Maps, trials: Trials, bins: Bins) -> list[Json]:
    """The records of trials after their last touch: the full posterior without the time for all bins."""
    steps = recognized(device, maps, trials, bins=bins, filter="bounded", trace=False)
    return [of_trial[-1] for of_trial in steps]


def measure_histogram(device: palpate.Device, maps: Maps, trials: Trials, full_each: int, bins: Bins) -> Json:
    """What the histogram costs and what it is worth over the first `full_each` trials of every letter.

    Where these are not all, the errors are those of all trials by bounds.
    """
    lattice = lattice_of(bins)
    belief = palpate.PoseHistogram(device, maps, lattice)
    full, ends = first_each(trials, full_each), []
    for trial in full:
        belief.reset()
        ends.append(follow(belief, maps, trial))
    steps, compared = ends, None
    if len(full) < len(trials):
        steps = by_bounds(device, maps, trials, bins)
        compared = comparison_of(maps, full, ends, first_each(steps, full_each))
    nearest_mm = [
        nearest_bin_mm(lattice, Body.of(map_of(maps, trial)), truth_of(trial).T_object_robot)
        for trial in trials
    ]
    touch = trials[0][0]
    belief.reset()
    belief.update(touch)
    contact, random = palpate.ContactModel(prior=maps[0].prior), numpy.random.default_rng(7)
    off_nats = []
    for i, grid in enumerate(maps):
        logs = belief.log_likelihood(i).reshape(-1)
        for bin_ in random.integers(len(logs), size=SAMPLED).tolist():
            pose = lattice.T_object_robot(bin_)
            off_nats.append(float(logs[bin_]) - reference.log_likelihood(touch, pose, grid, contact))
    return record_of("histogram", maps, belief, ends, steps, off_nats) | {
        "count": lattice.bins,
        "bins": list(bins),
        "balanced": bins not in TABLE_1,
        "by_bounds": compared,
        "nearest_bin_mm": float(numpy.mean(nearest_mm)),
    }


def comparison_of(maps: Maps, full: Trials, ends: Sequence[Json], records: Sequence[Json]) -> Json:
    """How far apart the poses of a trial lie at the most, by the histogram and by bounds."""
    located = [of for of in zip(full, ends, records, strict=True) if of[1]["error_mm"] is not None]
    compared: Json = {"compared_trials": len(located)}
    for kind in ("mode", "refined"):
        distances = [
            palpate.pose_error_mm(
                map_of(maps, trial),
                end[kind].T_object_robot,
                [record[kind][of] for of in ("x_mm", "y_mm", "theta_rad")],
            )
            for trial, end, record in located
        ]
        compared[f"{kind}_difference_mm"] = max(distances, default=0.0)
    return compared


def measure_particles(device: palpate.Device, maps: Maps, trials: Trials, kind: str, particles: int) -> Json:
    """What a particle filter costs and what it is worth over all trials; trial i has the seed 1 + i.

    kind: "particles", "systematic" or "augmented". Log-likelihoods after one touch are taken relative to
    the heaviest particle.
    """

    def filter_of(seed: int) -> palpate.ParticleFilter:
        return palpate.ParticleFilter(
            device, maps, lattice_of((1, 1, 1)), seed=seed, particles=particles,
            augmented=kind == "augmented",
            resampling=palpate.Resampling["systematic" if kind == "systematic" else "multinomial"],
        )  # fmt: skip

    ends = [follow(filter_of(seed), maps, trial) for seed, trial in enumerate(trials, start=1)]
    touch, belief = trials[0][0], filter_of(len(trials) + 1)
    belief.update(touch)
    objects, poses, weights = belief.particles()
    contact = palpate.ContactModel(prior=maps[0].prior)

    def log_likelihood(i: int) -> float:
        return reference.log_likelihood(touch, poses[i], maps[objects[i]], contact)

    heaviest = int(numpy.argmax(weights))
    expected = log_likelihood(heaviest)
    drawn = numpy.random.default_rng(7).integers(len(weights), size=SAMPLED * len(maps)).tolist()
    off_nats = [math.log(weights[i] / weights[heaviest]) - (log_likelihood(i) - expected) for i in drawn]
    return record_of(kind, maps, belief, ends, ends, off_nats) | {"count": particles}


def measure_bounds(device: palpate.Device, maps: Maps, trials: Trials, bins: Bins) -> Json:
    """Times the bounded posterior beside the histogram on one lattice, over all of the trials.

    They are asked once after all touches, and after every touch. Holds the certificates against the
    histogram's bins in float64, and says whether bounds are faster where they are asked once.
    """
    lattice = lattice_of(bins)
    bounded = palpate.BoundedPosterior(device, maps, lattice)
    histogram = palpate.PoseHistogram(device, maps, lattice)
    beliefs: dict[str, Any] = {"bounded": bounded, "histogram": histogram}
    for belief in beliefs.values():
        asked_after(belief, trials[0])  # warms up
    checks: list[Json] = []
    for trial in trials:
        seconds: Json = {}
        for name, belief in beliefs.items():
            belief.reset()
            each_touch = sum(asked_after(belief, touch)[0] for touch in trial)
            belief.reset()
            seconds[name] = {"once": asked_after(belief, trial)[0], "each_touch": each_touch}
        checks.append(seconds | check_certificate(bounded, dense_posterior(histogram, maps, trial)))
    times = {
        name: {asked: quantile(column(checks, f"{name}/{asked}"), 0.5) for asked in ("once", "each_touch")}
        for name in beliefs
    }
    in_all, evaluated = lattice.bins * len(maps), quantile(column(checks, "bins_evaluated"), 0.5)
    return {
        "count": lattice.bins,
        "bins_in_all": in_all,
        "trials": len(trials),
        **times,
        "bins_evaluated": int(evaluated),
        "share_evaluated": evaluated / in_all,
        "certificate": max(check["promised"] for check in checks),
        "measured_error": max(check["measured"] for check in checks),
        "certificates_hold": sum(check["holds"] for check in checks),
        "same_modes": sum(check["same_mode"] for check in checks),
        "host_bytes": bounded.host_bytes,
        "bounds_are_faster": times["bounded"]["once"] < times["histogram"]["once"],
    }


# Where the errors come from that more bins do not mend.


class Variant(NamedTuple):
    """What is changed. The sensor holds for training and trials alike."""

    name: str
    touching: Touching = EXACT
    cell_mm: float = 0.5
    spread_mm: float = 0.5
    more_training: bool = False
    all_lattices: bool = False


def sensor(**changed: float) -> Touching:
    """Touches by a sensor of which this is changed."""
    return Touching(sensor=palpate.SensorModel(**changed))


SHARP, SPARSE = sensor(psf_mm=0.25), Touching(palpate.grid_array(3, 3, 3.8))
#: One thing at a time; the first changes nothing.
VARIANTS = (
    Variant("as it is", all_lattices=True),
    Variant("a sensor without noise", sensor(noise_kpa=0.0)),
    Variant("equal gains and press forces", sensor(force_spread=0.0, gain_spread=0.0)),
    Variant("a point spread of 0.25 mm", SHARP),
    Variant("a point spread of 0.25 mm, and maps of that spread and cells", SHARP, 0.25, 0.125),
    Variant("maps of 0.25 mm cells", cell_mm=0.25),
    Variant("8 times the training touches", more_training=True),
    Variant("touches at random poses", Touching(at_random_poses=True)),
    Variant("touches displaced by 1 mm and 0.05 rad", Touching(noise=(1.0, 0.05))),
    Variant("an array of 16 x 16", Touching(palpate.grid_array(16, 16, 1.9)), all_lattices=True),
    Variant("a sparse array of 3 x 3, twice the pitch", SPARSE, all_lattices=True),
)


def measure_limits(
    device: palpate.Device, quick: bool, lattices: Sequence[Bins], each: int, touches: int, seed: int
) -> list[Json]:
    """Where the errors come from that more bins do not mend, by bounds.

    Every variant is compared with the first on the first of the lattices; arrays also run on the
    others, each compared with the same array on the first.
    """
    limits: list[Json] = []
    names = ("error_mm", "refined_error_mm")
    unchanged: Json | None = None
    for variant in VARIANTS[: 2 if quick else None]:
        poses = palpate.training_grid()
        if variant.more_training:
            poses = numpy.concatenate([poses, palpate.random_poses(7 * len(poses), 12)])
        training = training_recordings(
            replace(variant.touching, noise=(0.0, 0.0)), poses[:: 3 if quick else 1]
        )
        maps = letter_maps(device, training, cell_mm=variant.cell_mm, spread_mm=variant.spread_mm)
        trials = make_trials(VOWELS, each, touches, seed, variant.touching)
        against = unchanged
        for bins in lattices if variant.all_lattices else lattices[:1]:
            records = by_bounds(device, maps, trials, bins)
            errors = {name: [record.get(name) for record in records] for name in names}
            limit: Json = {
                "name": variant.name,
                "count": math.prod(bins),
                "elements": len(numpy.asarray(variant.touching.elements_mm)),
                "against": against and against["name"],
            }
            for name, of in errors.items():
                limit[name] = errors_over(of, 20)
                change = name.replace("error", "difference")
                limit[change] = against and differences(of, against[name])
            limits.append(limit)
            unchanged = unchanged or {"name": variant.name, **errors}
            if bins == lattices[0]:
                against = {"name": f"{count_text(math.prod(bins))} bins", **errors}
    return limits
