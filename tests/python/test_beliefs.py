"""Options and results of the estimators reach C++ and come back as they are named; the float64 reference agrees."""

from typing import Any

import numpy
import pytest
from conftest import Maps, built, error_of

import palpate
from palpate import reference


def test_a_pose_is_refined_near_the_mode_that_is_given(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording
) -> None:
    a, e, i = maps
    belief = palpate.PoseHistogram(device, [a, e, i])
    rotated = palpate.PoseHistogram(device, [e, i, a])
    for each in (belief, rotated):
        each.update(unknown)
    mode = belief.estimate().mode
    assert (mode.object, rotated.estimate().mode.object) == (1, 0)
    refined = belief.refine()
    assert numpy.array_equal(belief.refine(mode).T_object_robot, refined.T_object_robot)
    of_a = belief.refine(rotated.estimate().mode)  # an A where the E is
    assert not numpy.array_equal(of_a.T_object_robot, refined.T_object_robot)
    inverse = palpate.inverse(refined.T_object_robot)
    assert refined.T_robot_object == pytest.approx(inverse, abs=1e-12)
    variances = refined.T_robot_object_covariance.diagonal()
    assert refined.sd**2 == pytest.approx(variances)
    assert not numpy.allclose(variances[:2], refined.covariance.diagonal()[:2], rtol=1e-3)


def test_marginals_are_over_the_grid_that_is_given(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording
) -> None:
    belief = palpate.BoundedPosterior(device, maps)
    belief.update(unknown)
    coarse = palpate.PoseLattice((-10, 10, 5), (-10, 10, 3), (0, 2 * numpy.pi, 4))
    marginals = belief.marginals(1, coarse)
    assert (marginals.xy.shape, marginals.theta.shape) == ((3, 5), (4,))
    assert belief.marginals(1).xy.shape == (25, 25)
    assert marginals.xy.sum() == pytest.approx(belief.marginals(1).xy.sum())


def test_a_map_is_built_by_the_classifier_that_is_given(device: palpate.Device, maps: Maps) -> None:
    by_strong = built(device, palpate.simulate("E", seed=1), classifier=palpate.ContactClassifier(threshold=8.0))
    assert (by_strong.log_odds > 0).sum() < (maps[1].log_odds > 0).sum()


def test_bins_and_seeds_are_the_ones_that_are_given() -> None:
    lattice = palpate.PoseLattice((-1, 1, 2), (-1, 1, 2), (0, 1, 2))
    assert lattice.T_object_robot(0).tolist() == [-0.5, -0.5, 0.25]
    assert lattice.T_object_robot(7).tolist() == [0.5, 0.5, 0.75]
    for bin in (-1, 8):
        with pytest.raises(IndexError, match=f"bin {bin} of 8"):
            lattice.T_object_robot(bin)
    poses = [palpate.random_object_pose(seed).tolist() for seed in (1, 2, 1)]
    assert poses[0] == poses[2] != poses[1]


def test_recordings_of_different_units_are_not_recognised_together(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording
) -> None:
    arrays = (unknown.pressure, unknown.T_robot_sensor, unknown.elements_mm)
    raw, psi = (palpate.Recording(*arrays, pressure_unit=unit) for unit in ("raw", "psi"))
    assert "raw" in error_of(palpate.recognize, [unknown, raw], maps, bins=(5, 5, 4), device=device)
    assert "'psi'; make it 'kPa' or 'raw'" in error_of(palpate.recognize, psi, maps, device=device)


