"""The statistics of the programs beside known values, and the trials beside those of C++."""

import math

import numpy
import pytest

import palpate
from bench.certificates import log_sum_exp
from bench.measures import (
    bootstrap_mean_interval,
    bootstrap_ratio_interval,
    calibration,
    differences,
    gains,
    knee_of,
    mean_interval,
    normalised_error,
    pareto_front,
    told_apart,
    wilson_interval,
)
from bench.random_numbers import MersenneTwister, Random, Stream, seed_sequence
from bench.trials import Body, Touching, lattice_of, letter_maps, make_trials, truth_of
from bench.windows import estimate_in_window, nearest_bin_mm, placed, windows_about
from palpate._statistics import errors_over, quantile


def test_random_numbers_are_those_of_cpp() -> None:
    # The C++ standard: the 10,000th number of std::mt19937_64, which is seeded with 5489.
    state = [5489]
    for i in range(1, 312):
        state.append(6364136223846793005 * (state[-1] ^ state[-1] >> 62) + i & 2**64 - 1)
    assert MersenneTwister(numpy.array(state, numpy.uint64)).draw(10_000)[-1] == 9981545732273789042
    # Any number of draws at once gives the same numbers.
    together, apart = Random(7, Stream.POSE_NOISE), Random(7, Stream.POSE_NOISE)
    whole = together.uniforms(1_000)
    assert (whole == numpy.concatenate([apart.uniforms(n) for n in (1, 311, 312, 376)])).all()
    assert 0.0 <= whole.min() and whole.max() < 1.0
    assert len(set(seed_sequence([1, 2, 3], 624))) > 600
    assert sorted(Random(3, Stream.TOUCH_ORDER).order(192)) == list(range(192))
    normals = Random(5, Stream.POSE_NOISE).normals(4_000)
    assert abs(normals.mean()) < 4 / math.sqrt(4_000)
    assert normals.std() == pytest.approx(1.0, abs=0.05)


def test_object_poses_are_those_of_the_module() -> None:
    # The module draws x, y and theta from the same stream.
    x, y, turn = Random(42, Stream.OBJECT_POSE).uniforms(3)
    expected = (20.0 * x - 10.0, 20.0 * y - 10.0, 2.0 * math.pi * turn)
    assert palpate.random_object_pose(42) == pytest.approx(expected, abs=1e-12)


def test_more_trials_and_touches_begin_with_the_same() -> None:
    few, more = make_trials("AO", 1, 3, 5), make_trials("AO", 2, 7, 5)
    for a, b in zip(few, [more[0], more[2]], strict=True):
        assert (a.pressure == b.pressure[:3]).all()
        assert (truth_of(a).T_object_robot == truth_of(b).T_object_robot).all()
    noisy = make_trials("AO", 1, 3, 5, Touching(noise=(1.0, 0.05)))
    assert (noisy[0].pressure == few[0].pressure).all(), "readings stay as they are"
    assert not numpy.allclose(noisy[0].T_robot_sensor, few[0].T_robot_sensor, atol=1e-3)
    with pytest.raises(palpate.Error, match="give 1 to 192"):
        make_trials("A", 1, 193, 5)


def test_quantiles_and_errors() -> None:
    values = [5.0, 1.0, 4.0, 2.0, 3.0]
    assert (quantile(values, 0.5), quantile(values, 0.95), quantile(values, 0.2)) == (3.0, 5.0, 1.0)
    assert quantile([2.0, 1.0], 0.5) == 1.0, "the lower of two"
    errors = errors_over([1.0, None, 3.0])
    assert errors is not None
    assert (errors["trials"], errors["mean"], errors["standard_error"]) == (2, 2.0, 1.0)
    assert errors["p95"] == 3.0 and errors["median"] == 1.0
    assert errors_over([1.0, 3.0], 20) == errors | {"p95": None}, "too few for a percentile"
    assert errors_over([None]) is None


def test_intervals() -> None:
    # Wilson's by hand: of 50 of 50, 1 / (1 + z^2 / n).
    assert wilson_interval(50, 50) == pytest.approx((0.92865, 1.0), abs=1e-5)
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.27753), abs=1e-5)
    # Student's t for nine degrees of freedom is 2.262.
    values = [float(i) for i in range(10)]
    interval = mean_interval(values)
    assert interval is not None and mean_interval([1.0, 2.0]) is None
    low, high = interval
    assert (high - low) / 2 == pytest.approx(2.262 * math.sqrt(82.5 / 9 / 10), rel=1e-3)
    assert (low + high) / 2 == pytest.approx(4.5)
    # Of many values the bootstrap's interval is the normal one.
    many = Random(1, Stream.POSE_NOISE).normals(400)
    low, high = bootstrap_mean_interval(many)
    assert high - low == pytest.approx(2 * 1.96 * many.std() / 20, rel=0.1)
    assert low < many.mean() < high
    assert bootstrap_ratio_interval(2.0 * numpy.abs(many), numpy.abs(many)) == pytest.approx(
        (2.0, 2.0)
    )


