"""The experiment keeps the paper's order."""

import pathlib
import subprocess
import sys

import numpy
import pytest
from conftest import Program, expect_refused, run

from bench.experiment import standing

TRIALS, TOUCHES = 10, 9


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Program:
    # Takes some 15 seconds of a processor: eight filters, and three of them at two more levels of noise.
    folder = tmp_path_factory.mktemp("experiment")
    return Program(
        folder, "bench.experiment", "--quick", "--trials", TRIALS // 5, "--touches", TOUCHES,
        "--plots", folder / "plots",
    )  # fmt: skip


def test_curves_are_whole_and_touches_tell(experiment: Program) -> None:
    filters = experiment.document["filters"]
    assert len(filters) == 8
    for run_of in filters:
        curve = run_of["curve"]
        assert [point["touches"] for point in curve] == list(range(1, TOUCHES + 1))
        for point in curve:
            assert 0 <= point["accuracy_low"] <= point["accuracy"] <= point["accuracy_high"] <= 1
            assert point["located"] <= TRIALS
            assert (point["error_mm"] is None) == (point["located"] == 0)
            histogram = run_of["filter"] == "histogram" and point["located"] > 0
            assert (point["refined_error_mm"] is not None) == histogram
        assert curve[-1]["mean_confidence"] > curve[0]["mean_confidence"], "touches make sure"
        estimates = sum(part["count"] for part in run_of["calibration"]["bins"])
        assert estimates == TRIALS * TOUCHES


def test_finer_bins_err_less_and_histograms_lead(experiment: Program) -> None:
    last = {run_of["name"]: run_of["curve"][-1] for run_of in experiment.document["filters"]}
    of_bins = [last[f"histogram {size}"] for size in ("5x5x4", "10x10x10", "25x25x16", "13x13x55")]
    errors = [point["error_mm"]["mean"] for point in of_bins]
    assert errors == sorted(errors, reverse=True), "balanced bins err least"
    assert of_bins[-1]["accuracy"] == 1.0, "the paper's 10,000 bins know every letter after 9"
    assert last["histogram 10x10x10"]["accuracy"] > last["particles 1000"]["accuracy"] + 0.1
    refined = last["histogram 13x13x55"]["refined_error_mm"]["mean"]
    assert refined < 0.7 * errors[-1], "a pose between the bins is nearer than the bin"


def test_a_misplaced_array_costs_the_more_the_further(experiment: Program) -> None:
    levels = experiment.document["pose_noise"]
    assert [level["translation_mm"] for level in levels] == [1.0, 2.0]
    errors_mm = [
        run_of["curve"][-1]["error_mm"]["mean"]
        for filters in (experiment.document["filters"], *(level["filters"] for level in levels))
        for run_of in filters
        if run_of["name"] == "histogram 25x25x16"
    ]
    assert errors_mm[0] < errors_mm[1] < errors_mm[2]


def test_figures_are_drawn_and_a_table_is_printed(experiment: Program) -> None:
    experiment.expect_charts(
        "fig6a", "fig6b", "fig7a", "fig7b", "augmented", "errors", "refined", "pose_noise",
        "calibration",
    )  # fmt: skip
    assert "| histogram 5x5x4 | 0 mm, 0 rad | 10 | 9 |" in experiment.output


def test_what_cannot_be_is_refused(tmp_path: pathlib.Path) -> None:
    none = run("bench.experiment", "--trials", 0)
    assert none.status == 2 and "give 1 or more" in none.err
    expect_refused(run("bench.experiment", "--touches", 193), "give 1 to 192")
    wrong = ["--json", str(tmp_path / "missing" / "file")]
    started = subprocess.run([sys.executable, "-m", "bench.experiment", *wrong], capture_output=True, text=True)
    assert started.returncode == 2 and "cannot be written" in started.stderr, "as a user starts it"


def test_standings_name_the_touches() -> None:
    standings = "ahead from touch 1; tied from touch 3; behind from touch 4; unknown from touch 5"
    assert standing(numpy.array([2.0, 1.0, 0.0, -1.0, numpy.nan])) == standings
