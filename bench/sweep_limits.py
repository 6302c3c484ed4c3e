"""Where the errors come from that more bins do not mend."""

from dataclasses import dataclass, replace

import numpy

import palpate
from palpate._statistics import Errors
from palpate._sweep_runs import errors_record
from palpate._tables import count_text

from .measures import Paired
from .report import Json
from .sweep_plan import SEED, TOUCHES, Plan, product
from .trials import (
    EXACT,
    VOWELS,
    Touching,
    lattice_of,
    letter_maps,
    make_trials,
    training_recordings,
)
from .windows import estimate_in_window


@dataclass(frozen=True)
class Variant:
    """What is changed. The sensor holds for training and trials alike."""

    name: str
    touching: Touching = EXACT
    cell_mm: float = 0.5
    spread_mm: float = 0.5
    more_training: bool = False
    all_lattices: bool = False


def variants_of(quick: bool) -> list[Variant]:
    """One thing at a time; the first changes nothing."""

    def sensor(**changed: float) -> Touching:
        return Touching(sensor=palpate.SensorModel(**changed))

    variants = [
        Variant("as it is", all_lattices=True),
        Variant("a sensor without noise", sensor(noise_kpa=0.0)),
    ]
    if quick:
        return variants
    sharp = sensor(psf_mm=0.25)
    return [
        *variants,
        Variant("equal gains and press forces", sensor(force_spread=0.0, gain_spread=0.0)),
        Variant("a point spread of 0.25 mm", sharp),
        Variant("a point spread of 0.25 mm, and maps of that spread and cells", sharp, 0.25, 0.125),
        Variant("maps of 0.25 mm cells", cell_mm=0.25),
        Variant("8 times the training touches", more_training=True),
        Variant("touches at random poses", Touching(at_random_poses=True)),
        Variant("touches displaced by 1 mm and 0.05 rad", Touching(noise=(1.0, 0.05))),
        Variant(
            "an array of 16 x 16", Touching(palpate.grid_array(16, 16, 1.9)), all_lattices=True
        ),
        Variant(
            "a sparse array of 3 x 3, twice the pitch",
            Touching(palpate.grid_array(3, 3, 3.8)),
            all_lattices=True,
        ),
    ]


def measure_limits(device: palpate.Device, plan: Plan) -> list[Json]:
    """Where the errors come from that more bins do not mend, in windows.

    Every variant is compared with the first on the first of the plan's lattices; arrays also run on
    the others, each compared with the same array on the first.
    """
    each = min(plan.trials_each, 2) if plan.quick else plan.trials_each
    limits: list[Json] = []
    unchanged: tuple[str, Errors, Errors] | None = None
    for variant in variants_of(plan.quick):
        grid = palpate.training_grid()
        poses = numpy.concatenate([grid, palpate.random_poses(7 * len(grid), 12)])
        training = training_recordings(replace(variant.touching, noise=(0.0, 0.0)),
                                       poses if variant.more_training else grid)  # fmt: skip
        maps = letter_maps(device, training, cell_mm=variant.cell_mm, spread_mm=variant.spread_mm)
        trials = make_trials(VOWELS, each, TOUCHES, SEED, variant.touching)
        against = unchanged
        for bins in plan.limits if variant.all_lattices else plan.limits[:1]:
            lattice = lattice_of(*bins)
            steps = [estimate_in_window(device, maps, trial, lattice) for trial in trials]
            modes, refined = [s.error_mm for s in steps], [s.refined_error_mm for s in steps]
            limits.append(
                {
                    "name": variant.name,
                    "count": product(bins),
                    "elements": len(numpy.asarray(variant.touching.elements_mm)),
                    "error_mm": errors_record(modes),
                    "refined_error_mm": errors_record(refined),
                    "against": against and against[0],
                    "difference_mm": against and Paired.of(modes, against[1]).difference(),
                    "refined_difference_mm": against
                    and Paired.of(refined, against[2]).difference(),
                }
            )
            unchanged = unchanged or (variant.name, modes, refined)
            if bins == plan.limits[0]:
                against = (f"{count_text(product(bins))} bins", modes, refined)
    return limits
