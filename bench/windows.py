"""Parts of a lattice about the truth: the full posterior's mode without the time for all bins."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy

import palpate

from .measures import wrapped
from .trials import Body, Floats, Step, judged, truth_of

#: How far from the truth a mode is looked for.
REACH_MM = 3.0
# The refined pose takes bins within 2.5 mm of one that may lie a bin or two from the mode.
_REFINED_REACH_MM = 4.0
# Parts of the circle for bodies of full symmetry: few enough for their fixed cost, and narrow enough that
# the body's origin stays near within one.
_SECTORS = 8


class Placed(NamedTuple):
    """An object and where it is."""

    body: Body
    symmetry: int  #: as OccupancyGrid has it
    T_object_robot: Floats


def map_of(
    maps: Sequence[palpate.OccupancyGrid], trial: palpate.Recording
) -> palpate.OccupancyGrid:
    """The map of the letter that a trial is of."""
    return next(grid for grid in maps if grid.label == truth_of(trial).object)


def placed(maps: Sequence[palpate.OccupancyGrid], trial: palpate.Recording) -> Placed:
    """The body of the letter that a trial is of, where the trial has it."""
    grid = map_of(maps, trial)
    return Placed(Body.of(grid), grid.symmetry, truth_of(trial).T_object_robot)


def _places(lattice: palpate.PoseLattice, at: Placed, thetas: Floats) -> Floats:
    """x and y of the lattice at which poses of these thetas leave the body's centroid where it is."""
    centroid_mm = at.body.centroid_mm
    p = palpate.transform(palpate.inverse(at.T_object_robot), [centroid_mm])[0] - lattice.pivot_mm
    c, s = numpy.cos(thetas), numpy.sin(thetas)
    turned: Floats = numpy.stack([c * p[0] - s * p[1], s * p[0] + c * p[1]], axis=1)
    return centroid_mm - turned


def _index(axis: palpate.Axis, value: float) -> int:
    """Index of the bin that holds a value, which may lie beyond the axis."""
    return math.floor((value - axis.lower) / axis.step)


def _nearest(axis: palpate.Axis, value: float) -> int:
    return min(max(_index(axis, value), 0), axis.count - 1)


def _part(axis: palpate.Axis, first: int, end: int) -> palpate.Axis:
    lower = axis.lower + first * axis.step
    return palpate.Axis(lower, lower + (end - first) * axis.step, end - first)


def _window(
    lattice: palpate.PoseLattice, at: Placed, first: int, end: int, reach_mm: float
) -> palpate.PoseLattice:
    theta = lattice.theta_rad
    places = _places(lattice, at, numpy.array([theta.centre(k) for k in range(first, end)]))
    axes = []
    for axis, values in ((lattice.x_mm, places[:, 0]), (lattice.y_mm, places[:, 1])):
        low, high = float(values.min()) - reach_mm, float(values.max()) + reach_mm
        axes.append(_part(axis, _nearest(axis, low), _nearest(axis, high) + 1))
    x, y = axes
    return palpate.PoseLattice(x, y, _part(theta, first, end), lattice.pivot_mm)


def windows_about(
    lattice: palpate.PoseLattice, at: Placed, reach_mm: float
) -> list[palpate.PoseLattice]:
    """Parts of a lattice, of the same bins, with every bin within `reach_mm` of the body.

    By the pose error; there is one part for each of the body's places of equal error or, for a body of
    full symmetry, for each sector of the circle. The lattice's theta is to cover the circle; a part's
    may go on beyond its ends. Parts are boxes and may hold other bins besides.
    """
    theta = lattice.theta_rad
    if at.symmetry == 0:
        parts = min(_SECTORS, theta.count)
        ends = [theta.count * part // parts for part in range(parts + 1)]
        return [_window(lattice, at, first, end, reach_mm) for first, end in pairwise(ends)]
    # The error of a turn about the centroid is 2 sqrt(J) sin(turn / 2).
    turn = 2.0 * math.asin(min(1.0, reach_mm / (2.0 * math.sqrt(at.body.inertia_mm2))))
    windows = []
    for i in range(at.symmetry):
        middle = at.T_object_robot[2] + i * 2.0 * math.pi / at.symmetry
        first = _index(theta, middle - turn)
        end = min(_index(theta, middle + turn) + 1, first + theta.count)
        windows.append(_window(lattice, at, first, end, reach_mm))
    return windows


def nearest_bin_mm(lattice: palpate.PoseLattice, at: Placed) -> float:
    """Least error that a bin of the lattice has: what the lattice alone costs.

    At a given theta the error grows with the distance from the place, whatever its direction, so that
    the nearest bin is that of x and y by themselves.
    """
    theta = lattice.theta_rad
    thetas = numpy.array([theta.centre(k) for k in range(theta.count)])
    places = _places(lattice, at, thetas)
    off = [
        numpy.array([axis.centre(_nearest(axis, value)) - value for value in places[:, i].tolist()])
        for i, axis in enumerate((lattice.x_mm, lattice.y_mm))
    ]
    turns: Floats = numpy.zeros(theta.count)
    if at.symmetry > 0:
        period = 2.0 * math.pi / at.symmetry
        turns = numpy.array([wrapped(angle - at.T_object_robot[2], period) for angle in thetas])
    spin = 2.0 * math.sqrt(at.body.inertia_mm2) * numpy.sin(turns / 2.0)
    return float(numpy.sqrt(off[0] ** 2 + off[1] ** 2 + spin**2).min())


def estimate_in_window(
    device: palpate.Device,
    maps: Sequence[palpate.OccupancyGrid],
    trial: palpate.Recording,
    lattice: palpate.PoseLattice,
) -> Step:
    """Recognises a trial among the bins of its true object within REACH_MM of the truth.

    Where the full posterior has its mode there, mode and refined pose are the same but for rounding,
    since no bin's likelihood depends on other bins; the identity is that of one object alone.
    """
    grid, truth = map_of(maps, trial), placed(maps, trial)

    def step_in(window: palpate.PoseLattice) -> Step:
        belief = palpate.PoseHistogram(device, [grid], window)
        belief.update(trial)
        return judged(belief, [grid], truth_of(trial))

    steps = [step_in(window) for window in windows_about(lattice, truth, REACH_MM)]
    best = max(steps, key=lambda step: step.mode.log_likelihood).mode
    # About the mode, so that no edge of a window cuts off what the refined pose is made of.
    found = Placed(truth.body, 1, best.T_object_robot)
    return step_in(windows_about(lattice, found, _REFINED_REACH_MM)[0])
