"""The other programs with small settings: their documents are whole, and keep what must hold."""

import os
import pathlib
import subprocess
import pytest
from conftest import Program, run

import palpate


@pytest.fixture(scope="module")
def beliefs(tmp_path_factory: pytest.TempPathFactory) -> Program:
    # Takes some 40 seconds of a processor, for six parts and their charts; the maps are built once.
    folder = tmp_path_factory.mktemp("beliefs")
    return Program(folder, "bench.beliefs", "--quick", "--trials", 1, "--plots", folder / "plots")


def test_averaging_makes_misplaced_touches_honest(beliefs: Program) -> None:
    records = beliefs.document["misplaced"]
    assert len(records) == 2 * 4 * 2, "two displacements, four numbers of touches, two beliefs"
    for level_mm in (1.0, 2.0):
        nees = {
            belief: sum(
                record["normalised_error"]["mean"]
                for record in records
                if (record["noise_mm"], record["belief"]) == (level_mm, belief)
            )
            for belief in ("as if exact", "averaged")
        }
        assert nees["averaged"] < 0.7 * nees["as if exact"], "too sure"
    beliefs.expect_charts("misplaced", "sureness")
    assert (beliefs.folder / "plots/misplaced_unknown.png").stat().st_size > 10_000


def test_none_is_found(beliefs: Program) -> None:
    by = {(record["name"], record["touches"]): record for record in beliefs.document["none"]}
    exact = by["exact, ±10 mm", 9]
    assert exact["learned_called_none"]["mean"] == 0.0
    assert exact["unlearned_called_none"]["mean"] > 0.5
    one = by["exact, ±10 mm", 1]
    assert exact["told_apart"]["mean"] > 0.9 > one["told_apart"]["mean"], "one touch cannot tell"
    assert len(exact["unlearned_log_odds"]) == 8
    beliefs.expect_charts("none")


def test_a_belief_that_allows_for_slips_follows(beliefs: Program) -> None:
    following, plain = beliefs.document["slip"]
    assert following["late_error_mm"]["mean"] < plain["late_error_mm"]["mean"]
    assert following["located"] > 0.8
    beliefs.expect_charts("slip")


def test_planned_touches_tell_more(tmp_path: pathlib.Path) -> None:
    # Takes some six seconds, of which the letters' maps, as of every program, take three.
    plots = ("--plots", tmp_path / "plots")
    beliefs = Program(tmp_path, "bench.beliefs", "--quick", "--part", "plan", *plots)
    assert "none" not in beliefs.document, "a part alone"
    entropy = {
        record["order"]: [point["entropy"]["mean"] for point in record["curve"]]
        for record in beliefs.document["plan"]
    }
    assert entropy["planned"][0] == entropy["random"][0], "the same first touch"
    assert sum(entropy["planned"]) < sum(entropy["random"])
    for curve in entropy.values():
        assert curve == sorted(curve, reverse=True), "touches tell"
    beliefs.expect_charts("plan")


def test_costs_are_counted(beliefs: Program) -> None:
    costs = beliefs.document["cost"]
    value = {(cost["name"], *cost["bins"]): cost["value"] for cost in costs}
    assert 1.0 < value["memory over plain: uncertain", 30, 30, 113] <= 2.0
    assert value["uncertain touch to estimate", 25, 25, 16] > 0.0
    assert len(value) == len(costs) == 11


def test_unlearned_shapes_fit_worse(tmp_path: pathlib.Path) -> None:
    # Takes some twelve seconds, most for the maps of an array of 256 elements.
    fits = Program(tmp_path, "bench.fit", "--quick", "--trials", 1).document["fits"]
    assert len(fits) == 10, "two arrays after 1, 3, 5, 9 and 15 touches"
    for fit in fits:
        assert fit["learned"]["fits"]["mean"] == 1.0, fit["name"]
    by = {(fit["name"], fit["touches"]): fit for fit in fits}
    assert by["6x6 array", 9]["told_apart"]["mean"] > 0.8, "of forty pairs, by maps of 64 touches"
    assert by["16x16 array", 9]["never learned"]["does not fit"]["mean"] == 1.0


def test_shapes_drawn_at_random_are_strangers(tmp_path: pathlib.Path) -> None:
    # Takes some four seconds of a processor, to learn from five letters and to search for three strangers.
    command = ("--palpate", os.environ["PALPATE_COMMAND"])
    document = Program(tmp_path, "bench.strangers", "--quick", *command).document
    assert [row["sensor"] for row in document["strangers"]] == ["Eq. 7", "learned"]
    for row in document["strangers"]:
        assert row["learned_called_none"]["mean"] == 0.0
        assert row["strangers_called_none"]["mean"] > 0.5


