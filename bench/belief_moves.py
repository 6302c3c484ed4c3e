"""Objects that slip, planned touches, and what all beliefs cost."""

import math
import time
from collections.abc import Callable, Sequence
from itertools import cycle
from statistics import fmean, median_low

import numpy

import palpate
from palpate._palpate import Random, Stream
from palpate._statistics import present
from palpate._tables import Column, Table, number, plain, print_table

from .belief_touches import Inputs, Sd
from .measures import bootstrap_record, student_record, with_interval
from .program import Json
from .trials import VOWELS, Bins, Body, Floats, Touching, make_trials, map_of, truth_of

SLIP_SEED = 800_000_000
WALK_SEED = 850_000_000
COST_SEED = 900_000_000
PLAN_SEED = 950_000_000

# Objects that move between touches.

SLIP: list[Column] = [
    ("belief", "belief", plain),
    ("mode's error, mean over touches, mm", "error_mm", with_interval(".2f")),
    ("over the second half", "late_error_mm", with_interval(".2f")),
    ("touches with the right letter, %", "located", number(".1f", 100.0)),
]


def slipping(
    trial: palpate.Recording, centroid_mm: Floats, step: Sd, seed: int
) -> tuple[palpate.Recording, list[Floats]]:
    """A trial whose object takes a step of a random walk before every touch but the first.

    A turn about its centroid and a translation, of these standard deviations. The walk begins at 3/10
    of the trial's distance from the robot frame's origin, within 3 mm along x and y, so that few walks
    of 50 steps of 0.3 mm leave a region of +-8 mm. The readings stay as they are. Returns the touches
    as the robot reports them, and the true T_object_robot [3] at each.
    """
    at_rest = truth_of(trial).T_object_robot
    here = at_rest * (0.3, 0.3, 1.0)
    steps = Random(seed, Stream.object_pose).normals(3 * len(trial)).reshape(-1, 3)
    poses, truths = [], []
    for i in range(len(trial)):
        if i > 0:
            dx, dy, turn = steps[i - 1] * (step[0], step[0], step[1])
            about = centroid_mm - palpate.transform((0.0, 0.0, turn), [centroid_mm])[0]
            here = palpate.compose((dx + about[0], dy + about[1], turn), here)
        on_object = palpate.compose(at_rest, trial.T_robot_sensor[i])
        poses.append(palpate.compose(palpate.inverse(here), on_object))
        truths.append(here)
    return palpate.Recording(trial.pressure, numpy.array(poses), trial.elements_mm), truths


