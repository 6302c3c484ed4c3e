"""Objects that slip, planned touches, and what all beliefs cost."""

import math
import time
from collections.abc import Callable
from statistics import fmean, median_low
from typing import Any

import numpy

import palpate
from palpate._statistics import Errors, present, quantile

from .belief_touches import Inputs, Sd, mean_of
from .measures import mean_interval, mean_record
from .random_numbers import Random, Stream
from .report import Json, Measurement
from .trials import (
    VOWELS,
    Body,
    Floats,
    Touching,
    judged,
    lattice_of,
    make_trials,
    size_of,
    truth_of,
)

SLIP_SEED = 800_000_000
WALK_SEED = 850_000_000
COST_SEED = 900_000_000
PLAN_SEED = 950_000_000


# Objects that move between touches.


def slipping(
    trial: palpate.Recording, centroid_mm: Floats, step: Sd, seed: int
) -> tuple[palpate.Recording, list[palpate.Truth]]:
    """A trial whose object takes a step of a random walk before every touch but the first.

    A turn about its centroid and a translation, of these standard deviations. The walk begins at 3/10
    of the trial's distance from the robot frame's origin, within 3 mm along x and y, so that few walks
    of 50 steps of 0.3 mm leave a region of +-8 mm. The readings stay as they are. Returns the touches
    as the robot reports them, and the truth at each.
    """
    at_rest = truth_of(trial).T_object_robot
    here = at_rest * (0.3, 0.3, 1.0)
    normals = iter(Random(seed, Stream.OBJECT_POSE).normals(3 * len(trial)).tolist())
    poses, truths = [], []
    for i in range(len(trial)):
        if i > 0:
            dx, dy, turn = step[0] * next(normals), step[0] * next(normals), step[1] * next(normals)
            about = centroid_mm - palpate.transform((0.0, 0.0, turn), [centroid_mm])[0]
            here = palpate.compose((dx + about[0], dy + about[1], turn), here)
        on_object = palpate.compose(at_rest, trial.T_robot_sensor[i])
        poses.append(palpate.compose(palpate.inverse(here), on_object))
        truths.append(palpate.Truth(truth_of(trial).object, here))
    return palpate.Recording(trial.pressure, numpy.array(poses), trial.elements_mm), truths


