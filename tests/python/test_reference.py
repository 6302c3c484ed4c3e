"""The float64 reference agrees with the device."""

import numpy
import pytest

import palpate
from palpate import reference


def test_the_reference_has_the_map_of_the_builder(device: palpate.Device) -> None:
    touches = palpate.simulate("A", seed=1)[:20]
    builder = palpate.MapBuilder(device)
    builder.add(touches)
    grid = builder.build("A")
    expected = reference.log_odds_map(touches, grid)
    # The bound that MapBuilder states.
    assert numpy.all(abs(grid.log_odds - expected) <= numpy.maximum(1e-3, 1e-4 * abs(expected)))


def test_the_reference_has_the_belief_of_the_histogram(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    lattice = palpate.PoseLattice((-10, 10, 7), (-10, 10, 6), (0, 2 * numpy.pi, 5))
    belief = palpate.PoseHistogram(device, maps, lattice)
    belief.update(unknown)
    bins = [reference.log_likelihoods(unknown, lattice, grid) for grid in maps]
    for i, expected in enumerate(bins):
        # 1e-4 nats per touch, in float32 on the device.
        assert numpy.allclose(belief.log_likelihood(i), expected, atol=1e-3, rtol=0)
    assert numpy.allclose(belief.estimate().identity, reference.identity(bins), atol=1e-3)
    pose = lattice.T_object_robot(lattice.bins // 2)
    one = sum(reference.log_likelihood(touch, pose, maps[0]) for touch in unknown)
    assert one == pytest.approx(bins[0].ravel()[lattice.bins // 2], abs=1e-9)
    assert reference.pose_error_mm(maps[0], pose, (1, 2, 3)) == pytest.approx(
        palpate.pose_error_mm(maps[0], pose, (1, 2, 3)), abs=1e-9
    )
    assert set(reference.classify(unknown[0]).tolist()) <= {0, 1, 8}


@pytest.mark.parametrize("kind", [palpate.PoseHistogram, palpate.BoundedPosterior])
def test_gains_are_never_below_zero_and_have_standard_errors(
    device: palpate.Device,
    maps: list[palpate.OccupancyGrid],
    unknown: palpate.Recording,
    kind: type[palpate.PoseHistogram] | type[palpate.BoundedPosterior],
) -> None:
    belief = kind(device, maps, palpate.PoseLattice((-5, 5, 8), (-5, 5, 8)))
    belief.update(unknown[0])
    poses = [[0, 0, 0], [3, -2, 1], [500, 0, 0]]
    gains = belief.expected_gain(poses, palpate.digitacts_array(), samples=16)
    identity, pose = gains
    assert numpy.all(identity >= 0) and numpy.all(pose >= 0)
    assert numpy.array_equal(gains.both, identity + pose)
    for error in (gains.identity_error, gains.pose_error, gains.both_error):
        assert error.shape == (3,)
        assert numpy.all((error >= 0) & (error < 1))
    assert gains.both[2] == pytest.approx(0, abs=1e-5)  # far from every object


def test_angles_that_would_count_twice_are_refused() -> None:
    with pytest.raises(palpate.Error, match="theta_rad = 0:7: wider than the full circle"):
        palpate.PoseLattice((-1, 1, 3), (-1, 1, 3), (0, 7, 4))
