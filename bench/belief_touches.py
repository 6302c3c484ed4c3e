"""Misplaced touches, and "none of these"."""

import json
import math
import os
import pathlib
import subprocess
import tempfile
import time
from collections.abc import Sequence
from statistics import fmean, median_low
from typing import Any, NamedTuple

import numpy

import palpate
from palpate._statistics import present

from .measures import (
    bootstrap_mean_interval,
    bootstrap_ratio_interval,
    mean_record,
    normalised_error,
    told_apart,
)
from .report import Json, Measurement, Report, share_of
from .trials import (
    MISFITS,
    VOWELS,
    Step,
    Touching,
    lattice_of,
    make_trials,
    size_of,
    steps_after,
    truth_of,
)

MISPLACED_SEED = 500_000_000
LEARNED_SEED = 600_000_000
UNLEARNED_SEED = 700_000_000
TOUCH_SD_SEED = 970_000_000


Sd = tuple[float, float]  # in mm and rad


class Inputs(NamedTuple):
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


def mean_of(
    name: str, values: Sequence[float], unit: str, most: float | None = None
) -> Measurement:
    """The mean of some values and its bootstrap interval."""
    return Measurement(name, fmean(values), unit, most, interval=bootstrap_mean_interval(values))


# Touches that lie beside the reported poses, as if exact and averaged.


