"""Simulated letters: what is learned, the unknowns, and a histogram's answers about them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy
from numpy.typing import ArrayLike, NDArray

import palpate
from palpate._palpate import Random, Stream

from .program import Json

#: The objects of Sec. IV.
VOWELS = ("A", "E", "I", "O", "U")
#: Shapes that nobody learned.
MISFITS = ("F", "H", "T", "X", "L", "C", "Z", "ring")
SYMMETRY = {"I": 2, "O": 0}
SEEDS_PER_SHAPE = 1_000_000  # more trials begin with the same ones

Floats = NDArray[numpy.float64]
Bins = tuple[int, int, int]
#: The paper's bins: 100, 1,000 and 10,000 bins per object.
TABLE_1: tuple[Bins, ...] = ((5, 5, 4), (10, 10, 10), (25, 25, 16))


@dataclass(frozen=True)
class Touching:
    """What unknowns are touched with, and how."""

    #: Element centres in the sensor frame, [e, 2] in mm.
    elements_mm: ArrayLike = field(default_factory=palpate.digitacts_array)
    sensor: palpate.SensorModel = field(default_factory=palpate.SensorModel)
    #: random_poses() in the place of the training set's poses.
    at_random_poses: bool = False
    #: Standard deviations of the pose that the robot reports for the array about the true one:
    #: along x and y in mm, and about the array's centre in rad.
    noise: tuple[float, float] = (0.0, 0.0)


EXACT = Touching()


def training_recordings(
    touching: Touching = EXACT,
    poses: ArrayLike | None = None,
    *,
    first_seed: int = 1,
    shapes: Sequence[str] = VOWELS,
) -> list[palpate.Recording]:
    """The shapes, touched at known poses T_object_sensor [n, 3], by default those of the training grid.

    Letters have the seeds of their places among all vowels.
    """
    seeds = [VOWELS.index(shape) if shape in VOWELS else i for i, shape in enumerate(shapes)]
    own: Json = {"elements_mm": touching.elements_mm, "sensor": touching.sensor}
    return [
        palpate.simulate(shape, poses, seed=first_seed + seed, **own)
        for shape, seed in zip(shapes, seeds, strict=True)
    ]


def letter_maps(
    device: palpate.Device,
    training: Sequence[palpate.Recording] | None = None,
    *,
    cell_mm: float = 0.5,
    spread_mm: float = 0.5,
) -> list[palpate.OccupancyGrid]:
    """The letters' maps, which share the prior that their touches give, with their symmetries."""
    training = training_recordings() if training is None else training
    labels = [recording.object for recording in training]
    learned = palpate.learn_maps(
        training, cell_mm=cell_mm, spread_mm=spread_mm, origin="robot", sensor_model="none",
        symmetry={label: SYMMETRY.get(label, 1) for label in labels}, device=device,
    )  # fmt: skip
    return sorted(learned.maps, key=lambda grid: labels.index(grid.label))


def make_trials(
    shapes: Iterable[str], each: int, touches: int, seed: int, touching: Touching = EXACT
) -> list[palpate.Recording]:
    """The trials of Sec. IV, `each` for every shape, shape by shape.

    A shape has one test set: 192 readings, by default at the poses of the training set, but of another
    sensor's gains and noise. A trial is a random T_object_robot, x and y uniform over [-10, 10] mm and
    theta over the circle, and the first `touches` of the test set in a random order. More trials, or
    more touches, begin with the same ones. The recordings carry the truth. With noise, each reading is
    the same and its T_robot_sensor is off by normal numbers of its own.

    Raises palpate.Error unless touches is from 1 to the test set's 192.
    """
    grid = palpate.training_grid()
    if not 1 <= touches <= len(grid):
        raise palpate.Error(
            f"touches per trial = {touches}: give 1 to {len(grid)}, which is what there is to draw "
            "from without replacement"
        )
    poses = palpate.random_poses(len(grid), seed) if touching.at_random_poses else grid
    trials = []
    for index, shape in enumerate(shapes):
        own = seed + index * SEEDS_PER_SHAPE
        sensor, elements_mm = touching.sensor, touching.elements_mm
        test_set = palpate.simulate(shape, poses, elements_mm=elements_mm, seed=own, sensor=sensor)
        trials += [_trial(test_set, touches, own + i, touching.noise) for i in range(each)]
    return trials


