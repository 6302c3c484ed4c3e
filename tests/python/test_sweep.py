"""`python -m palpate.sweep` over a user's own maps and recordings."""

import json
import pathlib
import subprocess
import sys
from typing import Any

import pytest
from conftest import Files, command
from program import Done, run_program

import palpate
from palpate import _program, sweep
from palpate.sweep import CHARTS

DEVICE = ("--device", "llvmpipe")


def swept(*arguments: object) -> Done:
    return run_program(lambda: _program.main(sweep._run, "palpate.sweep"), *DEVICE, *arguments)


def document_of(folder: pathlib.Path, *arguments: object) -> dict[str, Any]:
    done = swept("--json", folder / "sweep.json", *arguments)
    assert done.status == 0, done.err
    document: dict[str, Any] = json.loads((folder / "sweep.json").read_text())
    assert document["advice"] in done.out
    return document


@pytest.fixture(scope="module")
def unknowns(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Three unknowns that know their pose."""
    folder = tmp_path_factory.mktemp("unknowns")
    for seed, letter in enumerate("AEA", start=21):
        placed = ("--object-pose", "random", "--touches", 9, "--seed", seed)
        command("simulate", letter, "-o", folder / f"{seed}.h5", *placed)
    return folder


def test_more_bins_err_less_until_they_do_not(
    files: Files, unknowns: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    document = document_of(
        tmp_path, "--maps", files.maps, "--recordings", unknowns, "--x-mm=-10:10", "--y-mm=-10:10",
        "--max-bins", 10_000, "--plots", tmp_path / "plots",
    )  # fmt: skip
    points = document["points"]
    assert (document["maps"], document["recordings"], document["true_poses"]) == (2, 3, 3)
    counts = [point["count"] for point in points]
    assert counts == sorted(counts) and counts[-1] <= 11_000
    assert points[-1]["error_mm"]["mean"] < points[0]["error_mm"]["mean"]
    for point in points:
        assert point["histogram_recordings"] == 3
        assert point["accuracy"] == 1.0
        assert min(point[name] for name in ("seconds_histogram", "seconds_bounds", "device_bytes")) > 0
    assert points[-1]["refined_from_finest_mm"]["mean"] == 0.0
    for name in CHARTS:
        assert (tmp_path / f"plots/{name}.png").read_bytes().startswith(b"\x89PNG")
        assert (tmp_path / f"plots/{name}.svg").exists()
    # What it gives is what recognize() gives with the same bins.
    nx, ny, ntheta = points[0]["bins"]
    records = palpate.recognize(
        sorted(unknowns.iterdir()), files.maps, bins=(nx, ny, ntheta), filter="bounded", device="llvmpipe",
        x_mm=(-10, 10), y_mm=(-10, 10),
    )  # fmt: skip
    assert points[0]["errors_mm"] == [record.error_mm for record in records]


def test_without_true_poses_it_tells_distances(
    files: Files, unknowns: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    recording = palpate.read_recording(unknowns / "21.h5")
    recording.truth = None
    recording.save(tmp_path / "unknown.h5")
    document = document_of(tmp_path, "--maps", files.maps, "--recordings", tmp_path / "unknown.h5", "--quick")
    assert document["true_poses"] == 0
    for point in document["points"]:
        assert point["accuracy"] is None and point["error_mm"] is None
        assert point["from_finest_mm"]["mean"] >= 0.0
        assert 0.0 <= point["same_object"] <= 1.0
    assert "--pivot-mm auto" in document["advice"], "the region of recognize's defaults"
    assert document["fine_count"] > document["auto_count"] > 0


def test_the_histogram_answers_where_objects_slip(
    files: Files, unknowns: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    scene = tmp_path / "scene.yaml"
    scene.write_text("slip_sd: {mm: 0.5, deg: 1}\n")
    document = document_of(
        tmp_path, "--maps", files.maps, "--recordings", unknowns / "21.h5", "--scene", scene,
        "--x-mm=-10:10", "--y-mm=-10:10", "--max-bins", 1_000,
    )  # fmt: skip
    for point in document["points"]:
        assert point["seconds_bounds"] is None and point["host_bytes"] is None
        assert point["seconds_histogram"] > 0.0 and point["device_bytes"] > 0


def test_what_cannot_be_is_refused(files: Files, tmp_path: pathlib.Path) -> None:
    sound = ("--json", tmp_path / "out.json", "--maps", files.maps, "--recordings", files.unknown)
    for arguments, words in (
        ((*sound, "--recordings", tmp_path / "none.h5"), "none.h5"),
        ((*sound, "--maps", tmp_path / "none"), "none"),
        ((*sound, "--max-bins", 10), "give 1000 or more"),
        ((*sound, "--x-mm=5"), "LOWER:UPPER"),
    ):
        done = swept(*arguments)
        assert done.status == 2, done.err
        assert words in done.err and done.err.count("\n") == 1
    started = subprocess.run(
        [sys.executable, "-m", "palpate.sweep", *sound, "--max-bins", "10"], capture_output=True, text=True
    )
    assert started.returncode == 2 and started.stderr.startswith("palpate.sweep: --max-bins = 10")
    assert not list(tmp_path.iterdir()), "nothing is left half-written"
