"""Statistics over trials: intervals, calibration, and errors of poses over their covariances."""

import math
from collections.abc import Sequence
from statistics import fmean
from typing import Any

import numpy
from numpy.typing import ArrayLike, NDArray

import palpate
from palpate._palpate import Random, Stream
from palpate._statistics import LEAST_GAIN, Errors, quantile, standard_error
from palpate._tables import Text

from .program import Json
from .trials import Body, Floats

_Z = 1.959964  # the standard normal's 97.5th percentile
_SAMPLES = 4_000  # of a mixture of modes: standard error of a level at most 0.008

#: A mean, or a share, as `mean`, with the ends `low` and `high` of its 95 % interval.
Mean = dict[str, float]


def share_record(successes: float, trials: int) -> Mean:
    """A share, with its score interval (Wilson 1927)."""
    share = successes / trials
    shrink = 1.0 + _Z * _Z / trials
    centre = (share + _Z * _Z / (2.0 * trials)) / shrink
    half = _Z / shrink * math.sqrt(share * (1.0 - share) / trials + (_Z / trials) ** 2 / 4.0)
    # Rounding must not leave the ends at 0 and 1 outside.
    low = 0.0 if successes == 0 else centre - half
    return {"mean": share, "low": low, "high": 1.0 if successes == trials else centre + half}


def student_record(values: Any) -> Mean:
    """The mean of what the values are drawn from, with its interval by Student's t.

    Without an interval for fewer than three values. Student's t is Cornish and Fisher's expansion
    (Abramowitz and Stegun 26.7.5): 3 % off for two degrees of freedom, 1 % for three.
    """
    mean, v, z = fmean(values), len(values) - 1.0, _Z
    if v < 2.0:
        return {"mean": mean}
    t = (
        z
        + (z**3 + z) / (4 * v)
        + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * v**2)
        + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * v**3)
    )
    half = t * standard_error(values)
    return {"mean": mean, "low": mean - half, "high": mean + half}


def told_apart(lower: ArrayLike, higher: ArrayLike) -> Mean:
    """Share of the pairs of both kinds in which the lower kind's value is lower; ties count half.

    Its 95 % interval is Wilson's for as many trials as the rarer kind has values: the estimate varies
    no more than that (van Dantzig 1951).
    """
    low, high = numpy.asarray(lower)[:, None], numpy.asarray(higher)
    share = float(numpy.mean(low < high) + numpy.mean(low == high) / 2.0)
    rarer = min(len(low), len(high))
    return share_record(share * rarer, rarer)


def bootstrap_record(values: ArrayLike, over: ArrayLike = 1.0) -> Mean:
    """mean(values) / mean(over), paired by index, with its interval by bootstrap (Efron 1979).

    Of at least one value, by percentiles over 2,000 samples. The same input gives the same interval.
    """
    samples, above = 2_000, numpy.asarray(values)
    below = numpy.broadcast_to(over, above.shape)
    uniforms = Random(20_260_101, Stream.touch_order).uniforms(samples * len(above))
    drawn = (uniforms * len(above)).astype(numpy.int64).reshape(samples, len(above))
    ratios = (above[drawn].sum(axis=1) / below[drawn].sum(axis=1)).tolist()
    low, high = quantile(ratios, 0.025), quantile(ratios, 0.975)
    return {"mean": float(above.mean() / below.mean()), "low": low, "high": high}


def with_interval(form: str, factor: float = 1.0) -> Text:
    """Writes `factor` times such a record, as in "0.041 (0.018 to 0.072)"."""

    def text(record: Mean) -> str:
        texts = {of: format(factor * value, form) for of, value in record.items()}
        ends = f" ({texts['low']} to {texts['high']})" if "low" in texts else ""
        return texts["mean"] + ends

    return text


def calibration(confidences: ArrayLike, right: ArrayLike) -> Json:
    """How far the probability of the most probable object can be taken at its word.

    Ten bins of equal width over [0, 1], the empty ones left out, and the expected error: the mean
    distance between confidence and share right, bins weighted by their counts (Naeini, Cooper and
    Hauskrecht 2015).
    """
    confidence, was = numpy.asarray(confidences), numpy.asarray(right, numpy.float64)
    of = numpy.minimum((confidence * 10).astype(int), 9)
    bins = [
        {
            "lower": i / 10,
            "count": int((of == i).sum()),
            "mean_confidence": float(confidence[of == i].mean()),
            "fraction_right": float(was[of == i].mean()),
        }
        for i in numpy.unique(of).tolist()
    ]
    off = [abs(each["mean_confidence"] - each["fraction_right"]) * each["count"] for each in bins]
    return {"expected_error": sum(off) / len(confidence), "bins": bins}