def test_pairs_told_apart() -> None:
    assert told_apart([0.0, 1.0], [2.0, 3.0])[0] == 1.0
    assert told_apart([1.0], [1.0])[0] == 0.5
    assert told_apart([0.0, 2.0], [1.0])[0] == 0.5
    assert told_apart([0.0] * 50, [1.0] * 90) == (1.0, wilson_interval(50, 50))


def test_calibration_weighs_bins_by_their_counts() -> None:
    told = calibration([0.95, 0.95, 0.95, 0.55], [True, True, False, True])
    assert told["expected_error"] == pytest.approx(0.75 * (0.95 - 2 / 3) + 0.25 * 0.45)
    assert [part["count"] for part in told["bins"]] == [1, 3]


def test_knees_and_fronts() -> None:
    coarse, fine = [1.0, 1.1, 0.9], [0.5, 0.6, 0.4]
    assert knee_of([coarse, fine, fine]) == 1
    assert knee_of([coarse, fine]) is None, "no finer run confirms the last"
    assert knee_of([[None, 0.5, 0.5], fine, fine]) == 1, "one trial is not located"
    assert gains(coarse, fine) and not gains(fine, coarse)
    assert not gains([1.0], [0.1]), "a single trial tells nothing"
    paired = differences([0.5, None, 0.7], [1.0, 1.1, 0.8])
    assert paired is not None and paired["trials"] == 2, "trials that both locate"
    assert (paired["from"], paired["to"]) == pytest.approx((0.9, 0.6))
    assert paired["mean"] == pytest.approx(-0.3)
    assert differences([None], [1.0]) is None
    entries = [
        {"cost": cost, "error": error}
        for cost, error in ((3.0, 1.0), (1.0, 3.0), (2.0, 3.0), (2.0, 2.0))
    ]
    assert pareto_front(entries) == [entries[1], entries[3], entries[0]]


def test_log_sum_exp_neither_overflows_nor_loses() -> None:
    assert log_sum_exp(numpy.array([1000.0, 1000.0])) == pytest.approx(1000.0 + math.log(2.0))


@pytest.fixture(scope="module")
def maps(device: palpate.Device) -> list[palpate.OccupancyGrid]:
    return letter_maps(device)


def test_the_normalised_error_is_the_error_in_standard_deviations(
    device: palpate.Device, maps: list[palpate.OccupancyGrid]
) -> None:
    belief = palpate.PoseHistogram(device, maps, lattice_of(20, 20, 75))
    trials = {truth_of(trial).object: trial for trial in make_trials("AIO", 1, 9, 11)}
    for index, label in ((0, "A"), (2, "I"), (3, "O")):
        belief.reset()
        belief.update(trials[label])
        mode = belief.estimate().mode
        assert maps[mode.object].label == label
        refined = belief.refine(mode)
        pose, grid = refined.T_object_robot, maps[index]
        assert normalised_error(grid, refined, pose) == pytest.approx(0.0, abs=1e-9)
        turn = {"A": 2.0 * math.pi, "I": math.pi, "O": 1.0}[label]
        s, c = math.sin(turn), math.cos(turn)
        centroid = Body.of(grid).centroid_mm
        about = centroid - numpy.array([[c, -s], [s, c]]) @ centroid
        equal = palpate.compose([*about, turn], pose)
        assert normalised_error(grid, refined, equal) == pytest.approx(0.0, abs=1e-9), label
        if label == "A":
            off = 2.0 * math.sqrt(1.0 / numpy.linalg.inv(refined.covariance)[0, 0])
            assert normalised_error(grid, refined, pose + (off, 0.0, 0.0)) == pytest.approx(4.0)


def test_windows_give_the_full_posteriors_poses(
    device: palpate.Device, maps: list[palpate.OccupancyGrid]
) -> None:
    lattice = lattice_of(30, 30, 113)
    full = palpate.PoseHistogram(device, maps, lattice)
    for trial in make_trials("AIO", 1, 9, 1_000):
        truth = placed(maps, trial)
        full.reset()
        full.update(trial)
        mode = full.estimate().mode
        step = estimate_in_window(device, maps, trial, lattice)
        assert step.mode.T_object_robot[:2] == pytest.approx(mode.T_object_robot[:2], abs=1e-9)
        refined = full.refine(mode).T_object_robot
        assert step.refined.T_object_robot[:2] == pytest.approx(refined[:2], abs=1e-5)
        assert step.error_mm is not None
        assert nearest_bin_mm(lattice, truth) <= step.error_mm
        bins = sum(window.bins for window in windows_about(lattice, truth, 3.0))
        assert bins < lattice.bins / 2, "a window is a part"
