"""The posterior over all bins in float64, which certificates of a search by bounds are held against."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy

import palpate
from palpate import reference

from .program import Json
from .trials import Floats

#: Mass, relative to the object's best bin, that bins may hold together and keep float32 values. Those
#: err by some 4e-6 nats, which leaves 4e-12 of the object's evidence.
_NEGLIGIBLE = 1e-6
#: Rounding of the sums in float64 on both sides: below it nothing is measured.
SUMMING_ERROR = 1e-11


def log_sum_exp(logs: Floats) -> float:
    """The log of the sum of exponentials."""
    most = float(logs.max())
    return most + math.log(float(numpy.exp(logs - most).sum()))


class DensePosterior(NamedTuple):
    """The posterior over all bins of a lattice."""

    log_evidence: Floats  #: [object] prior weight times summed likelihood, in nats
    identity: Floats  #: [object]
    xy: list[Floats]  #: [object] marginal probabilities [ny, nx]
    theta: list[Floats]  #: [object] and [ntheta]
    mode: tuple[int, int, float]  #: object, bin and log-likelihood


def dense_posterior(
    histogram: palpate.PoseHistogram,
    maps: Sequence[palpate.OccupancyGrid],
    touches: palpate.Recording,
) -> DensePosterior:
    """The posterior over the bins of a histogram that has taken in the touches.

    Bins that hold all but 1e-6 of an object's mass are evaluated again by the float64 reference, so
    that the histogram's float32 steps do not count.
    """
    lattice = histogram.lattice
    contact = palpate.ContactModel(prior=maps[0].prior)
    log_weight = -math.log(len(maps))
    bins: list[Floats] = []
    for i, grid in enumerate(maps):
        logs = numpy.array(histogram.log_likelihood(i))
        flat = logs.reshape(-1)
        rising = numpy.argsort(flat)
        below = numpy.cumsum(numpy.exp(flat[rising] - flat.max()))
        for bin_ in rising[below > _NEGLIGIBLE].tolist():
            pose = lattice.T_object_robot(bin_)
            flat[bin_] = math.fsum(reference.log_likelihood(touch, pose, grid, contact) for touch in touches)
        bins.append(logs)
    evidence = numpy.array([log_weight + log_sum_exp(logs) for logs in bins])
    total = log_sum_exp(evidence)
    best = max(range(len(bins)), key=lambda i: float(bins[i].max()))
    mode = (best, int(bins[best].argmax()), float(bins[best].max()))
    masses = [numpy.exp(logs + log_weight - total) for logs in bins]
    xy = [mass.sum(axis=0) for mass in masses]
    theta = [mass.sum(axis=(1, 2)) for mass in masses]
    return DensePosterior(evidence, numpy.exp(evidence - total), xy, theta, mode)


def check_certificate(bounded: palpate.BoundedPosterior, dense: DensePosterior) -> Json:
    """Holds the posterior's estimate and marginals against all bins of the same lattice.

    What the certificate `promised`, and what was `measured`, the largest of the dense posterior's mass in
    bins that were not counted, of the total variation between marginals, which is at most that of the
    posteriors, and of any object's error in probability; whether evidence and identity of every object
    lie in their intervals, too, so that it `holds`; and whether the mode is the `same_mode`, or one of
    the same likelihood.
    """
    estimate = bounded.estimate()
    mode, certificate = estimate.mode, estimate.certificate
    assert certificate is not None
    low, high = numpy.concatenate([certificate.log_evidence, estimate.identity_bounds]).T
    exact = numpy.concatenate([dense.log_evidence, dense.identity])
    holds = numpy.all((low - SUMMING_ERROR <= exact) & (exact <= high + SUMMING_ERROR))
    objects = len(dense.identity)
    marginals = [bounded.marginals(i) for i in range(objects)]
    counted, total = log_sum_exp(low[:objects]), log_sum_exp(dense.log_evidence)
    errors = {
        "mass_outside": max(0.0, -math.expm1(counted - total)),
        "total_variation": max(
            sum(float(numpy.abs(a - b).sum()) for a, b in zip(ours, theirs, strict=True)) / 2.0
            for ours, theirs in (
                ([of.xy for of in marginals], dense.xy),
                ([of.theta for of in marginals], dense.theta),
            )
        ),
        "identity_error": float(numpy.abs(numpy.array(estimate.identity) - dense.identity).max()),
    }
    promised, measured = certificate.dropped_mass, max(errors.values())
    same = (mode.object, mode.bin) == dense.mode[:2]
    return errors | {
        "promised": promised,
        "measured": measured,
        "holds": bool(holds) and measured <= promised + SUMMING_ERROR,
        "bins_evaluated": certificate.bins_evaluated,
        "same_mode": same or abs(mode.log_likelihood - dense.mode[2]) <= SUMMING_ERROR,
    }