def _trial(
    test_set: palpate.Recording, touches: int, seed: int, noise: tuple[float, float]
) -> palpate.Recording:
    """Touches of an object whose frame was the robot's, as a robot meets them at T_object_robot."""
    order = _order(len(test_set), Random(seed, Stream.touch_order))[:touches]
    T_object_robot = palpate.random_object_pose(seed)
    T_robot_object = palpate.inverse(T_object_robot)
    off = Random(seed, Stream.pose_noise).normals(3 * touches).reshape(touches, 3)
    off *= (noise[0], noise[0], noise[1])
    poses = [
        palpate.compose(palpate.compose(T_robot_object, test_set.T_robot_sensor[i]), off[k])
        for k, i in enumerate(order)
    ]
    return palpate.Recording(
        test_set.pressure[order],
        numpy.array(poses),
        test_set.elements_mm,
        truth=palpate.Truth(test_set.object, T_object_robot),
    )


def _order(n: int, random: Random) -> list[int]:
    """0 to n - 1 in a random order (Fisher and Yates)."""
    order = list(range(n))
    for i, u in enumerate(random.uniforms(n - 1).tolist()):
        j = i + int((n - i) * u)
        order[i], order[j] = order[j], order[i]
    return order


def truth_of(trial: palpate.Recording) -> palpate.Truth:
    """The truth, which a trial has."""
    assert trial.truth is not None
    return trial.truth


def lattice_of(bins: Bins) -> palpate.PoseLattice:
    """Bins over x and y in [-10, 10] mm and the full circle (Sec. IV)."""
    x, y, theta = bins
    return palpate.PoseLattice((-10.0, 10.0, x), (-10.0, 10.0, y), (0.0, 2.0 * numpy.pi, theta))


def recognized(
    device: palpate.Device,
    maps: Sequence[palpate.OccupancyGrid],
    trials: Sequence[palpate.Recording],
    *,
    trace: bool = True,
    **options: Any,
) -> list[list[Json]]:
    """What is believed of every unknown after each of its touches, [trial][touch].

    Records as of `palpate recognize --trace`, and `confidence`, the probability of the best answer;
    without `trace` that after the last touch alone, [trial][0]. The region is that of lattice_of();
    options: those of palpate.recognize(), but that "(none)" has no weight unless it is given one.
    """
    region: Json = {"x_mm": (-10.0, 10.0), "y_mm": (-10.0, 10.0), "pivot_mm": (0.0, 0.0), "none": 0.0}
    records = palpate.recognize(trials, maps, trace=trace, device=device, **region | options)
    steps = [record.get("trace", [record]) for record in records]
    for step in (step for of_trial in steps for step in of_trial):
        step["confidence"] = step["identity"][step["best"]]
    return steps


class Body(NamedTuple):
    """The cells with log odds above 0, of uniform density."""

    centroid_mm: Floats  #: [2] in the object frame
    inertia_mm2: float  #: mean squared distance from the centroid
    symmetry: int  #: as OccupancyGrid has it

    @staticmethod
    def of(grid: palpate.OccupancyGrid) -> "Body":
        j, i = numpy.nonzero(grid.log_odds > 0)
        cells_mm = grid.origin_mm + grid.cell_mm * numpy.stack([i, j], axis=1)
        centroid_mm = cells_mm.mean(axis=0)
        inertia_mm2 = float(((cells_mm - centroid_mm) ** 2).sum(axis=1).mean())
        return Body(centroid_mm, inertia_mm2, grid.symmetry)


def map_of(maps: Sequence[palpate.OccupancyGrid], trial: palpate.Recording) -> palpate.OccupancyGrid:
    """The map of the letter that a trial is of."""
    return next(grid for grid in maps if grid.label == truth_of(trial).object)


def error_of(grid: palpate.OccupancyGrid, truth: palpate.Truth, pose: Any) -> float | None:
    """The error of a mode or a refined pose on a map; None where the map is of another object."""
    if pose is None or grid.label != truth.object:
        return None
    return palpate.pose_error_mm(grid, pose.T_object_robot, truth.T_object_robot)
