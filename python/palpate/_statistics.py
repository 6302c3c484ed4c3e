"""Statistics of pose errors over unknowns."""

import math
from collections.abc import Iterable, Sequence

import numpy

#: Errors of a run in mm, [unknown]; None where the mode has the wrong object or no truth is known.
Errors = Sequence[float | None]


def quantile(values: Iterable[float], fraction: float) -> float:
    """The smallest value that at least this fraction of the values does not exceed."""
    ordered = sorted(values)
    return ordered[max(math.ceil(fraction * len(ordered)), 1) - 1]


def median(values: Iterable[float]) -> float:
    """The lower median."""
    return quantile(values, 0.5)


def mean(values: Sequence[float]) -> float:
    """Of at least one value."""
    return sum(values) / len(values)


def standard_error(values: Sequence[float]) -> float:
    """Of the mean; 0 for a single value."""
    if len(values) < 2:
        return 0.0
    return float(numpy.std(values, ddof=1)) / math.sqrt(len(values))


def present(errors: Errors) -> list[float]:
    """The errors that there are, in order."""
    return [error for error in errors if error is not None]


def errors_over(errors: Errors) -> dict[str, float] | None:
    """What the errors are over the trials that have one; None where no trial has."""
    there = present(errors)
    if not there:
        return None
    return {
        "trials": len(there),
        "mean": mean(there),
        "standard_error": standard_error(there),
        "median": median(there),
        "p95": quantile(there, 0.95),  # of fewer than 20 trials, the largest
    }


#: Least part of the mean error by which a gain counts.
LEAST_GAIN = 0.09