def normalised_error(
    grid: palpate.OccupancyGrid, estimate: ArrayLike, covariance: Any, truth: ArrayLike
) -> float:
    """The squared error of a refined pose over its covariance C, e' C^-1 e.

    The normalised estimation error squared (NEES; Bar-Shalom, Li and Kirubarajan 2001). e is the
    difference of (x, y, theta) of T_object_robot from the truth [3], of the poses that the map's
    symmetry makes equal to it the nearest. An object of full symmetry has no angle: e is then the
    difference of x and y of the object's centroid in the robot frame, C is carried over to it by the
    Jacobian, and the result is taken times 3/2. So it is 3 on average for every object.
    """
    pose, true = numpy.asarray(estimate), numpy.asarray(truth)
    centroid_mm = Body.of(grid).centroid_mm
    if grid.symmetry == 0:
        here, there = (palpate.transform(palpate.inverse(of), [centroid_mm])[0] for of in (pose, true))
        turn = turning(-pose[2])
        x, y = centroid_mm - pose[:2]
        jacobian = numpy.column_stack([-turn, turn @ (y, -x)])
        of_centroid = jacobian @ covariance @ jacobian.T
        return 1.5 * float((here - there) @ numpy.linalg.solve(of_centroid, here - there))
    turn_rad = pose[2] - true[2]
    turn_rad -= wrapped(turn_rad, 2.0 * math.pi / grid.symmetry)
    about = centroid_mm - turning(turn_rad) @ centroid_mm
    error = pose - palpate.compose([*about, turn_rad], true)
    error[2] = wrapped(error[2])
    return float(error @ numpy.linalg.solve(covariance, error))


def densities(modes: Sequence[Json], label: str, poses: Floats) -> Floats:
    """Density of a record's modes at an object's poses T_robot_object [n, 3], per mm^2 rad."""
    sum_of = numpy.zeros(len(poses))
    for mode in modes:
        if mode["object"] != label:
            continue
        d = poses - mode["T_robot_object"]
        d[:, 2] = wrapped(d[:, 2])
        covariance = numpy.array(mode["covariance"])
        squared = numpy.einsum("ni,ij,nj->n", d, numpy.linalg.inv(covariance), d)
        height = mode["probability"] / math.sqrt((2.0 * math.pi) ** 3 * numpy.linalg.det(covariance))
        sum_of += height * numpy.exp(-0.5 * squared)
    return sum_of


def level_in_modes(modes: Sequence[Json], truth: palpate.Truth, random: numpy.random.Generator) -> float:
    """Probability of all that is denser than the truth, by the modes as Gaussians.

    What the modes leave of 1 is spread over everything else and comes last.
    """
    pose = palpate.inverse(truth.T_object_robot)
    at_truth = densities(modes, truth.object, pose[None])[0]
    level = 0.0
    for mode in modes:
        count = math.ceil(_SAMPLES * mode["probability"])
        samples = random.multivariate_normal(mode["T_robot_object"], mode["covariance"], count)
        denser = densities(modes, mode["object"], samples) > at_truth
        level += mode["probability"] * float(numpy.mean(denser))
    held = sum(mode["probability"] for mode in modes)
    # A truth outside all modes is anywhere in the rest.
    return level if level < held else held + (1.0 - held) * random.uniform()


def turning(angle_rad: float) -> NDArray[numpy.float64]:
    """The matrix [2, 2] that turns by an angle."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return numpy.array([[c, -s], [s, c]])


def wrapped(angles_rad: Any, period_rad: float = 2.0 * math.pi) -> Any:
    """Angles in [-period/2, period/2)."""
    return (angles_rad + period_rad / 2.0) % period_rad - period_rad / 2.0


def differences(first: Errors, second: Errors) -> Json | None:
    """By how much the first run errs more than the second, over the trials that have an error in both.

    Trial i of one run is trial i of the other. `to` and `from` are the mean errors of the first and the
    second run in mm, `mean` is their difference, with its standard error. None where no trial has both.
    """
    pairs = numpy.array([first, second], numpy.float64)
    to, from_ = pairs[:, ~numpy.isnan(pairs).any(axis=0)]
    if not len(to):
        return None
    return {
        "trials": len(to),
        "from": float(from_.mean()),
        "to": float(to.mean()),
        "mean": float(to.mean() - from_.mean()),
        "standard_error": standard_error(to - from_),
    }


def gains(first: Errors, second: Errors) -> bool:
    """Whether the second run errs less by more than LEAST_GAIN and two standard errors.

    One trial never tells.
    """
    paired = differences(first, second)
    if paired is None or paired["trials"] < 2:
        return False
    return bool(paired["mean"] > max(LEAST_GAIN * paired["to"], 2.0 * paired["standard_error"]))


def knee_of(runs: Sequence[Errors]) -> int | None:
    """Where more bins stop helping: the first of the runs that suffices, by rising count.

    It locates every trial, and no finer run gains over it. None where only the last run would do,
    which no finer run confirms, or where a finer run has no errors.
    """
    for i, run in enumerate(runs[:-1]):
        finer = runs[i + 1 :]
        if None not in run and not any(gains(run, to) or differences(run, to) is None for to in finer):
            return i
    return None
