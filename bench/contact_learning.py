"""What presses of people on a real array tell of people who are not among them.

Settings are chosen, and the scale of poses is learned, on people who are left out in turn: what was
learned with a person's presses fits these better than those of anybody else.
"""

import math
import pathlib
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy

import palpate

from .contact_array import PIXEL_MM, PITCH_MM, Press, Registration, Shifts, find_shifts, placed, touched
from .measures import wrapped
from .trials import Floats

SEED = 700_000_001
WINDOWS = (2, 5)  #: that the errors of poses are of
ANOTHER_MODE_MM = 5.0  #: off, and farther


class Settings(NamedTuple):
    """Of maps and of the sensor that is learned on them."""

    spread_mm: float
    levels: int


CHOICES = [Settings(PITCH_MM / share, levels) for share, levels in ((4.0, 7), (8.0, 7), (3.0, 7), (4.0, 5))]


class PoseErrors(NamedTuple):
    """How far presses are found from where they are, and what their beliefs say of it."""

    moved_mm: Floats  #: [n, 3], the turn times the contact's radius
    covariances_mm2: Floats  #: [n, 3, 3]

    @property
    def mean_mm(self) -> float:
        """Mean distance, where what is taken for another mode counts as no farther than that."""
        return float(numpy.minimum(numpy.linalg.norm(self.moved_mm, axis=1), ANOTHER_MODE_MM).mean())

    def scale(self) -> tuple[float, float]:
        """The factor of the covariances and the deviation beside them, mm, by which errors are likeliest.

        As a sensor model's `pose_scale`. Errors of another mode are left out.
        """
        near = numpy.linalg.norm(self.moved_mm, axis=1) < ANOTHER_MODE_MM
        moved, covariances = self.moved_mm[near], self.covariances_mm2[near]
        best = (math.inf, 1.0, 0.0)
        for factor in numpy.geomspace(0.25, 16.0, 31):
            for sd_mm in numpy.arange(0.0, 2.0, 0.05):
                all_of = factor * covariances + sd_mm**2 * numpy.eye(3)
                squared = numpy.einsum("ni,nij,nj->n", moved, numpy.linalg.inv(all_of), moved)
                cost = float((numpy.log(numpy.linalg.det(all_of)) + squared).sum())
                best = min(best, (cost, float(factor), float(sd_mm)))
        return best[1:]


class Learned(NamedTuple):
    """What is learned of the array: where its elements lie, and what they read."""

    settings: Settings
    registration: Registration
    sensor: pathlib.Path
    pose_scale: tuple[float, float] = (1.0, 0.0)  #: as PoseErrors.scale(), which `sensor` has, too


class Learning:
    """Learns from the people of presses but for some; from the same people it learns once."""

    def __init__(
        self, device: palpate.Device, presses: Sequence[Press], folder: pathlib.Path, *, quick: bool
    ) -> None:
        """folder: for sensor models. quick: from few windows, and of the first two choices."""
        self._device, self._presses, self._folder, self._quick = device, presses, folder, quick
        self._choices = CHOICES[:2] if quick else CHOICES

    def without(self, people: frozenset[int]) -> Learned:
        """What all but these people tell, with a `pose_scale`.

        Of the choices it takes the one by which the others' presses are found best, each of them by what
        is learned without him, too; by these errors it learns the scale.
        """
        others = sorted({press.person for press in self._presses} - people)
        if len(others) < 2:
            raise palpate.Error(
                "presses.npz: it takes presses of three people or more, or of two beside held_out.npz: "
                "settings and pose scale are those of people who are left out"
            )
        errors = {}
        for settings in self._choices:
            of_people = [self._errors_of(settings, people | {person}, person) for person in others]
            errors[settings] = PoseErrors(*map(numpy.concatenate, zip(*of_people, strict=True)))
        best = min(self._choices, key=lambda settings: errors[settings].mean_mm)
        learned = self._learn(best, people)
        factor, sd_mm = errors[best].scale()
        scaled = learned.sensor.with_suffix(".scaled.yaml")
        scale = f"\npose_scale: {{factor: {factor:.4g}, map_sd_mm: {sd_mm:.4g}}}"
        scaled.write_text(learned.sensor.read_text().replace("\ntable:", f"{scale}\ntable:"))
        return learned._replace(sensor=scaled, pose_scale=(factor, sd_mm))

    @cache
    def _shifts_by_eq7(self, spread_mm: float) -> Shifts:
        random = numpy.random.default_rng(SEED + 1)
        return find_shifts(self._device, self._presses, random, None, spread_mm)

    @cache
    def _learn(self, settings: Settings, without: frozenset[int]) -> Learned:
        """What all but these people tell by these settings, without a `pose_scale`."""
        random = numpy.random.default_rng(SEED)
        registration = self._shifts_by_eq7(settings.spread_mm).registration(without)
        others = [press for press in self._presses if press.person not in without]
        left_out = "-".join(map(str, sorted(without)))
        path = self._folder / f"{settings.spread_mm:.3f}.{settings.levels}.{left_out}.yaml"
        learn_sensor(self._device, others, registration, settings, random, path, quick=self._quick)
        # A sensor knows what elements read beside a contact, which Eq. 7 does not.
        shifts = find_shifts(self._device, others, random, path, settings.spread_mm)
        return Learned(settings, shifts.registration(), path)

    @cache
    def _errors_of(self, settings: Settings, without: frozenset[int], person: int) -> PoseErrors:
        """The errors of WINDOWS of a person's presses by what is learned without some people."""
        own = [press for press in self._presses if press.person == person]
        random = numpy.random.default_rng((SEED, person))
        return pose_errors(self._device, own, self._learn(settings, without), random)


