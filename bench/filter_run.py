"""What a filter makes of all trials, after each of their touches."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import palpate
from palpate._statistics import errors_over, mean

from .measures import calibration, wilson_interval
from .report import Json
from .trials import Bins

PARTICLE_SEED = 1
REGION: dict[str, Any] = {"x_mm": (-10, 10), "y_mm": (-10, 10), "pivot_mm": (0, 0)}

Step = dict[str, Any]


@dataclass(frozen=True)
class FilterRun:
    """What one filter made of all trials."""

    filter: str  #: "histogram", "particles" or "augmented"
    name: str  #: with its size, such as "histogram 25x25x16"
    count: int  #: bins per object, or particles in all
    steps: list[list[Step]]  #: [trial][touch] records as of `palpate recognize --trace`
    labels: list[str]  #: [trial] the true objects
    seconds: float  #: of all trials

    def after(self, touch: int) -> list[Step]:
        """[trial] What the filter says after `touch` touches."""
        return [steps[touch - 1] for steps in self.steps]

    @property
    def touches(self) -> int:
        """Touches of every trial."""
        return len(self.steps[0])

    def curve(self) -> list[Json]:
        """After 1, 2, ... touches: accuracy, confidence, and errors of modes and refined poses."""
        curve = []
        for touch in range(1, self.touches + 1):
            steps = self.after(touch)
            right = sum(step["right"] for step in steps)
            low, high = wilson_interval(right, len(steps))
            errors = errors_over([step.get("error_mm") for step in steps])
            refined = errors_over([step.get("refined_error_mm") for step in steps])
            curve.append(
                {
                    "touches": touch,
                    "accuracy": right / len(steps),
                    "accuracy_low": low,
                    "accuracy_high": high,
                    "mean_confidence": mean([confidence(step) for step in steps]),
                    "located": errors["trials"] if errors else 0,
                    "error_mm": errors,
                    "refined_error_mm": refined,
                }
            )
        return curve

    def calibration(self) -> dict[str, Any]:
        """Over all trials and touches; see measures.calibration()."""
        steps = [step for steps in self.steps for step in steps]
        return calibration([confidence(step) for step in steps], [step["right"] for step in steps])

    def record(self) -> Json:
        """The run as it stands in the document."""
        return {
            "filter": self.filter,
            "name": self.name,
            "count": self.count,
            "seconds": self.seconds,
            "curve": self.curve(),
            "calibration": self.calibration(),
        }


def confidence(step: Step) -> float:
    """Probability of the most probable object."""
    return float(step["identity"][step["best"]])


def run_histogram(
    device: palpate.Device,
    maps: Sequence[palpate.OccupancyGrid],
    bins: Bins,
    trials: Sequence[palpate.Recording],
) -> FilterRun:
    """The histogram filter over the trials, with a step after every touch."""
    start = time.perf_counter()
    records = palpate.recognize(
        trials, maps, bins=bins, filter="histogram", trace=True, device=device, **REGION
    )
    name = "histogram " + "x".join(map(str, bins))
    return _run("histogram", name, bins[0] * bins[1] * bins[2], records, trials, start)


def run_particles(
    device: palpate.Device,
    maps: Sequence[palpate.OccupancyGrid],
    count: int,
    trials: Sequence[palpate.Recording],
    *,
    augmented: bool = False,
    resampling: Literal["multinomial", "systematic"] = "multinomial",
) -> FilterRun:
    """The particle filter over the trials; each trial has a seed of its own."""
    start = time.perf_counter()
    records = [
        palpate.recognize(
            trial, maps, filter="particles", particles=count, seed=PARTICLE_SEED + i,
            augmented=augmented, resampling=resampling, trace=True, device=device, **REGION,
        )[0]
        for i, trial in enumerate(trials)
    ]  # fmt: skip
    kind = "augmented" if augmented else "systematic" if resampling == "systematic" else "particles"
    name = f"{'augmented MCL' if augmented else kind} {count}"
    return _run(kind, name, count, records, trials, start)


def _run(
    kind: str,
    name: str,
    count: int,
    records: Sequence[palpate.Record],
    trials: Sequence[palpate.Recording],
    start: float,
) -> FilterRun:
    labels = [trial.truth.object for trial in trials if trial.truth]
    seconds = time.perf_counter() - start
    return FilterRun(kind, name, count, [record["trace"] for record in records], labels, seconds)


def as_many(a: int, b: int) -> bool:
    """Whether two counts agree within a tenth.

    Whole numbers of balanced bins along each axis rarely multiply to a given count.
    """
    return 10 * abs(a - b) <= max(a, b)


def equal_counts(runs: Sequence[FilterRun]) -> list[tuple[FilterRun, FilterRun]]:
    """All pairs of a histogram and a particle filter with as many particles as bins per object."""
    return [
        (histogram, particles)
        for particles in runs
        for histogram in runs
        if particles.filter != "histogram" and histogram.filter == "histogram"
        if as_many(histogram.count, particles.count)
    ]
