"""Statistics over trials: intervals, errors, calibration, and what two runs gain on each other."""

import math
from collections.abc import Callable, Sequence
from statistics import fmean
from typing import Any

import numpy
from numpy.typing import ArrayLike, NDArray

import palpate
from palpate._statistics import LEAST_GAIN, Errors, quantile, standard_error

from .random_numbers import Random, Stream
from .trials import Body

Interval = tuple[float, float]

_Z = 1.959964  # the standard normal's 97.5th percentile


def wilson_interval(successes: float, trials: int) -> Interval:
    """The 95 % score interval of a share (Wilson 1927)."""
    share = successes / trials
    shrink = 1.0 + _Z * _Z / trials
    centre = (share + _Z * _Z / (2.0 * trials)) / shrink
    half = _Z / shrink * math.sqrt(share * (1.0 - share) / trials + (_Z / trials) ** 2 / 4.0)
    # Rounding must not leave the ends at 0 and 1 outside.
    low = 0.0 if successes == 0 else centre - half
    return low, 1.0 if successes == trials else centre + half


def mean_interval(values: Sequence[float]) -> Interval | None:
    """The 95 % interval of the mean of what the values are drawn from, by Student's t.

    None for fewer than three values. Student's t is Cornish and Fisher's expansion (Abramowitz and
    Stegun 26.7.5): 3 % off for two degrees of freedom, 1 % for three.
    """
    v, z = len(values) - 1.0, _Z
    if v < 2.0:
        return None
    t = (
        z
        + (z**3 + z) / (4 * v)
        + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * v**2)
        + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * v**3)
    )
    half = t * standard_error(values)
    return fmean(values) - half, fmean(values) + half


def told_apart(lower: ArrayLike, higher: ArrayLike) -> tuple[float, Interval]:
    """Share of the pairs of both kinds in which the lower kind's value is lower; ties count half.

    Its 95 % interval is Wilson's for as many trials as the rarer kind has values: the estimate varies
    no more than that (van Dantzig 1951).
    """
    low, high = numpy.asarray(lower)[:, None], numpy.asarray(higher)
    share = float(numpy.mean(low < high) + numpy.mean(low == high) / 2.0)
    rarer = min(len(low), len(high))
    return share, wilson_interval(share * rarer, rarer)


def bootstrap_interval(
    trials: int, statistic: Callable[[NDArray[numpy.int64]], NDArray[numpy.float64]]
) -> Interval:
    """The 95 % interval of a statistic of trials: percentiles over 2,000 samples (Efron 1979).

    statistic takes the samples as indices [2000, trials] and gives its values [2000]. The same input
    gives the same interval.
    """
    samples = 2_000
    uniforms = Random(20_260_101, Stream.TOUCH_ORDER).uniforms(samples * trials)
    drawn = (uniforms * trials).astype(numpy.int64).reshape(samples, trials)
    values = statistic(drawn).tolist()
    return quantile(values, 0.025), quantile(values, 0.975)


def bootstrap_mean_interval(values: ArrayLike) -> Interval:
    """The 95 % interval of the mean of at least one value, by bootstrap."""
    all_values = numpy.asarray(values)
    return bootstrap_interval(len(all_values), lambda drawn: all_values[drawn].mean(axis=1))


def bootstrap_ratio_interval(numerators: ArrayLike, denominators: ArrayLike) -> Interval:
    """The 95 % interval of mean(numerators) / mean(denominators), paired by index, by bootstrap."""
    above, below = numpy.asarray(numerators), numpy.asarray(denominators)
    return bootstrap_interval(
        len(above), lambda drawn: above[drawn].sum(axis=1) / below[drawn].sum(axis=1)
    )


def mean_record(values: Sequence[float]) -> dict[str, float]:
    """The mean and its bootstrap interval."""
    low, high = bootstrap_mean_interval(values)
    return {"mean": fmean(values), "low": low, "high": high}


def differences(first: Errors, second: Errors) -> dict[str, float] | None:
    """By how much the first run errs more than the second, over the trials that have an error in both.

    Trial i of one run is trial i of the other. `to` and `from` are the mean errors of the first and the
    second run in mm, `mean` is their difference, with its standard error. None where no trial has both.
    """
    pairs = [(a, b) for a, b in zip(first, second, strict=True) if a is not None and b is not None]
    if not pairs:
        return None
    to, from_ = (fmean(errors) for errors in zip(*pairs, strict=True))
    error = standard_error([a - b for a, b in pairs])
    return {
        "trials": len(pairs),
        "from": from_,
        "to": to,
        "mean": to - from_,
        "standard_error": error,
    }