def test_likely_bins_and_modes_are_the_belief(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording, posterior: palpate.PoseHistogram
) -> None:
    bins, shares = posterior.likely_bins(1, 1e-7)
    assert error_of(posterior.likely_bins, 1, numpy.nan).startswith("least_share = nan")
    logs = posterior.log_likelihood(1).ravel()
    expected = numpy.exp(logs - logs.max())
    assert shares == pytest.approx(expected[bins] / expected.sum(), rel=1e-3)
    assert shares.sum() == pytest.approx(1.0, abs=1e-3)
    [record] = palpate.recognize(unknown, maps, device=device)
    first = record.modes[0]
    assert first.object == record.best and first.covariance.shape == (3, 3)
    assert sum(mode.probability for mode in record.modes) <= 1.0 + 1e-9
    assert 0.0 < record.refined.share <= 1.0
    assert "act" in repr(record) and record.decision.because
    assert record.refined_error_mm < 1.0
    [lenient] = palpate.recognize(unknown, maps, device=device, act_below_mm=20.0, act_above=0.5)
    assert lenient.decision.act and lenient.decision.within_mm <= 20.0
    assert "act_above=2" in error_of(palpate.recognize, unknown, maps, device=device, act_above=2.0)


def test_evaluated_bins_are_those_of_the_histogram_and_of_the_reference(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording
) -> None:
    lattice = palpate.PoseLattice((-10, 10, 12), (-10, 10, 11), (0, 6.28, 16))
    dense = palpate.PoseHistogram(device, maps, lattice)
    bounded = palpate.BoundedPosterior(device, maps, lattice)
    for belief in (dense, bounded):
        belief.update(unknown)
    index, values, rest = bounded.evaluated_bins()
    bins = numpy.stack([dense.log_likelihood(i) for i in range(len(maps))])
    where = numpy.unravel_index(index, bins.shape)
    assert 0 < len(index) < bins.size
    assert values == pytest.approx(bins[where], abs=1e-3)
    mass = numpy.exp(bins - bins.max())
    assert 0 < numpy.delete(mass, index).sum() / mass.sum() <= rest < 1e-5
    expected = [reference.log_likelihoods(unknown, lattice, grid) for grid in maps]
    # 1e-4 nats per touch, in float32 on the device.
    assert numpy.allclose(bins, expected, atol=1e-3, rtol=0)
    assert numpy.allclose(dense.estimate().identity, reference.identity(expected), atol=1e-3)
    pose = lattice.T_object_robot(lattice.bins // 2)
    one = sum(reference.log_likelihood(touch, pose, maps[0]) for touch in unknown)
    assert one == pytest.approx(expected[0].ravel()[lattice.bins // 2], abs=1e-9)
    assert reference.pose_error_mm(maps[0], pose, (1, 2, 3)) == pytest.approx(
        palpate.pose_error_mm(maps[0], pose, (1, 2, 3)), abs=1e-9
    )
    assert set(reference.classify(unknown[0]).tolist()) <= {0, 1, 8}


def test_the_reference_has_the_map_of_the_builder(device: palpate.Device) -> None:
    touches = palpate.simulate("A", seed=1)[:20]
    grid = built(device, touches)
    expected = reference.log_odds_map(touches, grid)
    # The bound that MapBuilder states.
    assert numpy.all(abs(grid.log_odds - expected) <= numpy.maximum(1e-3, 1e-4 * abs(expected)))


@pytest.mark.parametrize("kind", [palpate.PoseHistogram, palpate.BoundedPosterior])
def test_gains_come_with_standard_errors(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording, kind: Any
) -> None:
    belief = kind(device, maps, palpate.PoseLattice((-5, 5, 8), (-5, 5, 8)))
    belief.update(unknown[0])
    gains = belief.expected_gain([[0, 0, 0], [3, -2, 1], [500, 0, 0]], palpate.digitacts_array(), samples=16)
    identity, pose = gains
    assert numpy.array_equal(gains.both, identity + pose) and min(*identity, *pose) >= 0
    for error in (gains.identity_error, gains.pose_error, gains.both_error):
        assert error.shape == (3,)
        assert numpy.all((error >= 0) & (error < 1))
    assert gains.both[0] > gains.both[2] == pytest.approx(0, abs=1e-5), "far from every object"
