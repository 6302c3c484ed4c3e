"""How honest beliefs are where touches are misplaced, objects slip, or nobody learned the object."""

import argparse
import json
import math
import os
import pathlib
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy

import palpate
from palpate._statistics import Errors, mean, median, present, quantile

from . import belief_charts, charts
from .measures import (
    bootstrap_mean_interval,
    bootstrap_ratio_interval,
    mean_interval,
    mean_record,
    normalised_error,
    told_apart,
    told_apart_interval,
)
from .random_numbers import Random, Stream
from .report import Json, Measurement, Report, Run, at_least_1, main, parser, share_of, write, write_json
from .trials import (
    MISFITS,
    VOWELS,
    Body,
    Floats,
    Step,
    Touching,
    judged,
    lattice_of,
    letter_maps,
    make_trials,
    size_of,
    steps_after,
    truth_of,
)

Maps = Sequence[palpate.OccupancyGrid]
Sd = tuple[float, float]  # in mm and rad

# What every part's unknowns are drawn by.
MISPLACED_SEED = 500_000_000
LEARNED_SEED = 600_000_000
UNLEARNED_SEED = 700_000_000
SLIP_SEED = 800_000_000
WALK_SEED = 850_000_000
COST_SEED = 900_000_000
PLAN_SEED = 950_000_000
TOUCH_SD_SEED = 970_000_000


@dataclass(frozen=True)
class Inputs:
    """What the parts work on."""

    device: palpate.Device
    maps: list[palpate.OccupancyGrid]
    quick: bool
    trials: int | None
    report: Report

    def each(self, usual: int, quick: int) -> int:
        """Unknowns of every letter and shape: what the flags say, else by size of the run."""
        return self.trials or (quick if self.quick else usual)

    def histogram(self, lattice: palpate.PoseLattice, **options: Any) -> palpate.PoseHistogram:
        """A belief in the letters."""
        return palpate.PoseHistogram(self.device, self.maps, lattice, **options)


def mean_of(name: str, values: Sequence[float], unit: str, most: float | None = None) -> Measurement:
    """The mean of some values and its bootstrap interval."""
    return Measurement(name, mean(values), unit, most, interval=bootstrap_mean_interval(values))


# Touches that lie beside the reported poses, as if exact and averaged.


def misplaced_errors(inputs: Inputs, steps: Sequence[Step], trials: Sequence[palpate.Recording]) -> Json:
    """[unknown] How well a belief knows its unknowns, and how well it knows that."""
    labels = [grid.label for grid in inputs.maps]
    errors: Json = {
        "right": [step.right for step in steps],
        # -log of the true letter's probability; a double still has it at full precision.
        "log_loss": [
            -math.log(max(float(step.identity[labels.index(truth_of(trial).object)]), 1e-300))
            for step, trial in zip(steps, trials, strict=True)
        ],
        "mode_mm": [step.error_mm for step in steps],
        "refined_mm": [step.refined_error_mm for step in steps],
    }
    errors["normalised_error"] = [
        normalised_error(inputs.maps[step.mode.object], step.refined, truth_of(trial).T_object_robot)
        if step.error_mm is not None
        else None
        for step, trial in zip(steps, trials, strict=True)
    ]
    return errors


def misplaced_rows(belief: str, errors: Json, touches: int, goals: bool) -> list[Measurement]:
    """A belief's errors; goals: whether they are held to goals."""
    right, normalised = errors["right"], present(errors["normalised_error"])
    late = goals and touches >= 5
    rows = [
        share_of(f"{belief}: right", sum(right), len(right)),
        mean_of(f"{belief}: log-loss of identity", errors["log_loss"], "nats",
                0.02 if goals and touches == 5 else None),
        mean_of(f"{belief}: mode's error", present(errors["mode_mm"]), "mm"),
        mean_of(f"{belief}: refined error", present(errors["refined_mm"]), "mm"),
        mean_of(f"{belief}: squared error over covariance", normalised, "of 3", 4.0 if late else None),
    ]  # fmt: skip
    if late:
        name = f"{belief}: the same, at least"
        rows.append(Measurement(name, mean(normalised), "of 3", at_least=2.0))
    return [*rows, Measurement(f"{belief}: the same, median", median(normalised), "of 2.4")]


