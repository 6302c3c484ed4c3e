"""Where the errors come from that more bins do not mend."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy

import palpate
from palpate._statistics import Errors, errors_over
from palpate._tables import count_text

from .measures import differences
from .program import Json
from .trials import (
    EXACT,
    VOWELS,
    Bins,
    Touching,
    lattice_of,
    letter_maps,
    make_trials,
    training_recordings,
)
from .windows import poses_in_window


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


SHARP = sensor(psf_mm=0.25)
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
    Variant(
        "a sparse array of 3 x 3, twice the pitch",
        Touching(palpate.grid_array(3, 3, 3.8)),
        all_lattices=True,
    ),
)


def measure_limits(
    device: palpate.Device,
    quick: bool,
    lattices: Sequence[Bins],
    each: int,
    touches: int,
    seed: int,
) -> list[Json]:
    """Where the errors come from that more bins do not mend, in windows.

    Every variant is compared with the first on the first of the lattices; arrays also run on the
    others, each compared with the same array on the first.
    """
    limits: list[Json] = []
    unchanged: tuple[str, Errors, Errors] | None = None
    for variant in VARIANTS[: 2 if quick else None]:
        poses = palpate.training_grid()
        if variant.more_training:
            poses = numpy.concatenate([poses, palpate.random_poses(7 * len(poses), 12)])
        training = training_recordings(replace(variant.touching, noise=(0.0, 0.0)), poses)
        maps = letter_maps(device, training, cell_mm=variant.cell_mm, spread_mm=variant.spread_mm)
        trials = make_trials(VOWELS, each, touches, seed, variant.touching)
        against = unchanged
        for bins in lattices if variant.all_lattices else lattices[:1]:
            lattice = lattice_of(bins)
            steps = [poses_in_window(device, maps, trial, lattice) for trial in trials]
            modes, refined = [s.error_mm for s in steps], [s.refined_error_mm for s in steps]
            limits.append(
                {
                    "name": variant.name,
                    "count": math.prod(bins),
                    "elements": len(numpy.asarray(variant.touching.elements_mm)),
                    "error_mm": errors_over(modes, 20),
                    "refined_error_mm": errors_over(refined, 20),
                    "against": against and against[0],
                    "difference_mm": against and differences(modes, against[1]),
                    "refined_difference_mm": against and differences(refined, against[2]),
                }
            )
            unchanged = unchanged or (variant.name, modes, refined)
            if bins == lattices[0]:
                against = (f"{count_text(math.prod(bins))} bins", modes, refined)
    return limits