def test_finer_steps_err_less(tmp_path: pathlib.Path) -> None:
    fine, coarse = Program(tmp_path, "bench.bin_steps", "--quick").document["runs"]
    assert fine["count"] > 4 * coarse["count"]
    assert fine["excess"] == 0.0 and fine["difference_mm"] is None
    assert coarse["difference_mm"]["mean"] == pytest.approx(
        coarse["refined_error_mm"]["mean"] - fine["refined_error_mm"]["mean"]
    )


@pytest.fixture(scope="module")
def bounded(tmp_path_factory: pytest.TempPathFactory, device: palpate.Device) -> Program:
    # Takes some eight seconds of a processor, half of them for the letters' maps.
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
    assert missing.returncode == 2 and "holds no recording" in missing.stderr


def test_search_becomes_a_picture(bounded: Program, tmp_path: pathlib.Path) -> None:
    plots = bounded.folder / "plots"
    assert (plots / "bounded_search.png").stat().st_size > 10_000
    (tmp_path / "mode.json").write_text('{"mode": []}')
    partial = run("bench.bounded", "--plots", plots, "--times", tmp_path / "mode.json")
    assert partial.returncode == 2 and "holds no search" in partial.stderr


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> Program:
    # Takes some 33 seconds of a processor, for every filter, lattices and their limits.
    folder = tmp_path_factory.mktemp("sweep")
    return Program(
        folder, "bench.sweep", "--quick", "--trials", 1,
        "--plots", folder / "plots",
    )  # fmt: skip


def test_a_sweep_is_whole_and_in_order(sweep: Program) -> None:
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
        assert (
            runs[-1]["refined_error_mm"]["mean"]
            < runs[-1]["error_mm"]["mean"]
            < runs[0]["error_mm"]["mean"]
        )
        assert runs[-1]["nearest_bin_mm"] < runs[-1]["error_mm"]["mean"]
    for bounds in document["bounds"]:
        assert bounds["certificates_hold"] == bounds["same_modes"] == bounds["trials"]
        assert bounds["measured_error"] <= bounds["certificate"] + 1e-11 <= 1e-6 + 1e-11
        assert bounds["auto"] == ("bounded" if bounds["bins_in_all"] > 100_000 else "histogram")
    for knee in document["knees"]:
        assert "--bins fine takes" in knee["sentence"]
        for step in knee["steps"]:
            assert step["to"] >= 5 * step["from"]
            change = step["error_mm"]
            assert change["mean"] == pytest.approx(change["to"] - change["from"])
    assert document["limits"][1]["against"] == document["limits"][0]["name"]


def test_set_ups_are_checked(tmp_path: pathlib.Path) -> None:
    # Takes some forty seconds of a processor: a set of three objects is checked ten times.
    document = Program(tmp_path, "bench.check", "--quick", "--trials", 1).document
    (row,) = document["check"]
    assert (row["elements"], row["sets"], row["sound"], row["order"], row["one_angle"]) == (36, 1, 1, 1, 1)
    assert (row["mount"], row["beyond"], row["precise"]) == (1, 5, 0)
    assert row["least_order_nats"] > 100 and row["most_mm"] < 0.5 and row["most_rad"] < 0.05


def test_the_sweep_draws_its_charts(sweep: Program) -> None:
    sweep.expect_charts("sweep_front", "sweep_bins", "sweep_bounds")


@pytest.mark.parametrize("flag", ["--equal-gains", "--misplaced"])
def test_regions_hold_the_truth_as_often_as_can_be(tmp_path: pathlib.Path, flag: str) -> None:
    # Takes some three seconds of a processor, to learn the sensor from touches of three letters; seven
    # where touches are misplaced, as each answer is a sum over displacements.
    command = ("--palpate", os.environ["PALPATE_COMMAND"], flag)
    document = Program(tmp_path, "bench.coverage", "--quick", "--trials", 1, *command).document
    assert document["gain_spread"] == (0.05 if flag == "--misplaced" else 0.0)
    rows = {(row["sensor"], row["touches"]): row for row in document["coverage"]}
    assert len(rows) == 2 * 2, "by both sensors, after two numbers of touches"
    for row in rows.values():
        assert row["unknowns"] == 3
        assert row["0.68"]["mean"] <= row["0.95"]["mean"], "the larger region holds the smaller"
    assert rows["Eq. 7", 1]["0.95"]["mean"] > 0.5
    acts = {(row["sensor"], row["touches"]): row["acts"]["mean"] for row in document["decisions"]}
    assert len(acts) == 2 * 2
    assert acts["learned", 5] == (0.0 if flag == "--misplaced" else 1.0), "within half a millimetre?"