def measure_misplaced(inputs: Inputs) -> list[Json]:
    """Both beliefs get the same touches, at random poses beside the reported ones."""
    records = []
    lattice = lattice_of(13, 13, 55) if inputs.quick else lattice_of(30, 30, 113)
    counts = (3, 5, 9, 12)
    for noise in ((1.0, 0.05), (2.0, 0.1)):
        touching = Touching(at_random_poses=True, noise=noise)
        trials = make_trials(VOWELS, inputs.each(40, 2), counts[-1], MISPLACED_SEED, touching)
        steps = {}
        for name, touch_sd in (("as if exact", (0.0, 0.0)), ("averaged", noise)):
            belief = inputs.histogram(lattice, touch_sd=touch_sd)
            steps[name] = [steps_after(belief, inputs.maps, trial, counts) for trial in trials]
        for i, touches in enumerate(counts):
            goals = noise[0] == 1.0
            rows: list[Measurement] = []
            both: dict[str, Json] = {}
            for name, of in steps.items():
                errors = both[name] = misplaced_errors(inputs, [each[i] for each in of], trials)
                rows += misplaced_rows(name, errors, touches, goals and name == "averaged")
                records.append(
                    {"noise_mm": noise[0], "noise_rad": noise[1], "touches": touches, "belief": name,
                     "right": sum(errors["right"]), "unknowns": len(trials)}
                    | {key: mean_record(present(errors[key]))
                       for key in ("log_loss", "mode_mm", "refined_mm", "normalised_error")}
                )  # fmt: skip
            exact, averaged = (both[name]["refined_mm"] for name in ("as if exact", "averaged"))
            pairs = [(a, b) for a, b in zip(averaged, exact, strict=True) if None not in (a, b)]
            above, below = [a for a, _ in pairs], [b for _, b in pairs]
            rows.append(
                Measurement(
                    "refined error, averaged over as if exact",
                    mean(above) / mean(below),
                    "times",
                    0.85 if goals and touches >= 9 else None,
                    interval=bootstrap_ratio_interval(above, below),
                )
            )
            facts = {"unknowns": len(trials), "bins": size_of(lattice)}
            inputs.report.add(f"off by {noise[0]:g} mm, {noise[1]:g} rad, touch {touches}", facts, rows)
    return records


# Standard deviations of misplaced touches, as the touches alone tell them.


