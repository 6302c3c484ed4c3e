"""What the sweep measures, in which order."""

import argparse
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import palpate

from .trials import TABLE_1, VOWELS, Bins, make_trials

Maps = Sequence[palpate.OccupancyGrid]
Trials = Sequence[palpate.Recording]

#: The goal's lattice: balanced, about a million bins.
GOAL_BINS: Bins = (64, 64, 244)
GOAL_CELL_MM = 0.5
TOUCHES = 15
SEED = 1_000  # the experiment's
#: Bins of every object, or particles for each, whose log-likelihood is held against float64.
SAMPLED = 200
#: Bins of all objects above which --filter auto takes bounds.
AUTO_RULE = 100_000


def product(bins: Bins) -> int:
    """Bins per object."""
    return math.prod(bins)


def scaled(count: float) -> Bins:
    """A lattice of some number of bins in the proportions of the goal's."""
    factor = (count / product(GOAL_BINS)) ** (1.0 / 3.0)
    x, y, theta = (max(1, math.floor(factor * n + 0.5)) for n in GOAL_BINS)
    return x, y, theta


@dataclass(frozen=True)
class CellPlan:
    """What is run on maps of one cell size."""

    cell_mm: float
    lattices: list[Bins]
    particles: list[int] = field(default_factory=list)
    bounded: list[Bins] = field(default_factory=list)


@dataclass(frozen=True)
class Plan:
    """What is measured, in this order."""

    quick: bool
    trials_each: int  #: for every letter
    cells: list[CellPlan]
    limits: list[Bins]

    def full_each(self, cell_mm: float, bins: Bins) -> int:
        """Trials of every letter that get the full posterior: all of them on the goal's lattice."""
        most_full, most_twice = (50_000, 50_000) if self.quick else (320_000, 1_200_000)
        if product(bins) <= most_full or (bins, cell_mm) == (GOAL_BINS, GOAL_CELL_MM):
            return self.trials_each
        return min(self.trials_each, 2 if product(bins) <= most_twice else 1)

    def bounded_each(self, bins: Bins) -> int:
        """Trials of every letter for measure_bounds()."""
        return min(self.trials_each, 1 if self.quick or product(bins) > 1_200_000 else 4)

    def trials(self, each: int) -> list[palpate.Recording]:
        """The first trials of every letter."""
        return make_trials(VOWELS, each, TOUCHES, SEED)

    @staticmethod
    def of(options: argparse.Namespace) -> "Plan":
        """By the flags --quick, --trials and --max-bins."""
        quick = options.quick
        # Counts are those nearest to what was asked for.
        most = 1.1 * (options.max_bins or (100_000 if quick else 10_000_000))

        def lattices(counts: Sequence[float], others: Sequence[Bins] = ()) -> list[Bins]:
            some = [bins for bins in (*map(scaled, counts), *others) if product(bins) <= most]
            return sorted(some, key=product)

        decades = [10.0**power for power in range(2, 8)]
        if quick:
            cells = [
                CellPlan(1.0, lattices([1e3, 1e4, 1e5])),
                CellPlan(GOAL_CELL_MM, lattices([1e2, 1e3, 1e4, 1e5], TABLE_1), [1_000, 10_000],
                         lattices([1e2, 1e3, 1e4, 1e5])),
            ]  # fmt: skip
        else:
            counts = [1e2, 1e3, 1e4, 3e4, 1e5, 3e5, 1e6, 3e6, 1e7]
            cells = [
                CellPlan(1.0, lattices(decades)),
                CellPlan(GOAL_CELL_MM, lattices(counts, TABLE_1),
                         [100, 1_000, 10_000, 100_000, 1_000_000],
                         lattices([1e3, 3e3, 1e4, 2e4, 3e4, 1e5, 1e6, 1e7])),
                CellPlan(0.25, lattices(decades)),
            ]  # fmt: skip
        limits = [scaled(1e5)] if quick else [GOAL_BINS, scaled(3e5), scaled(3e6)]
        return Plan(quick, options.trials or (4 if quick else 10), cells, limits)
