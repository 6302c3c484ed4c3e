"""The posterior over all bins in float64, which certificates of a search by bounds are held against."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy

import palpate
from palpate import reference

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
            flat[bin_] = math.fsum(
                reference.log_likelihood(touch, pose, grid, contact) for touch in touches
            )
        bins.append(logs)
    evidence = numpy.array([log_weight + log_sum_exp(logs) for logs in bins])
    total = log_sum_exp(evidence)
    best = max(range(len(bins)), key=lambda i: float(bins[i].max()))
    mode = (best, int(bins[best].argmax()), float(bins[best].max()))
    masses = [numpy.exp(logs + log_weight - total) for logs in bins]
    xy = [mass.sum(axis=0) for mass in masses]
    theta = [mass.sum(axis=(1, 2)) for mass in masses]
    return DensePosterior(evidence, numpy.exp(evidence - total), xy, theta, mode)


class CertificateCheck(NamedTuple):
    """What a certificate promised and how far the answer really was from the dense posterior."""

    promised: float  #: dropped_mass
    mass_outside: float  #: of the dense posterior, in bins that were not counted
    total_variation: float  #: largest between marginals; at most that of the posteriors
    identity_error: float  #: largest of any object's probability
    same_mode: bool  #: the same bin, or one of the same likelihood
    bounds_hold: bool  #: evidence and identity of every object lie in their intervals

    @property
    def measured(self) -> float:
        """The largest of the measured errors, which the certificate bounds."""
        return max(self.mass_outside, self.total_variation, self.identity_error)

    @property
    def holds(self) -> bool:
        """Whether everything is as the certificate says."""
        return self.bounds_hold and self.measured <= self.promised + SUMMING_ERROR


def check_certificate(bounded: palpate.BoundedPosterior, dense: DensePosterior) -> CertificateCheck:
    """Holds the posterior's estimate and marginals against all bins of the same lattice."""
    estimate = bounded.estimate()
    certificate = estimate.certificate
    assert certificate is not None
    mode = estimate.mode
    # Two bins of one likelihood up to rounding are both modes.
    same = (mode.object, mode.bin) == dense.mode[:2]
    same = same or abs(mode.log_likelihood - dense.mode[2]) <= SUMMING_ERROR
    bounds_hold, xy, theta = True, 0.0, 0.0
    for i, (evidence, probability) in enumerate(
        zip(certificate.log_evidence, estimate.identity_bounds, strict=True)
    ):
        for value, (low, high) in (
            (dense.log_evidence[i], evidence),
            (dense.identity[i], probability),
        ):
            bounds_hold &= bool(low - SUMMING_ERROR <= value <= high + SUMMING_ERROR)
        marginals = bounded.marginals(i)
        xy += float(numpy.abs(marginals.xy - dense.xy[i]).sum()) / 2.0
        theta += float(numpy.abs(marginals.theta - dense.theta[i]).sum()) / 2.0
    counted = log_sum_exp(numpy.array([low for low, _ in certificate.log_evidence]))
    outside = max(0.0, -math.expm1(counted - log_sum_exp(dense.log_evidence)))
    identity = float(numpy.abs(numpy.array(estimate.identity) - dense.identity).max())
    return CertificateCheck(
        certificate.dropped_mass, outside, max(xy, theta), identity, same, bounds_hold
    )
