"""The statistics of the programs beside known values, and the trials beside those of C++."""

import functools
import math

import numpy
import pytest

import palpate
from bench.measures import bootstrap_record, calibration, differences, gains, knee_of, normalised_error
from bench.measures import share_record, student_record, told_apart, with_interval
from bench.sweep import front_of
from bench.sweep_runs import by_bounds, comparison_of, follow, nearest_bin_mm
from bench.trials import Body, Touching, lattice_of, letter_maps, make_trials, map_of, truth_of
from palpate._palpate import Random, Stream
from palpate._statistics import errors_over, quantile
from palpate._tables import column


def test_random_numbers_are_those_of_their_purpose() -> None:
    # Any number of draws at once gives the same numbers.
    together, apart = Random(7, Stream.pose_noise), Random(7, Stream.pose_noise)
    whole = together.uniforms(1_000)
    assert (whole == numpy.concatenate([apart.uniforms(n) for n in (1, 311, 312, 376)])).all()
    # The module draws x, y and theta of an object from one stream.
    x, y, turn = Random(42, Stream.object_pose).uniforms(3)
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
    assert share_record(50, 50) == pytest.approx({"mean": 1.0, "low": 0.92865, "high": 1.0}, abs=1e-5)
    assert share_record(0, 10) == pytest.approx({"mean": 0.0, "low": 0.0, "high": 0.27753}, abs=1e-5)
    # Student's t for nine degrees of freedom is 2.262.
    told = student_record([float(i) for i in range(10)])
    assert told["high"] - told["mean"] == pytest.approx(2.262 * math.sqrt(82.5 / 9 / 10), rel=1e-3)
    assert (told["low"] + told["high"]) / 2 == pytest.approx(told["mean"]) == 4.5
    assert student_record([1.0, 2.0]) == {"mean": 1.5}, "two tell no interval"
    # The bootstrap's interval of many values is the normal one.
    many = Random(1, Stream.pose_noise).normals(400)
    told = bootstrap_record(many)
    assert told["high"] - told["low"] == pytest.approx(2 * 1.96 * many.std() / 20, rel=0.1)
    assert told["low"] < many.mean() < told["high"]
    ratio = bootstrap_record(2.0 * numpy.abs(many), numpy.abs(many))
    assert ratio == pytest.approx({"mean": 2.0, "low": 2.0, "high": 2.0})
    assert with_interval(".1f", 100.0)(share_record(5, 10)) == "50.0 (23.7 to 76.3)"


def test_pairs_told_apart() -> None:
    assert told_apart([0.0, 1.0], [2.0, 3.0])["mean"] == 1.0
    assert told_apart([1.0], [1.0])["mean"] == 0.5
    assert told_apart([0.0, 2.0], [1.0])["mean"] == 0.5
    assert told_apart([0.0] * 50, [1.0] * 90) == share_record(50, 50)


def test_fields_are_arrays_as_records_lie() -> None:
    found = column([[{"a": {"b": 1}}, {"a": {"b": 2}}], [{"a": None}, {}]], "a/b")
    assert numpy.array_equal(found, [[1.0, 2.0], [numpy.nan, numpy.nan]], equal_nan=True)


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
    costs, errors = numpy.array([3.0, 1.0, 2.0, 2.0]), numpy.array([1.0, 3.0, 3.0, 2.0])
    assert front_of(costs, errors).tolist() == [1, 3, 0]


@pytest.fixture(scope="module")
def maps(device: palpate.Device) -> list[palpate.OccupancyGrid]:
    return letter_maps(device)


def test_the_normalised_error_is_the_error_in_standard_deviations(
    device: palpate.Device, maps: list[palpate.OccupancyGrid]
) -> None:
    belief = palpate.PoseHistogram(device, maps, lattice_of((20, 20, 75)))
    trials = {truth_of(trial).object: trial for trial in make_trials("AIO", 1, 9, 11)}
    for index, label in ((0, "A"), (2, "I"), (3, "O")):
        belief.reset()
        belief.update(trials[label])
        mode = belief.estimate().mode
        assert maps[mode.object].label == label
        refined = belief.refine(mode)
        pose, grid = refined.T_object_robot, maps[index]
        nees = functools.partial(normalised_error, grid, pose, refined.covariance)
        assert nees(pose) == pytest.approx(0.0, abs=1e-9)
        turn = {"A": 2.0 * math.pi, "I": math.pi, "O": 1.0}[label]
        s, c = math.sin(turn), math.cos(turn)
        centroid = Body.of(grid).centroid_mm
        about = centroid - numpy.array([[c, -s], [s, c]]) @ centroid
        equal = palpate.compose([*about, turn], pose)
        assert nees(equal) == pytest.approx(0.0, abs=1e-9), label
        if label == "A":
            off = 2.0 * math.sqrt(1.0 / numpy.linalg.inv(refined.covariance)[0, 0])
            assert nees(pose + (off, 0.0, 0.0)) == pytest.approx(4.0)


def test_bounds_give_the_histograms_poses(
    device: palpate.Device, maps: list[palpate.OccupancyGrid]
) -> None:
    bins = (30, 30, 113)
    lattice, trials = lattice_of(bins), make_trials("AIO", 1, 9, 1_000)
    full, ends = palpate.PoseHistogram(device, maps, lattice), []
    for trial in trials:
        full.reset()
        ends.append(follow(full, maps, trial))
    records = by_bounds(device, maps, trials, bins)
    compared = comparison_of(maps, trials, ends, records)
    assert compared["compared_trials"] == 3
    assert compared["mode_difference_mm"] == 0.0 and compared["refined_difference_mm"] < 1e-5
    for trial, record in zip(trials, records, strict=True):
        body, truth = Body.of(map_of(maps, trial)), truth_of(trial).T_object_robot
        assert 0.0 < nearest_bin_mm(lattice, body, truth) <= record["error_mm"]