def misplaced_errors(
    inputs: Inputs, steps: Sequence[Step], trials: Sequence[palpate.Recording]
) -> Json:
    """[unknown] How well a belief knows its unknowns, and how well it knows that."""
    labels = [grid.label for grid in inputs.maps]
    errors: Json = {"log_loss": [], "normalised_error": []}
    for step, truth in zip(steps, map(truth_of, trials), strict=True):
        # -log of the true letter's probability; a double still has it at full precision.
        probability = float(step.identity[labels.index(truth.object)])
        errors["log_loss"].append(-math.log(max(probability, 1e-300)))
        if step.error_mm is not None:
            located, pose = inputs.maps[step.mode.object], truth.T_object_robot
            errors["normalised_error"].append(normalised_error(located, step.refined, pose))
    return errors | {
        "mode_mm": [step.error_mm for step in steps],
        "refined_mm": [step.refined_error_mm for step in steps],
    }


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
            rows: list[tuple[Any, ...]] = []
            refined_mm = {}
            for name, of in steps.items():
                after = [each[i] for each in of]
                right = sum(step.right for step in after)
                errors = misplaced_errors(inputs, after, trials)
                refined_mm[name] = errors["refined_mm"]
                goals = noise[0] == 1.0 and name == "averaged"
                loss, nees = errors["log_loss"], errors["normalised_error"]
                most, least = (4.0, 2.0) if goals and touches >= 5 else (None, None)
                rows += [
                    share_of(f"{name}: right", right, len(trials)),
                    mean_of(f"{name}: log-loss of identity", loss, "nats",
                            0.02 if goals and touches == 5 else None),
                    mean_of(f"{name}: mode's error", present(errors["mode_mm"]), "mm"),
                    mean_of(f"{name}: refined error", present(refined_mm[name]), "mm"),
                    mean_of(f"{name}: squared error over covariance", nees, "of 3", most),
                ]  # fmt: skip
                if least:
                    rows.append((f"{name}: the same, at least", fmean(nees), "of 3", None, least))
                rows.append((f"{name}: the same, median", median_low(nees), "of 2.4"))
                records.append(
                    {"noise_mm": noise[0], "noise_rad": noise[1], "touches": touches}
                    | {"belief": name, "right": right, "unknowns": len(trials)}
                    | {key: mean_record(present(of_key)) for key, of_key in errors.items()}
                )
            both = zip(refined_mm["averaged"], refined_mm["as if exact"], strict=True)
            above, below = zip(*[pair for pair in both if None not in pair], strict=True)
            name, ratio = "refined error, averaged over as if exact", fmean(above) / fmean(below)
            most = 0.85 if noise[0] == 1.0 and touches >= 9 else None
            interval = bootstrap_ratio_interval(above, below)
            rows.append(Measurement(name, ratio, "times", most, interval=interval))
            facts = {"unknowns": len(trials), "bins": size_of(lattice)}
            name = f"off by {noise[0]:g} mm, {noise[1]:g} rad, touch {touches}"
            inputs.report.add(name, facts, rows)
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
            [command, "recognize", *files, "--maps", *pathlib.Path(folder).glob("*.map.h5"),
             "--bins", bins, "--x-mm=-10:10", "--y-mm=-10:10", "--fit-touch-sd", "--json", answer,
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
        trials = make_trials(
            VOWELS, inputs.each(10, 2), touches, TOUCH_SD_SEED + i * 5_000_000, touching
        )
        start = time.perf_counter()
        fit = fit_touch_sd(inputs, trials, bins)
        seconds = time.perf_counter() - start
        found, error = (
            {"mm": fit[name]["mm"], "rad": math.radians(fit[name]["deg"])}
            for name in ("touch_sd", "standard_error")
        )
        rows: list[tuple[Any, ...]] = []
        for name, unit in (("along x and y", "mm"), ("angle", "rad")):
            rows.append((f"{name}, fitted", found[unit], unit))
            rows.append((f"{name}, standard error", error[unit], unit))
            if mm > 0.0:
                share = found[unit] / sd[unit]
                rows.append((f"{name}, fitted over true", share, "of 1"))
                rows.append((f"{name}, off by", 100.0 * abs(share - 1.0), "%", 20.0))
        rows.append(("log evidence above exact poses'", fit["log_evidence_gain"], "nats"))
        rows.append(("time", seconds, "s"))
        facts = {"unknowns": len(trials), "touches": touches, "bins": bins}
        inputs.report.add(f"fit of touch-sd, true {mm:g} mm, {sd['rad']:g} rad", facts, rows)
        records.append(
            {"true": sd, "fitted": found, "standard_error": error, "gain_nats": fit["log_evidence_gain"],
             "unknowns": len(trials), "touches": touches, "warnings": fit.get("warnings", [])}
        )  # fmt: skip
    return records


# "None of these", with exact and with misplaced touches.


class NoneSetting(NamedTuple):
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


def add_none(
    report: Report, setting: NoneSetting, touches: int, after: dict[str, list[Step]]
) -> Json:
    """What "none of these" makes of the unknowns after some number of touches."""
    tiny = numpy.finfo(float).tiny

    def log(probability: float) -> float:
        return math.log(max(float(probability), tiny))

    def called(steps: Sequence[Step]) -> int:
        return sum(step.none > float(step.identity.max()) for step in steps)

    learned, unlearned = (
        [log(step.none) - log(step.identity.sum()) for step in steps] for steps in after.values()
    )
    learned_none, unlearned_none = map(called, after.values())
    apart, (low, high) = told_apart(learned, unlearned)
    least = {3: 55.0, 9: 88.0, 15: 95.0}.get(touches) if setting.exact else None
    most = 1.0 if setting.judged and touches > 1 else None
    least_apart = 97.0 if setting.judged and touches >= 5 else None
    interval = (100.0 * low, 100.0 * high)
    rows = [
        share_of("learned called none", learned_none, len(learned), at_most=most),
        share_of("never learned called none", unlearned_none, len(unlearned), at_least=least),
        (
            "never learned told from learned",
            100.0 * apart,
            "% of pairs",
            None,
            least_apart,
            interval,
        ),
    ]
    facts: Json = {"learned": len(learned), "never learned": len(unlearned)}
    facts["bins"] = size_of(setting.lattice)
    report.add(f"{setting.name}, touch {touches}", facts, rows)
    return {
        "name": setting.name,
        "touches": touches,
        "learned_called_none": learned_none / len(learned),
        "unlearned_called_none": unlearned_none / len(unlearned),
        "told_apart": apart,
        "learned_log_odds": learned,
        "unlearned_log_odds": unlearned,
    }