def learn_sensor(
    device: palpate.Device,
    presses: Sequence[Press],
    registration: Registration,
    settings: Settings,
    random: numpy.random.Generator,
    path: pathlib.Path,
    *,
    quick: bool,
) -> None:
    """Writes the sensor that ten of the presses tell, 15 windows each, on their drawn maps.

    It has no `pose_scale`. quick: from six windows of three presses, tried at poses nearby alone.
    """
    most, each = (3, 6) if quick else (10, 15)
    near: Any = {"bins": (8, 8, 8), "x_mm": (-8.0, 8.0), "y_mm": (-8.0, 8.0), "theta_deg": (-8.0, 8.0)}
    grids, touches = [], []
    for k in random.permutation(len(presses))[:most]:
        # A calibration on drawn maps seeks one offset of the array, from 30 counts on: it finds the fingers
        # above the sheet beside their contact. The windows' poses are already registered by the contact.
        drawn = presses[k].grid(f"learned {k}", settings.spread_mm)
        grids.append(
            palpate.OccupancyGrid(
                drawn.label,
                drawn.log_odds,
                cell_mm=drawn.cell_mm,
                origin_mm=drawn.origin_mm,
                prior=drawn.prior,
            )  # fmt: skip
        )
        windows = presses[k].windows(random, each)
        touches.append(touched(presses[k], windows, registration, label=drawn.label))
    calibration = palpate.calibrate(
        touches, maps=grids, layer="log_odds", levels=settings.levels, device=device,
        **(near if quick else {}),
    )  # fmt: skip
    calibration.sensor.save(path)
    lines = [line for line in path.read_text().splitlines() if not line.startswith("pose_scale:")]
    path.write_text("\n".join(lines) + "\n")


def pose_errors(
    device: palpate.Device, presses: Sequence[Press], learned: Learned, random: numpy.random.Generator
) -> PoseErrors:
    """The errors of WINDOWS of presses, each on its own map."""
    moved, covariances = [], []
    for press in presses:
        grid = press.grid("press", learned.settings.spread_mm)
        radius_mm = math.sqrt(((numpy.argwhere(press.contact) * PIXEL_MM).var(axis=0)).sum())
        for count in WINDOWS:
            windows = press.windows(random, count)
            touches = touched(press, windows, learned.registration)
            for mode in placed(device, touches, grid, learned.sensor)["modes"][:1]:
                error = numpy.array(mode["T_robot_object"])
                error[2] = wrapped(error[2])
                to_mm = numpy.array([1.0, 1.0, radius_mm])
                moved.append(error * to_mm)
                covariances.append(numpy.array(mode["covariance"]) * numpy.outer(to_mm, to_mm))
    return PoseErrors(numpy.array(moved).reshape(-1, 3), numpy.array(covariances).reshape(-1, 3, 3))
