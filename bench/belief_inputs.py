"""What the parts of `./dev bench beliefs` work on."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import palpate
from palpate._statistics import mean

from .measures import bootstrap_mean_interval
from .report import Measurement, Report

Sd = tuple[float, float]  # in mm and rad


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


def mean_of(
    name: str, values: Sequence[float], unit: str, most: float | None = None
) -> Measurement:
    """The mean of some values and its bootstrap interval."""
    return Measurement(name, mean(values), unit, most, interval=bootstrap_mean_interval(values))
