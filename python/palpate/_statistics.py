"""Statistics of pose errors over unknowns."""

import math
import statistics
from collections.abc import Sequence
from typing import Any

import numpy

#: Errors of a run in mm, [unknown]; None where the mode has the wrong object or no truth is known.
Errors = Sequence[float | None]

#: Least part of the mean error by which a gain counts.
LEAST_GAIN = 0.09


def quantile(values: Sequence[float], fraction: float) -> float:
    """The smallest value that at least this fraction of the values does not exceed."""
    return float(numpy.quantile(values, fraction, method="inverted_cdf"))


def standard_error(values: Sequence[float]) -> float:
    """The standard error of the mean; 0 for a single value."""
    return statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else 0.0


def present(errors: Errors) -> list[float]:
    """The errors that there are, in order."""
    return [error for error in errors if error is not None]


def errors_over(errors: Errors, fewest_p95: int = 1) -> dict[str, Any] | None:
    """What the errors are over the trials that have one; None where no trial has.

    The 95th percentile of fewer than 20 trials is the largest error, or None below `fewest_p95`.
    """
    there = present(errors)
    if not there:
        return None
    return {
        "trials": len(there),
        "mean": statistics.fmean(there),
        "standard_error": standard_error(there),
        "median": statistics.median_low(there),
        "p95": quantile(there, 0.95) if len(there) >= fewest_p95 else None,
    }