def fit_touch_sd(inputs: Inputs, trials: Sequence[palpate.Recording], bins: str) -> Json:
    """What `palpate recognize --fit-touch-sd` finds for unknowns of which it is told nothing."""
    command = os.environ.get("PALPATE_COMMAND", "build/palpate")
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for i, trial in enumerate(trials):
            files.append(pathlib.Path(folder, f"{i:03}.h5"))
            trial.save(files[-1])
        for grid in inputs.maps:
            grid.save(pathlib.Path(folder, f"{grid.label}.map.h5"))
        answer = pathlib.Path(folder, "answer.json")
        subprocess.run(
            [command, "recognize", *files, "--maps", *pathlib.Path(folder).glob("*.map.h5"), "--bins", bins,
             "--x-mm=-10:10", "--y-mm=-10:10", "--fit-touch-sd", "--json", answer,
             "--device", inputs.device.name],
            check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        fit: Json = json.loads(answer.read_text())
        return fit


def measure_touch_sd(inputs: Inputs) -> list[Json]:
    """Every misplacement has unknowns of its own."""
    records = []
    touches = 6 if inputs.quick else 12
    bins = "13x13x55" if inputs.quick else "20x20x64"
    for i, mm in enumerate((0.3, 0.5, 1.0, 2.0, 0.0)):
        if inputs.quick and mm != 1.0:
            continue
        sd = {"mm": mm, "rad": 0.05 * mm}
        touching = Touching(at_random_poses=True, noise=(sd["mm"], sd["rad"]))
        trials = make_trials(VOWELS, inputs.each(10, 2), touches, TOUCH_SD_SEED + i * 5_000_000, touching)
        start = time.perf_counter()
        fit = fit_touch_sd(inputs, trials, bins)
        seconds = time.perf_counter() - start
        found, error = (
            {"mm": fit[name]["mm"], "rad": math.radians(fit[name]["deg"])}
            for name in ("touch_sd", "standard_error")
        )
        rows = []
        for name, unit in (("along x and y", "mm"), ("angle", "rad")):
            rows.append(Measurement(f"{name}, fitted", found[unit], unit))
            rows.append(Measurement(f"{name}, standard error", error[unit], unit))
            if mm > 0.0:
                share = found[unit] / sd[unit]
                rows.append(Measurement(f"{name}, fitted over true", share, "of 1"))
                off = 100.0 * abs(share - 1.0)
                rows.append(Measurement(f"{name}, off by", off, "%", at_most=20.0))
        rows.append(Measurement("log evidence above exact poses'", fit["log_evidence_gain"], "nats"))
        rows.append(Measurement("time", seconds, "s"))
        facts = {"unknowns": len(trials), "touches": touches, "bins": bins}
        inputs.report.add(f"fit of touch-sd, true {mm:g} mm, {sd['rad']:g} rad", facts, rows)
        records.append(
            {"true": sd, "fitted": found, "standard_error": error, "gain_nats": fit["log_evidence_gain"],
             "unknowns": len(trials), "touches": touches, "warnings": fit.get("warnings", [])}
        )  # fmt: skip
    return records


# "None of these", with exact and with misplaced touches.


@dataclass(frozen=True)
class NoneSetting:
    """How unknowns are touched and believed."""

    name: str
    lattice: palpate.PoseLattice
    touching: Touching = Touching()
    touch_sd: Sd = (0.0, 0.0)
    exact: bool = True  #: held to all goals
    judged: bool = True  #: held to those of learned unknowns


def none_settings(quick: bool) -> list[NoneSetting]:
    """Exact touches over growing regions, and misplaced touches."""
    settings = [NoneSetting("exact, ±10 mm", lattice_of(13, 13, 55))]
    if not quick:
        settings.append(NoneSetting("exact, ±20 mm", lattice_of(26, 26, 55, 20.0)))
        far = lattice_of(52, 52, 55, 40.0)
        settings.append(NoneSetting("exact, ±40 mm", far, exact=False, judged=False))
    lattice = lattice_of(13, 13, 55) if quick else lattice_of(20, 20, 75)
    sd = (1.0, 0.05)
    off = Touching(at_random_poses=True, noise=sd)
    return [
        *settings,
        NoneSetting("misplaced, averaged", lattice, off, sd, exact=False),
        NoneSetting("misplaced, as if exact", lattice, off, exact=False, judged=False),
    ]


def measure_none(inputs: Inputs) -> list[Json]:
    """Learned and unlearned unknowns, with none as likely before the first touch as all letters."""
    counts = (1, 3, 5, 9, 15)
    records = []
    for setting in none_settings(inputs.quick):
        each = inputs.each(40, 4)
        if setting.lattice.bins > 100_000:  # too many for all unknowns
            each = max(each // 4, 1)
        belief = inputs.histogram(
            setting.lattice, none_weight=float(len(inputs.maps)), touch_sd=setting.touch_sd
        )
        steps: dict[str, list[list[Step]]] = {}
        for who, shapes, number, seed in (
            ("learned", VOWELS, each, LEARNED_SEED),
            ("never learned", MISFITS, max(each // 2, 1), UNLEARNED_SEED),
        ):
            trials = make_trials(shapes, number, counts[-1], seed, setting.touching)
            steps[who] = [steps_after(belief, inputs.maps, trial, counts) for trial in trials]
        for i, touches in enumerate(counts):
            after = {who: [of[i] for of in all_of] for who, all_of in steps.items()}
            records.append(add_none(inputs.report, setting, touches, after))
    return records


def add_none(report: Report, setting: NoneSetting, touches: int, after: dict[str, list[Step]]) -> Json:
    """What "none of these" makes of the unknowns after some number of touches."""
    tiny = numpy.finfo(float).tiny
    odds = {
        who: [
            math.log(max(step.none, tiny)) - math.log(max(float(step.identity.sum()), tiny))
            for step in steps
        ]
        for who, steps in after.items()
    }
    called = {
        who: sum(step.none > float(step.identity.max()) for step in steps)
        for who, steps in after.items()
    }
    learned, unlearned = odds["learned"], odds["never learned"]
    low, high = told_apart_interval(learned, unlearned)
    apart = told_apart(learned, unlearned)
    least = {3: 55.0, 9: 88.0, 15: 95.0}.get(touches) if setting.exact else None
    rows = [
        share_of("learned called none", called["learned"], len(learned),
                 at_most=1.0 if setting.judged and touches > 1 else None),
        share_of("never learned called none", called["never learned"], len(unlearned), at_least=least),
        Measurement("never learned told from learned", 100.0 * apart, "% of pairs",
                    at_least=97.0 if setting.judged and touches >= 5 else None,
                    interval=(100.0 * low, 100.0 * high)),
    ]  # fmt: skip
    facts = {"learned": len(learned), "never learned": len(unlearned), "bins": size_of(setting.lattice)}
    report.add(f"{setting.name}, touch {touches}", facts, rows)
    return {
        "name": setting.name,
        "touches": touches,
        "learned_called_none": called["learned"] / len(learned),
        "unlearned_called_none": called["never learned"] / len(unlearned),
        "told_apart": apart,
        "learned_log_odds": learned,
        "unlearned_log_odds": unlearned,
    }


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
    rows, records = [], []
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
            means = [mean(there) for of in errors if (there := present(of[first:]))]
            interval = mean_interval(means) if len(means) > 2 else None
            rows.append(
                Measurement(f"{name}: mode's error, {words}", mean(means), "mm", goal, interval=interval)
            )
        by_touch = [present([of[i] for of in errors]) for i in range(touches)]
        share = 100.0 * sum(map(len, by_touch)) / (touches * len(walks))
        rows.append(Measurement(f"{name}: touches at which the mode has the right letter", share, "%"))
        curve = [
            {"touches": i, "located": len(of), "mode_mm": mean(of) if of else None}
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
                        test_set.T_robot_sensor[left], test_set.elements_mm, seed=1 + number * whole + touch
                    )
                    following = int(numpy.argmax(gains.both))
                    milliseconds.append(1e3 * (time.perf_counter() - start))
                belief.update(test_set[left.pop(following)])
                probability = max(float(belief.estimate().identity[label]), numpy.finfo(float).tiny)
                of_order[-1].append((belief.entropy(), -math.log(probability)))
    after = {
        (order, touch): [of[touch - 1][0] for of in all_of]
        for order, all_of in told.items()
        for touch in range(1, touches + 1)
    }
    rows = [
        mean_of(f"entropy, {order}, touch {touch}", after[order, touch], "nats")
        for touch in range(1, touches + 1)
        for order in told
    ]
    for planned, random in ((3, 4), (4, 6), (5, 7)):
        if random <= touches:
            pairs = zip(after["planned", planned], after["random", random], strict=True)
            name = f"{planned} planned above {random} random"
            rows.append(mean_of(name, [a - b for a, b in pairs], "nats", 0.1))
    rows.append(Measurement("plan, median", median(milliseconds), "ms"))
    facts = {"unknowns": len(told["random"]), "bins": size_of(lattice)}
    inputs.report.add("planned touches", facts, rows)
    return [
        {
            "order": order,
            "curve": [
                {
                    "touches": touch,
                    "entropy": mean_record(after[order, touch]),
                    "log_loss": mean_record([of[touch - 1][1] for of in all_of]),
                }
                for touch in range(1, touches + 1)
            ],
        }
        for order, all_of in told.items()
    ]


# Time and memory of all these.

COST_SD: Sd = (1.0, 0.05)


def median_ms(call: Callable[[], object], repeats: int) -> float:
    """Median milliseconds of some calls, after one that is not counted."""
    call()
    return median([_ms(call) for _ in range(repeats)])


def _ms(call: Callable[[], object]) -> float:
    start = time.perf_counter()
    call()
    return 1e3 * (time.perf_counter() - start)


def measure_costs(inputs: Inputs) -> list[Json]:
    """Contenders meet the same touches in the same order, in turn."""
    unknowns = make_trials(VOWELS, 1, 9, COST_SEED, Touching(at_random_poses=True))
    touches = [touch for unknown in unknowns for touch in unknown]
    sizes = {"objects": len(inputs.maps), "touch_sd": "1 mm, 0.05 rad"}
    lattice = lattice_of(30, 30, 113) if inputs.quick else lattice_of(100, 100, 100)
    repeats = 3 if inputs.quick else 9
    beliefs = [
        inputs.histogram(lattice, **options)
        for options in (
            {},
            {"touch_sd": COST_SD},
            {"slip_sd": (0.3, math.pi / 180.0)},
            {"none_weight": float(len(inputs.maps))},
        )
    ]
    taken: list[list[float]] = [[] for _ in beliefs]
    for i in range(repeats + 1):  # the first touch warms up; the object slips before the second
        for belief, milliseconds in zip(beliefs, taken, strict=True):
            spent = _ms(lambda belief=belief, i=i: belief.update(touches[i % len(touches)]))  # type: ignore[misc]
            milliseconds += [spent] if i > 0 else []
    ms = [median(each) for each in taken]
    memory = [belief.device_bytes / beliefs[0].device_bytes for belief in beliefs]
    inputs.report.add(
        f"touch {size_of(lattice)}",
        sizes | {"slip_sd": "0.3 mm, 1 degree", "repeats": repeats},
        [
            Measurement("plain touch, median", ms[0], "ms"),
            Measurement("uncertain touch, median", ms[1], "ms"),
            Measurement("uncertain over plain", ms[1] / ms[0], "times", at_most=2.5),
            Measurement("touch after a slip over plain", ms[2] / ms[0], "times"),
            Measurement("touch with none of these over plain", ms[3] / ms[0], "times"),
            Measurement("memory, uncertain over plain", memory[1], "times", at_most=2.0),
            Measurement("memory, slip over plain", memory[2], "times", at_most=2.0),
            Measurement("memory, none of these over plain", memory[3], "times", at_most=2.0),
        ],
    )
    del beliefs
    small, repeats = lattice_of(25, 25, 16), 20 if inputs.quick else 300
    latencies: dict[Sd, list[float]] = {(0.0, 0.0): [], COST_SD: []}
    for sd, milliseconds in latencies.items():
        belief = inputs.histogram(small, touch_sd=sd)
        for i in range(repeats + 1):
            touch = touches[i % len(touches)]
            start = time.perf_counter()
            belief.update(touch)
            belief.estimate()
            spent = 1e3 * (time.perf_counter() - start)
            milliseconds += [spent] if i > 0 else []
    plain, uncertain = latencies.values()
    inputs.report.add(
        f"latency {size_of(small)}, uncertain",
        sizes | {"repeats": repeats},
        [
            Measurement("touch to estimate, median", median(uncertain), "ms", at_most=8.0),
            Measurement("95th percentile", quantile(uncertain, 0.95), "ms"),
            Measurement("plain touch to estimate, median", median(plain), "ms"),
        ],
    )
    # Places all over the unknown, which the robot could press next.
    T_robot_object = palpate.inverse(truth_of(unknowns[0]).T_object_robot)
    places = [palpate.compose(T_robot_object, pose) for pose in palpate.random_poses(200, COST_SEED)]
    candidates, repeats, plans = numpy.array(places), 2 if inputs.quick else 15, []
    for sd in ((0.0, 0.0), COST_SD):
        belief = inputs.histogram(small, touch_sd=sd)
        belief.update(unknowns[0][:3])
        plans.append(
            median_ms(lambda: belief.expected_gain(candidates, unknowns[0].elements_mm), repeats)
        )
    inputs.report.add(
        f"plan {size_of(small)}",
        {"objects": len(inputs.maps), "candidates": len(candidates), "repeats": repeats},
        [
            Measurement("exact touches, median", plans[0], "ms", at_most=150.0),
            Measurement("uncertain touches, median", plans[1], "ms"),
        ],
    )
    if not inputs.quick:
        large = lattice_of(200, 200, 250)
        belief = inputs.histogram(large, touch_sd=COST_SD)
        seconds = _ms(lambda: belief.update(touches[0])) / 1e3
        mib = belief.device_bytes / (1 << 20)
        inputs.report.add(
            f"touch {size_of(large)}",
            sizes,
            [
                Measurement("device memory", mib, "MiB", at_most=2048.0),
                Measurement("uncertain touch", seconds, "s"),
            ],
        )
    return []


PARTS: dict[str, Callable[[Inputs], list[Json]]] = {
    "misplaced": measure_misplaced,
    "touch-sd": measure_touch_sd,
    "none": measure_none,
    "slip": measure_slip,
    "plan": measure_plan,
    "cost": measure_costs,
}


def program() -> None:
    """Reads the flags and measures."""
    flags = parser(
        "beliefs",
        "Measures how honest beliefs are, in some 40 minutes on two CPU cores: misplaced touches, how "
        "well touches tell how far they are misplaced, objects never learned, objects that slip, planned "
        "touches, and what each costs.",
        plots="draw charts in this folder",
    )
    flags.add_argument("--part", choices=PARTS, help="measure only this part")
    flags.add_argument(
        "--trials", type=at_least_1, help="unknowns per letter and shape [each part's own]"
    )
    options = flags.parse_args()
    parts = [options.part] if options.part else list(PARTS)
    names = [name for part in parts for name in belief_charts.FIGURES.get(part, ())]
    pictures = [belief_charts.PICTURE] if "misplaced" in parts else []
    run = Run(options, {"plots": [*charts.files(names), *pictures]})
    inputs = Inputs(run.device, letter_maps(run.device), options.quick, options.trials, Report(run.facts))
    records: dict[str, list[Json]] = {}
    for part in parts:
        records[part] = PARTS[part](inputs)
        charts.save(belief_charts.draw(part, records[part]), options.plots)
    if options.plots and pictures:
        picture = belief_charts.draw_misplaced_unknown(run.device, inputs.maps, MISPLACED_SEED)
        write(pathlib.Path(options.plots, belief_charts.PICTURE), picture)
    write_json(options.json, inputs.report.document() | records)


if __name__ == "__main__":
    main(program)
