"""Statistics of pose errors over unknowns."""

from collections.abc import Sequence
from typing import Any

import numpy
from numpy.typing import NDArray

#: Errors of a run in mm, [unknown]; None where the mode has the wrong object or no truth is known.
Errors = Sequence[float | None]

#: Least part of the mean error by which a gain counts.
LEAST_GAIN = 0.09


def quantile(values: Any, fraction: float) -> float:
    """The smallest value that at least this fraction of the values does not exceed."""
    return float(numpy.quantile(values, fraction, method="inverted_cdf"))


def standard_error(values: Any) -> float:
    """The standard error of the mean; 0 for a single value."""
    n = numpy.size(values)
    return float(numpy.std(values, ddof=1)) / n**0.5 if n > 1 else 0.0


def present(errors: Any) -> NDArray[numpy.float64]:
    """The errors that there are, in order; None and NaN are none."""
    every: NDArray[numpy.float64] = numpy.asarray(errors, numpy.float64)
    return numpy.compress(~numpy.isnan(every), every)


def errors_over(errors: Any, fewest_p95: int = 1) -> dict[str, Any] | None:
    """What the errors are over the trials that have one; None where no trial has.

    The 95th percentile of fewer than 20 trials is the largest error, or None below `fewest_p95`.
    """
    there = present(errors)
    if not len(there):
        return None
    return {
        "trials": len(there),
        "mean": float(there.mean()),
        "standard_error": standard_error(there),
        "median": quantile(there, 0.5),
        "p95": quantile(there, 0.95) if len(there) >= fewest_p95 else None,
    }