def measure_slip(inputs: Inputs) -> list[Json]:
    """Unknowns that slip, as believed with and without slip_sd."""
    step = (0.3, math.pi / 180.0)
    # Steps of 0.5 mm and 2 degrees resolve such slips.
    lattice = lattice_of(20, 20, 75, 8.0) if inputs.quick else lattice_of(32, 32, 180, 8.0)
    each, touches = inputs.each(5, 1), 12 if inputs.quick else 50
    walks = [
        slipping(trial, Body.of(inputs.maps[i // each]).centroid_mm, step, WALK_SEED + i)
        for i, trial in enumerate(make_trials(VOWELS, each, touches, SLIP_SEED))
    ]
    rows: list[tuple[Any, ...]] = []
    records = []
    for name, slip_sd, most in (("with slip_sd", step, 1.0), ("without", (0.0, 0.0), None)):
        belief = inputs.histogram(lattice, slip_sd=slip_sd)
        errors: list[Errors] = []  # [unknown][touch]
        for walk, truths in walks:
            belief.reset()
            of_walk = []
            for i, truth in enumerate(truths):
                belief.update(walk[i])
                of_walk.append(judged(belief, inputs.maps, truth).error_mm)
            errors.append(of_walk)
        for words, first, goal in (
            ("mean over touches", 0, most),
            ("second half of the touches", touches // 2, None),
        ):
            means = [fmean(there) for of in errors if (there := present(of[first:]))]
            name_of, interval = f"{name}: mode's error, {words}", mean_interval(means)
            rows.append(Measurement(name_of, fmean(means), "mm", goal, interval=interval))
        by_touch = [present([of[i] for of in errors]) for i in range(touches)]
        share = 100.0 * sum(map(len, by_touch)) / (touches * len(walks))
        rows.append((f"{name}: touches at which the mode has the right letter", share, "%"))
        curve = [
            {"touches": i, "located": len(of), "mode_mm": fmean(of) if of else None}
            for i, of in enumerate(by_touch, start=1)
        ]
        records.append({"belief": name, "curve": curve})
    facts = {"unknowns": len(walks), "touches": touches, "bins": size_of(lattice)}
    inputs.report.add("slip 0.3 mm, 1 degree", facts, rows)
    return records


# Touches chosen by what they are expected to tell, beside random ones.


def measure_plan(inputs: Inputs) -> list[Json]:
    """Touches every unknown twice, beginning with the same random touch.

    In random order, and each time where the most is expected to be told about object and pose.
    Candidates are the poses of the test set that were not touched yet.
    """
    lattice, touches = lattice_of(13, 13, 55), 4 if inputs.quick else 7
    belief = inputs.histogram(lattice)
    labels = [grid.label for grid in inputs.maps]
    milliseconds: list[float] = []
    told: dict[str, list[list[tuple[float, float]]]] = {"random": [], "planned": []}
    whole = len(palpate.training_grid())
    for number, test_set in enumerate(make_trials(VOWELS, inputs.each(20, 1), whole, PLAN_SEED)):
        label = labels.index(truth_of(test_set).object)
        for order, of_order in told.items():
            belief.reset()
            left, following = list(range(whole)), 0  # the first touch is the random one
            of_order.append([])
            for touch in range(touches):
                if order == "planned" and touch > 0:
                    start = time.perf_counter()
                    gains = belief.expected_gain(
                        test_set.T_robot_sensor[left],
                        test_set.elements_mm,
                        seed=1 + number * whole + touch,
                    )
                    following = int(numpy.argmax(gains.both))
                    milliseconds.append(1e3 * (time.perf_counter() - start))
                belief.update(test_set[left.pop(following)])
                probability = max(float(belief.estimate().identity[label]), numpy.finfo(float).tiny)
                of_order[-1].append((belief.entropy(), -math.log(probability)))
    # [order][touch] of every unknown
    entropy, loss = (
        {order: list(zip(*[[both[i] for both in of] for of in all_of], strict=True))
         for order, all_of in told.items()}
        for i in (0, 1)
    )  # fmt: skip
    rows: list[tuple[Any, ...]] = [
        mean_of(f"entropy, {order}, touch {touch + 1}", entropy[order][touch], "nats")
        for touch in range(touches)
        for order in told
    ]
    for planned, random in ((3, 4), (4, 6), (5, 7)):
        if random <= touches:
            pairs = zip(entropy["planned"][planned - 1], entropy["random"][random - 1], strict=True)
            name = f"{planned} planned above {random} random"
            rows.append(mean_of(name, [a - b for a, b in pairs], "nats", 0.1))
    rows.append(("plan, median", median_low(milliseconds), "ms"))
    facts = {"unknowns": len(told["random"]), "bins": size_of(lattice)}
    inputs.report.add("planned touches", facts, rows)
    records: list[Json] = []
    for order in told:
        of_touches = zip(entropy[order], loss[order], strict=True)
        curve = [
            {"touches": touch, "entropy": mean_record(nats), "log_loss": mean_record(lost)}
            for touch, (nats, lost) in enumerate(of_touches, start=1)
        ]
        records.append({"order": order, "curve": curve})
    return records


# Time and memory of all these.

COST_SD: Sd = (1.0, 0.05)


def _ms(call: Callable[..., object], *arguments: Any) -> float:
    """Milliseconds of a call."""
    start = time.perf_counter()
    call(*arguments)
    return 1e3 * (time.perf_counter() - start)


def measure_costs(inputs: Inputs) -> list[Json]:
    """Contenders meet the same touches in the same order, in turn."""
    unknowns = make_trials(VOWELS, 1, 9, COST_SEED, Touching(at_random_poses=True))
    touches = [touch for unknown in unknowns for touch in unknown]
    sizes = {"objects": len(inputs.maps), "touch_sd": "1 mm, 0.05 rad"}
    lattice = lattice_of(30, 30, 113) if inputs.quick else lattice_of(100, 100, 100)
    repeats = 3 if inputs.quick else 9
    beliefs = [
        inputs.histogram(lattice),
        inputs.histogram(lattice, touch_sd=COST_SD),
        inputs.histogram(lattice, slip_sd=(0.3, math.pi / 180.0)),
        inputs.histogram(lattice, none_weight=float(len(inputs.maps))),
    ]
    # The first touch warms up; the object slips before the second.
    taken = [
        [_ms(belief.update, touches[i % len(touches)]) for belief in beliefs]
        for i in range(repeats + 1)
    ]
    ms = [median_low(of) for of in zip(*taken[1:], strict=True)]
    memory = [belief.device_bytes / beliefs[0].device_bytes for belief in beliefs]
    rows: list[tuple[Any, ...]] = [
        ("plain touch, median", ms[0], "ms"),
        ("uncertain touch, median", ms[1], "ms"),
        ("uncertain over plain", ms[1] / ms[0], "times", 2.5),
        ("touch after a slip over plain", ms[2] / ms[0], "times"),
        ("touch with none of these over plain", ms[3] / ms[0], "times"),
        ("memory, uncertain over plain", memory[1], "times", 2.0),
        ("memory, slip over plain", memory[2], "times", 2.0),
        ("memory, none of these over plain", memory[3], "times", 2.0),
    ]
    facts = sizes | {"slip_sd": "0.3 mm, 1 degree", "repeats": repeats}
    inputs.report.add(f"touch {size_of(lattice)}", facts, rows)
    del beliefs
    small, repeats = lattice_of(25, 25, 16), 20 if inputs.quick else 300
    latencies = []
    for sd in ((0.0, 0.0), COST_SD):
        belief = inputs.histogram(small, touch_sd=sd)

        def ask(i: int, belief: palpate.PoseHistogram = belief) -> None:
            belief.update(touches[i % len(touches)])
            belief.estimate()

        latencies.append([_ms(ask, i) for i in range(repeats + 1)][1:])
    plain, uncertain = latencies
    rows = [
        ("touch to estimate, median", median_low(uncertain), "ms", 8.0),
        ("95th percentile", quantile(uncertain, 0.95), "ms"),
        ("plain touch to estimate, median", median_low(plain), "ms"),
    ]
    name = f"latency {size_of(small)}, uncertain"
    inputs.report.add(name, sizes | {"repeats": repeats}, rows)
    # Places all over the unknown, which the robot could press next.
    T_robot_object = palpate.inverse(truth_of(unknowns[0]).T_object_robot)
    candidates = numpy.array(
        [palpate.compose(T_robot_object, pose) for pose in palpate.random_poses(200, COST_SEED)]
    )
    repeats, elements_mm, plans = 2 if inputs.quick else 15, unknowns[0].elements_mm, []
    for sd in ((0.0, 0.0), COST_SD):
        belief = inputs.histogram(small, touch_sd=sd)
        belief.update(unknowns[0][:3])
        plan_ms = [_ms(belief.expected_gain, candidates, elements_mm) for _ in range(repeats + 1)]
        plans.append(median_low(plan_ms[1:]))
    rows = [
        ("exact touches, median", plans[0], "ms", 150.0),
        ("uncertain touches, median", plans[1], "ms"),
    ]
    facts = {"objects": len(inputs.maps), "candidates": len(candidates), "repeats": repeats}
    inputs.report.add(f"plan {size_of(small)}", facts, rows)
    if not inputs.quick:
        large = lattice_of(200, 200, 250)
        belief = inputs.histogram(large, touch_sd=COST_SD)
        seconds = _ms(belief.update, touches[0]) / 1e3
        mib = belief.device_bytes / (1 << 20)
        rows = [("device memory", mib, "MiB", 2048.0), ("uncertain touch", seconds, "s")]
        inputs.report.add(f"touch {size_of(large)}", sizes, rows)
    return []
