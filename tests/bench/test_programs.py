"""The other programs with small settings: their documents are whole, and keep what must hold."""

import os
import pathlib
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy
import pytest
from conftest import Program, expect_refused, run

import palpate
from bench import accuracy, check
from bench.scenarios import slipping
from bench.trials import make_trials, truth_of

Rows = list[dict[str, Any]]


@pytest.fixture(scope="module")
def small() -> Iterator[pytest.MonkeyPatch]:
    with pytest.MonkeyPatch.context() as patch:
        yield patch


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory, small: pytest.MonkeyPatch) -> Rows:
    # Takes some twelve seconds of a processor.
    few = replace(accuracy.SCENARIOS["strangers"], learned=("A", "E", "U"), after=(1, 3))
    small.setitem(accuracy.SCENARIOS, "strangers", few)
    scenarios = ("other-gains", "misplaced-2mm", "fit", "strangers", "planned")
    folder = tmp_path_factory.mktemp("accuracy")
    found: Rows = Program(folder, "bench.accuracy", "--quick", *scenarios).document["accuracy"]
    return found


def rows_of(rows: Rows, scenario: str, touches: str) -> dict[str, Any]:
    """The rows of a scenario after some touches, by engine."""
    return {row["engine"]: row for row in rows if (row["scenario"], row["touches"]) == (scenario, touches)}


def test_averaging_makes_misplaced_touches_honest(rows: Rows) -> None:
    of_touches = [rows_of(rows, "misplaced-2mm", touches) for touches in ("3", "5")]
    exact, averaged = (sum(of[name]["nees"]["mean"] for of in of_touches) for name in ("as if exact", "averaged"))
    assert averaged < 0.7 * exact, "too sure"
    last = of_touches[-1]
    assert last["as if exact"]["over_first"] is None and last["averaged"]["over_first"]["mean"] < 1.0


def test_strangers_are_told_from_what_was_learned(rows: Rows) -> None:
    for row in rows_of(rows, "strangers", "3").values():
        assert (row["unknowns"], row["strangers"]) == (3, 3)
        assert row["called_none"]["mean"] == 0.0 and row["strangers_called_none"]["mean"] > 0.5
        assert row["told_apart_by_none"]["mean"] > 0.8, "of nine pairs"
    (fit,) = rows_of(rows, "fit", "5").values()
    assert (fit["unknowns"], fit["strangers"], fit["fits"]["mean"]) == (5, 8, 1.0)
    assert fit["told_apart_by_z"]["mean"] > 0.8, "of forty pairs, by maps of few touches"


def test_regions_and_errors_are_of_what_is_recognised(rows: Rows) -> None:
    for touches in ("1", "3", "5"):
        of_engines = rows_of(rows, "other-gains", touches)
        assert list(of_engines) == ["Eq. 7", "learned"]
        for row in of_engines.values():
            assert row["coverage_68"]["mean"] <= row["coverage_95"]["mean"], "the larger holds the smaller"
            assert (row["unknowns"], row["strangers"]) == (3, 0) and "called_none" not in row
    assert of_engines["learned"]["right"]["mean"] == 1.0 and of_engines["learned"]["median_mm"] < 0.5


def test_planned_touches_begin_as_those_at_random(rows: Rows) -> None:
    first, last = (rows_of(rows, "planned", touches) for touches in ("1", "3"))
    assert first["at random"]["log_loss"] == first["planned"]["log_loss"]
    assert last["at random"]["refined_mm"] != last["planned"]["refined_mm"]


def test_a_walk_keeps_touches_where_they_are_on_the_object() -> None:
    (trial,) = make_trials("A", 1, 5, 7)
    walk, truths = slipping(trial, numpy.array([1.0, 2.0]), (0.3, 0.02), 11)
    assert (walk.pressure == trial.pressure).all() and len(truths) == 5
    for of_walk, truth, at_rest in zip(walk.T_robot_sensor, truths, trial.T_robot_sensor, strict=True):
        on_object = palpate.compose(truth_of(trial).T_object_robot, at_rest)
        assert palpate.compose(truth, of_walk) == pytest.approx(on_object, abs=1e-9)


