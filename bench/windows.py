"""Parts of a lattice about the truth: the full posterior's mode without the time for all bins."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy

import palpate

from .measures import wrapped
from .trials import Body, Floats, Poses, map_of, poses_of, truth_of

#: How far from the truth a mode is looked for.
REACH_MM = 3.0
# The refined pose takes bins within 2.5 mm of one that may lie a bin or two from the mode.
_REFINED_REACH_MM = 4.0
# Parts of the circle for bodies of full symmetry: few enough for their fixed cost, and narrow enough that
# the body's origin stays near within one.
_SECTORS = 8


def _places(lattice: palpate.PoseLattice, body: Body, pose: Floats, thetas: Floats) -> Floats:
    """x and y of the lattice at which poses of these thetas leave the body's centroid where it is."""
    centroid_mm = body.centroid_mm
    p = palpate.transform(palpate.inverse(pose), [centroid_mm])[0] - lattice.pivot_mm
    c, s = numpy.cos(thetas), numpy.sin(thetas)
    turned: Floats = numpy.stack([c * p[0] - s * p[1], s * p[0] + c * p[1]], axis=1)
    return centroid_mm - turned


def _thetas(axis: palpate.Axis, first: int, end: int) -> Floats:
    return numpy.array([axis.centre(k) for k in range(first, end)])


def _index(axis: palpate.Axis, value: float) -> int:
    """Index of the bin that holds a value, which may lie beyond the axis."""
    return math.floor((value - axis.lower) / axis.step)


def _nearest(axis: palpate.Axis, value: float) -> int:
    return min(max(_index(axis, value), 0), axis.count - 1)


def _part(axis: palpate.Axis, first: int, end: int) -> palpate.Axis:
    lower = axis.lower + first * axis.step
    return palpate.Axis(lower, lower + (end - first) * axis.step, end - first)


def windows_about(
    lattice: palpate.PoseLattice, body: Body, pose: Floats, reach_mm: float
) -> list[palpate.PoseLattice]:
    """Parts of a lattice, of the same bins, with every bin within `reach_mm` of a body at a pose.

    By the pose error; there is one part for each of the body's places of equal error or, for a body of
    full symmetry, for each sector of the circle. The lattice's theta is to cover the circle; a part's
    may go on beyond its ends. Parts are boxes and may hold other bins besides.
    """
    theta = lattice.theta_rad

    def window(first: int, end: int) -> palpate.PoseLattice:
        places = _places(lattice, body, pose, _thetas(theta, first, end))
        x, y = (
            _part(axis, _nearest(axis, low - reach_mm), _nearest(axis, high + reach_mm) + 1)
            for axis, low, high in zip(
                (lattice.x_mm, lattice.y_mm), places.min(axis=0), places.max(axis=0), strict=True
            )
        )
        return palpate.PoseLattice(x, y, _part(theta, first, end), lattice.pivot_mm)

    if body.symmetry == 0:
        parts = min(_SECTORS, theta.count)
        ends = [theta.count * part // parts for part in range(parts + 1)]
        return [window(first, end) for first, end in pairwise(ends)]
    # The error of a turn about the centroid is 2 sqrt(J) sin(turn / 2).
    turn = 2.0 * math.asin(min(1.0, reach_mm / (2.0 * math.sqrt(body.inertia_mm2))))
    windows = []
    for i in range(body.symmetry):
        middle = pose[2] + i * 2.0 * math.pi / body.symmetry
        first = _index(theta, middle - turn)
        windows.append(window(first, min(_index(theta, middle + turn) + 1, first + theta.count)))
    return windows


def nearest_bin_mm(lattice: palpate.PoseLattice, body: Body, pose: Floats) -> float:
    """Least error that a bin of the lattice has for a body at a pose: what the lattice alone costs.

    At a given theta the error grows with the distance from the place, whatever its direction, so that
    the nearest bin is that of x and y by themselves.
    """
    thetas = _thetas(lattice.theta_rad, 0, lattice.theta_rad.count)
    places = _places(lattice, body, pose, thetas)
    x, y = (
        numpy.array([axis.centre(_nearest(axis, value)) - value for value in values])
        for axis, values in zip((lattice.x_mm, lattice.y_mm), places.T.tolist(), strict=True)
    )
    turns = 0.0 * thetas
    if body.symmetry > 0:
        turns = wrapped(thetas - pose[2], 2.0 * math.pi / body.symmetry)
    spin = 2.0 * math.sqrt(body.inertia_mm2) * numpy.sin(turns / 2.0)
    return float(numpy.sqrt(x**2 + y**2 + spin**2).min())


def poses_in_window(
    device: palpate.Device,
    maps: Sequence[palpate.OccupancyGrid],
    trial: palpate.Recording,
    lattice: palpate.PoseLattice,
) -> Poses:
    """Locates a trial among the bins of its true object within REACH_MM of the truth.

    Where the full posterior has its mode there, mode and refined pose are the same but for rounding,
    since no bin's likelihood depends on other bins.
    """
    grid, truth = map_of(maps, trial), truth_of(trial)
    body = Body.of(grid)

    def poses_in(window: palpate.PoseLattice) -> Poses:
        belief = palpate.PoseHistogram(device, [grid], window)
        belief.update(trial)
        return poses_of(belief, [grid], truth)

    found = [poses_in(part) for part in windows_about(lattice, body, truth.T_object_robot, REACH_MM)]
    best = max(found, key=lambda poses: poses.mode.log_likelihood).mode
    # About the mode, so that no edge of a window cuts off what the refined pose is made of.
    (window,) = windows_about(
        lattice, body._replace(symmetry=1), best.T_object_robot, _REFINED_REACH_MM
    )
    return poses_in(window)