def measure_slip(inputs: Inputs) -> list[Json]:
    """Unknowns that slip, as believed with and without slip_sd."""
    step = (0.3, math.radians(1.0))
    # Steps of 0.5 mm and 2 degrees resolve such slips.
    bins = (20, 20, 75) if inputs.quick else (32, 32, 180)
    touches = 12 if inputs.quick else 50
    trials = make_trials(VOWELS, inputs.each(5, 1), touches, SLIP_SEED)
    grids = [map_of(inputs.maps, trial) for trial in trials]
    walks = [
        slipping(trial, Body.of(grid).centroid_mm, step, WALK_SEED + i)
        for i, (trial, grid) in enumerate(zip(trials, grids, strict=True))
    ]
    records = Table(SLIP)
    for name, (mm, rad) in (("with slip_sd", step), ("without", (0.0, 0.0))):
        options = {"extent_mm": 8.0, "slip_sd_mm": mm, "slip_sd_deg": math.degrees(rad)}
        believed = inputs.believed([walk for walk, _ in walks], bins, (0.0, 0.0), **options)
        errors = numpy.full((len(walks), touches), numpy.nan)
        for i, (steps, (_, truths), grid) in enumerate(zip(believed, walks, grids, strict=True)):
            for j, (mode, truth) in enumerate(zip((of["mode"] for of in steps), truths)):
                if mode["object"] == grid.label:
                    pose = [mode[of] for of in ("x_mm", "y_mm", "theta_rad")]
                    errors[i, j] = palpate.pose_error_mm(grid, pose, truth)
        late = errors[:, touches // 2 :]
        record: Json = {
            "belief": name,
            "unknowns": len(walks),
            "located": float(numpy.mean(~numpy.isnan(errors))),
            "curve": [
                {"touches": i, "located": len(of), "mode_mm": fmean(of) if len(of) else None}
                for i, of in enumerate(map(present, errors.T), start=1)
            ],
        }
        for field_of, some in (("error_mm", errors), ("late_error_mm", late)):
            means = [float(there.mean()) for of in some if len(there := present(of))]
            record[field_of] = student_record(means)
        records.append(record)
    return records


# Touches chosen by what they are expected to tell, beside random ones.

PLAN: list[Column] = [
    ("touches", "order", plain),
    ("after", "touches", plain),
    ("entropy, nats", "entropy", with_interval(".2f")),
]
LEADS: list[Column] = [
    ("planned touches", "planned", plain),
    ("above so many random ones", "random", plain),
    ("entropy, nats", "entropy", with_interval(".2f")),
]


def measure_plan(inputs: Inputs) -> list[Json]:
    """Touches every unknown twice, beginning with the same random touch.

    In random order, and each time where the most is expected to be told about object and pose.
    Candidates are the poses of the test set that were not touched yet.
    """
    bins, touches = (13, 13, 55), 4 if inputs.quick else 7
    belief, whole = inputs.histogram(bins), len(palpate.training_grid())
    unknowns = make_trials(VOWELS, inputs.each(20, 1), whole, PLAN_SEED)
    entropy = {order: numpy.zeros((len(unknowns), touches)) for order in ("random", "planned")}
    for i, unknown in enumerate(unknowns):
        for order in entropy:
            belief.reset()
            left, following = list(range(whole)), 0  # the first touch is the random one
            for touch in range(touches):
                if order == "planned" and touch > 0:
                    poses, seed = unknown.T_robot_sensor[left], 1 + i * whole + touch
                    gains = belief.expected_gain(poses, unknown.elements_mm, seed=seed)
                    following = int(numpy.argmax(gains.both))
                belief.update(unknown[left.pop(following)])
                entropy[order][i, touch] = belief.entropy()
    records, table = [], Table(PLAN)
    for order, nats in entropy.items():
        curve = [
            {"touches": touch, "entropy": bootstrap_record(of)} for touch, of in enumerate(nats.T, 1)
        ]
        records.append({"order": order, "unknowns": len(unknowns), "bins": bins, "curve": curve})
        for point in curve:
            table.append({"order": order} | point)
    leads = [
        {"planned": planned, "random": random, "entropy": bootstrap_record(
            entropy["planned"][:, planned - 1] - entropy["random"][:, random - 1])}
        for planned, random in ((3, 4), (4, 6), (5, 7))
        if random <= touches
    ]  # fmt: skip
    print_table(LEADS, leads)
    return records


# Time and memory of all these.

COST_SD: Sd = (1.0, 0.05)
COSTS: list[Column] = [
    ("on bins of 5 objects", "bins", plain),
    ("median, or memory", "name", plain),
    ("value", "value", number(".4g")),
    ("unit", "unit", plain),
    ("at most", "at_most", plain),
]


def times_ms(calls: Sequence[Callable[[], object]], repeats: int) -> list[float]:
    """Median milliseconds of each of the calls, which take turns; the first turn warms up."""

    def ms(call: Callable[[], object]) -> float:
        start = time.perf_counter()
        call()
        return 1e3 * (time.perf_counter() - start)

    turns = [[ms(call) for call in calls] for _ in range(repeats + 1)]
    return [median_low(of_call) for of_call in zip(*turns[1:], strict=True)]


def measure_costs(inputs: Inputs) -> list[Json]:
    """Contenders meet the same touches in the same order, in turn."""
    records = Table(COSTS)

    def add(bins: Bins, name: str, value: float, unit: str, at_most: float | None = None) -> None:
        cells = {"bins": bins, "name": name, "value": value, "unit": unit, "at_most": at_most}
        records.append(cells)

    unknowns = make_trials(VOWELS, 1, 9, COST_SEED, Touching(at_random_poses=True))
    touches = [touch for unknown in unknowns for touch in unknown]

    def updating(belief: palpate.PoseHistogram) -> Callable[[], object]:
        following = cycle(touches)
        return lambda: belief.update(next(following))

    bins: Bins = (30, 30, 113) if inputs.quick else (100, 100, 100)
    beliefs = {
        "plain": inputs.histogram(bins),
        "uncertain": inputs.histogram(bins, touch_sd=COST_SD),
        "slip": inputs.histogram(bins, slip_sd=(0.3, math.radians(1.0))),
        "none of these": inputs.histogram(bins, none_weight=float(len(inputs.maps))),
    }
    # The object slips before every touch that counts.
    ms = times_ms([*map(updating, beliefs.values())], 3 if inputs.quick else 9)
    add(bins, "plain touch", ms[0], "ms")
    for (name, belief), of_ms in list(zip(beliefs.items(), ms, strict=True))[1:]:
        most = 2.5 if name == "uncertain" else None
        add(bins, f"touch over plain: {name}", of_ms / ms[0], "times", most)
        memory = belief.device_bytes / beliefs["plain"].device_bytes
        add(bins, f"memory over plain: {name}", memory, "times", 2.0)
    del beliefs
    bins = (25, 25, 16)
    # Places all over the unknown, which the robot could press next.
    T_robot_object = palpate.inverse(truth_of(unknowns[0]).T_object_robot)
    candidates = numpy.array(
        [palpate.compose(T_robot_object, pose) for pose in palpate.random_poses(200, COST_SEED)]
    )
    elements_mm = unknowns[0].elements_mm
    for name, sd, most, most_plan in (
        ("plain", (0.0, 0.0), None, 150.0),
        ("uncertain", COST_SD, 8.0, None),
    ):
        belief = inputs.histogram(bins, touch_sd=sd)
        update, repeats = updating(belief), 20 if inputs.quick else 300
        asked_ms = times_ms([lambda: (update(), belief.estimate())], repeats)[0]
        add(bins, f"{name} touch to estimate", asked_ms, "ms", most)
        belief.reset()
        belief.update(unknowns[0][:3])
        repeats = 2 if inputs.quick else 15
        plan_ms = times_ms([lambda: belief.expected_gain(candidates, elements_mm)], repeats)[0]
        add(bins, f"plan over 200 candidates, {name} touches", plan_ms, "ms", most_plan)
    if not inputs.quick:
        bins = (200, 200, 250)
        belief = inputs.histogram(bins, touch_sd=COST_SD)
        belief.update(touches[0])
        add(bins, "device memory", belief.device_bytes / (1 << 20), "MiB", 2048.0)
    return records