@pytest.fixture(scope="module")
def bounded(tmp_path_factory: pytest.TempPathFactory, device: palpate.Device) -> Program:
    folder = tmp_path_factory.mktemp("bounded")
    file = folder / "times.json"
    flags = ["--quick", "--part", "search", "--json", str(file), "--device", device.name]
    subprocess.run([os.environ["PALPATE_BENCH"], "bounded", *flags], check=True, timeout=300)
    return Program(folder, "bench.bounded", "--quick", "--plots", folder / "plots", "--times", file)


def test_certificates_hold(bounded: Program, tmp_path: pathlib.Path) -> None:
    assert len(bounded.document["accuracy"]) == 4, "two lattices after 3 and 9 touches"
    for checks in bounded.document["accuracy"]:
        assert checks["holds"] == checks["same_mode"] == [True] * 5
        for name in ("mass_outside", "total_variation", "identity_error"):
            for promised, measured in zip(checks["promised"], checks[name], strict=True):
                assert measured <= promised + 1e-11 <= 1e-6 + 1e-11
    missing = run("bench.bounded", "--part", "presses", "--presses", tmp_path / "missing")
    expect_refused(missing, "holds no recording")


def test_search_becomes_a_picture(bounded: Program, tmp_path: pathlib.Path) -> None:
    plots = bounded.folder / "plots"
    assert (plots / "bounded_search.png").stat().st_size > 10_000
    (tmp_path / "mode.json").write_text('{"mode": []}')
    partial = run("bench.bounded", "--plots", plots, "--times", tmp_path / "mode.json")
    expect_refused(partial, "holds no search")


def test_a_sweep_is_whole_and_in_order(tmp_path: pathlib.Path) -> None:
    # Takes some ten seconds of a processor, for every filter, lattices and their limits.
    sweep = Program(tmp_path, "bench.sweep", "--quick", "--trials", 1, "--plots", tmp_path / "plots")
    sweep.expect_charts("sweep_front", "sweep_bins", "sweep_bounds")
    document = sweep.document
    assert {point["filter"] for point in document["points"]} == {
        "histogram", "particles", "systematic", "augmented",
    }  # fmt: skip
    for point in document["points"]:
        assert point["trials"] == 5
        assert 0.0 < point["seconds_per_touch"] < point["seconds_per_unknown"]
        assert (point["seconds_refine"] is None) == (point["filter"] != "histogram")
        assert point["error_mm"]["p95"] is None, "of so few trials it is the largest error"
        deviation = point["deviation_nats"]
        assert 0.0 < deviation["rms"] <= deviation["largest"] < 1e-4
        assert deviation["samples"] == 1_000
    for cell_mm in (0.5, 1.0):
        runs = [p for p in document["points"] if p["balanced"] and p["cell_mm"] == cell_mm]
        nearest = [run_of["nearest_bin_mm"] for run_of in runs]
        assert nearest == sorted(nearest, reverse=True)
        refined, finest, coarsest = (
            of["mean"] for of in (runs[-1]["refined_error_mm"], runs[-1]["error_mm"], runs[0]["error_mm"])
        )
        assert refined < finest < coarsest and nearest[-1] < finest
    for bounds in document["bounds"]:
        assert bounds["certificates_hold"] == bounds["same_modes"] == bounds["trials"]
        assert bounds["measured_error"] <= bounds["certificate"] + 1e-11 <= 1e-6 + 1e-11
    for knee in document["knees"]:
        assert "--bins fine takes" in knee["sentence"]
        for step in knee["steps"]:
            assert step["to"] >= 5 * step["from"]
            change = step["error_mm"]
            assert change["mean"] == pytest.approx(change["to"] - change["from"])
    assert document["limits"][1]["against"] == document["limits"][0]["name"]


def test_set_ups_are_checked(tmp_path: pathlib.Path, small: pytest.MonkeyPatch) -> None:
    # Takes some fifteen seconds of a processor: a set of three objects is checked ten times.
    small.setattr(check, "TOUCHES", 16)
    (row,) = Program(tmp_path, "bench.check", "--quick", "--trials", 1).document["check"]
    assert (row["elements"], row["sets"], row["sound"], row["order"], row["one_angle"]) == (36, 1, 1, 1, 1)
    assert (row["offset"], row["mount"], row["beyond"]) == (1, 1, 5)
    assert row["least_order_nats"] > 100 and row["most_mm"] < 0.5 and row["most_rad"] < 0.05
