"""Misplaced touches, and "none of these"."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy

import palpate
from palpate._statistics import present, quantile
from palpate._tables import Column, Table, column, number, plain

from .measures import bootstrap_record, normalised_error, share_record, told_apart, with_interval
from .program import Json
from .trials import (
    MISFITS,
    VOWELS,
    Bins,
    Touching,
    lattice_of,
    make_trials,
    map_of,
    recognized,
    truth_of,
)

MISPLACED_SEED = 500_000_000
LEARNED_SEED = 600_000_000
UNLEARNED_SEED = 700_000_000
TOUCH_SD_SEED = 970_000_000

Sd = tuple[float, float]  # in mm and rad
_PERCENT = with_interval(".1f", 100.0)


class Inputs(NamedTuple):
    """What the parts work on."""

    device: palpate.Device
    maps: list[palpate.OccupancyGrid]
    quick: bool
    trials: int | None

    def each(self, usual: int, quick: int) -> int:
        """Unknowns of every letter and shape: what the flags say, else by size of the run."""
        return self.trials or (quick if self.quick else usual)

    def histogram(self, bins: Bins, **options: Any) -> palpate.PoseHistogram:
        """A belief in the letters."""
        return palpate.PoseHistogram(self.device, self.maps, lattice_of(bins), **options)

    def believed(
        self, trials: Sequence[palpate.Recording], bins: Bins, touch_sd: Sd, **options: Any
    ) -> list[list[Json]]:
        """What the histogram says of unknowns whose touches are known to `touch_sd`."""
        mm, deg = touch_sd[0], math.degrees(touch_sd[1])
        return recognized(
            self.device, self.maps, trials, filter="histogram", bins=bins, touch_sd_mm=mm,
            touch_sd_deg=deg, **options,
        )  # fmt: skip


# Touches that lie beside the reported poses, as if exact and averaged.

MISPLACED: list[Column] = [
    ("off by", "off_by", plain),
    ("touches", "touches", plain),
    ("belief", "belief", plain),
    ("right, %", "right", _PERCENT),
    ("log-loss, nats", "log_loss", with_interval(".3f")),
    ("refined error, mm", "refined_mm", with_interval(".2f")),
    ("over as if exact", "ratio", with_interval(".2f")),
    ("NEES: mean", "normalised_error", with_interval(".3g")),
    ("median", "median_normalised_error", number(".1f")),
]


def normalised_errors(
    inputs: Inputs, steps: Sequence[Json], trials: Sequence[palpate.Recording]
) -> list[float]:
    """NEES of the refined poses, of the unknowns whose mode has the right letter."""
    return [
        normalised_error(
            map_of(inputs.maps, trial),
            [step["refined"][of] for of in ("x_mm", "y_mm", "theta_rad")],
            step["refined"]["covariance"],
            truth_of(trial).T_object_robot,
        )
        for step, trial in zip(steps, trials, strict=True)
        if step["error_mm"] is not None
    ]


def measure_misplaced(inputs: Inputs) -> list[Json]:
    """Both beliefs get the same touches, at random poses beside the reported ones."""
    records = Table(MISPLACED)
    bins, counts = (13, 13, 55) if inputs.quick else (30, 30, 113), (3, 5, 9, 12)
    for noise in ((1.0, 0.05), (2.0, 0.1)):
        touching = Touching(at_random_poses=True, noise=noise)
        trials = make_trials(VOWELS, inputs.each(40, 2), counts[-1], MISPLACED_SEED, touching)
        exact, averaged = (inputs.believed(trials, bins, sd) for sd in ((0.0, 0.0), noise))
        for touches in counts:
            exact_mm = column([of[touches - 1] for of in exact], "refined_error_mm")
            for name, steps in (("as if exact", exact), ("averaged", averaged)):
                after = [of[touches - 1] for of in steps]
                # A double still has the true letter's probability at full precision.
                losses = [
                    -math.log(max(step["identity"][truth_of(trial).object], 1e-300))
                    for step, trial in zip(after, trials, strict=True)
                ]
                nees = normalised_errors(inputs, after, trials)
                refined_mm = column(after, "refined_error_mm")
                both = ~numpy.isnan(refined_mm + exact_mm)
                records.append(
                    {
                        "noise_mm": noise[0],
                        "noise_rad": noise[1],
                        "off_by": f"{noise[0]:g} mm, {noise[1]:g} rad",
                        "touches": touches,
                        "belief": name,
                        "unknowns": len(trials),
                        "right": share_record(column(after, "right").sum(), len(trials)),
                        "log_loss": bootstrap_record(losses),
                        "refined_mm": bootstrap_record(present(refined_mm)),
                        "ratio": bootstrap_record(refined_mm[both], exact_mm[both]),
                        "normalised_error": bootstrap_record(nees),
                        "median_normalised_error": quantile(nees, 0.5),
                    }
                )
    return records


# "None of these", with exact and with misplaced touches.

NONE: list[Column] = [
    ("touches", "name", plain),
    ("after", "touches", plain),
    ("learned called none, %", "learned_called_none", _PERCENT),
    ("never learned called none, %", "unlearned_called_none", _PERCENT),
    ("pairs told apart, %", "told_apart", _PERCENT),
]


def none_settings(quick: bool) -> list[tuple[str, Bins, float, Touching, Sd]]:
    """How unknowns are touched and believed: a name, bins, the region's extent, touching and touch_sd.

    Exact touches over growing regions, and misplaced touches.
    """
    bins, exact, sd = (13, 13, 55) if quick else (20, 20, 75), Touching(), (1.0, 0.05)
    off = Touching(at_random_poses=True, noise=sd)
    return [
        ("exact, ±10 mm", (13, 13, 55), 10.0, exact, (0.0, 0.0)),
        *(
            (f"exact, ±{10 * times} mm", (13 * times, 13 * times, 55), 10.0 * times, exact, (0.0, 0.0))
            for times in (() if quick else (2, 4))
        ),
        ("misplaced, averaged", bins, 10.0, off, sd),
        *(() if quick else [("misplaced, as if exact", bins, 10.0, off, (0.0, 0.0))]),
    ]


def log_odds_of_none(step: Json) -> float:
    """Log odds, in nats, of (none) over all letters together."""
    none = step["none"]
    letters = sum(of for label, of in step["identity"].items() if label != "(none)")
    tiny = numpy.finfo(float).tiny
    return math.log(max(none, tiny)) - math.log(max(letters, tiny))


def measure_none(inputs: Inputs) -> list[Json]:
    """Learned and unlearned unknowns, with none as likely before the first touch as all letters."""
    records, counts = Table(NONE), (1, 3, 9) if inputs.quick else (1, 3, 5, 9, 15)
    for name, bins, extent_mm, touching, touch_sd in none_settings(inputs.quick):
        each = inputs.each(40, 4)
        if math.prod(bins) > 100_000:  # too many for all unknowns
            each = max(each // 4, 1)
        options = {"extent_mm": extent_mm, "none": float(len(inputs.maps))}
        learned, unlearned = (
            inputs.believed(
                make_trials(shapes, number, counts[-1], seed, touching), bins, touch_sd, **options
            )
            for shapes, number, seed in (
                (VOWELS, each, LEARNED_SEED),
                (MISFITS, max(each // 2, 1), UNLEARNED_SEED),
            )
        )
        for touches in counts:
            record: Json = {"name": name, "touches": touches}
            for who, steps in (("learned", learned), ("unlearned", unlearned)):
                after = [of[touches - 1] for of in steps]
                called = sum(step["best"] == "(none)" for step in after)
                record[f"{who}_called_none"] = share_record(called, len(after))
                record[f"{who}_log_odds"] = [*map(log_odds_of_none, after)]
            record["told_apart"] = told_apart(
                record["learned_log_odds"], record["unlearned_log_odds"]
            )
            records.append(record)
    return records