def gains(first: Errors, second: Errors) -> bool:
    """Whether the second run errs less by more than LEAST_GAIN and two standard errors.

    One trial never tells.
    """
    paired = differences(first, second)
    if paired is None or paired["trials"] < 2:
        return False
    return paired["mean"] > max(LEAST_GAIN * paired["to"], 2.0 * paired["standard_error"])


def knee_of(runs: Sequence[Errors]) -> int | None:
    """Where more bins stop helping: the first of the runs that suffices, by rising count.

    It locates every trial, and no finer run gains over it. None where only the last run would do,
    which no finer run confirms, or where a finer run has no errors.
    """
    for i, run in enumerate(runs[:-1]):
        finer = runs[i + 1 :]
        if None not in run and not any(
            gains(run, to) or differences(run, to) is None for to in finer
        ):
            return i
    return None


def pareto_front(entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The entries on the Pareto front of `cost` and `error`, by rising cost; of equals the first."""
    front: list[dict[str, Any]] = []
    for entry in sorted(entries, key=lambda entry: (entry["cost"], entry["error"])):
        if not front or entry["error"] < front[-1]["error"]:
            front.append(entry)
    return front


def calibration(confidences: Sequence[float], right: Sequence[bool]) -> dict[str, Any]:
    """How far the probability of the most probable object can be taken at its word.

    Ten bins of equal width over [0, 1], the empty ones left out, and the expected error: the mean
    distance between confidence and share right, bins weighted by their counts (Naeini, Cooper and
    Hauskrecht 2015).
    """
    told, was = numpy.asarray(confidences), numpy.asarray(right, numpy.float64)
    of = numpy.minimum((told * 10).astype(int), 9)
    bins = [
        {
            "lower": i / 10,
            "count": int((of == i).sum()),
            "mean_confidence": float(told[of == i].mean()),
            "fraction_right": float(was[of == i].mean()),
        }
        for i in numpy.unique(of).tolist()
    ]
    off = [abs(each["mean_confidence"] - each["fraction_right"]) * each["count"] for each in bins]
    return {"expected_error": sum(off) / len(told), "bins": bins}


#: What normalised_error() is on average where covariances are right: one for every coordinate.
EXPECTED_NORMALISED_ERROR = 3.0


def normalised_error(
    grid: palpate.OccupancyGrid, refined: palpate.RefinedPose, truth: ArrayLike
) -> float:
    """The squared error of a refined pose over its covariance C, e' C^-1 e.

    The normalised estimation error squared (NEES; Bar-Shalom, Li and Kirubarajan 2001). e is the
    difference of (x, y, theta) of T_object_robot from the truth [3], of the poses that the map's
    symmetry makes equal to it the nearest. An object of full symmetry has no angle: e is then the
    difference of x and y of the object's centroid in the robot frame, C is carried over to it by the
    Jacobian, and the result is taken times 3/2. So it is 3 on average for every object.
    """
    estimate, true = refined.T_object_robot, numpy.asarray(truth)
    centroid_mm = Body.of(grid).centroid_mm
    if grid.symmetry == 0:
        places = [
            palpate.transform(palpate.inverse(pose), [centroid_mm])[0] for pose in (estimate, true)
        ]
        turn = turning(-estimate[2])
        x, y = centroid_mm - estimate[:2]
        jacobian = numpy.column_stack([-turn, turn @ (y, -x)])
        error = places[0] - places[1]
        covariance = jacobian @ refined.covariance @ jacobian.T
        return (
            EXPECTED_NORMALISED_ERROR / 2.0 * float(error @ numpy.linalg.solve(covariance, error))
        )
    turn_rad = estimate[2] - true[2]
    turn_rad -= wrapped(turn_rad, 2.0 * math.pi / grid.symmetry)
    about = centroid_mm - turning(turn_rad) @ centroid_mm
    error = estimate - palpate.compose([*about, turn_rad], true)
    error[2] = wrapped(error[2], 2.0 * math.pi)
    return float(error @ numpy.linalg.solve(refined.covariance, error))


def turning(angle_rad: float) -> NDArray[numpy.float64]:
    """The matrix [2, 2] that turns by an angle."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return numpy.array([[c, -s], [s, c]])


def wrapped(angle_rad: float, period_rad: float) -> float:
    """The angle in [-period/2, period/2)."""
    return (angle_rad + period_rad / 2.0) % period_rad - period_rad / 2.0
