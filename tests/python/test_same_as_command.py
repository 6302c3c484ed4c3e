"""Functions give the numbers of the commands, bit for bit, and refuse in their words."""

import json
import pathlib
import re
from collections.abc import Callable
from typing import Any

import h5py
import numpy
import pytest
from conftest import Files, built, command, comparable, expect_refused, printed, warned

import palpate

SMALL = ["--bins", "10x10x8"]
BINS: Any = {"bins": (10, 10, 8)}


@pytest.mark.parametrize(
    ("flags", "options"),
    [
        ([*SMALL, "--trace", "--touch-sd-mm", "1", "--none", "2"],
         {**BINS, "trace": True, "touch_sd_mm": 1, "none": 2}),
        (["--x-mm=-7.5:7.5", "--bins", "12x9x7", "--pivot-mm", "0.25,-1", "--each-frame", "--frames", "2:5"],
         {"x_mm": (-7.5, 7.5), "bins": (12, 9, 7), "pivot_mm": (0.25, -1), "each_frame": True,
          "frames": (2, 5)}),
        (["--filter", "bounded", "--tolerance", "1e-3"], {"filter": "bounded", "tolerance": 1e-3}),
        (["--filter", "particles", "--particles", "500", "--seed", "3"],
         {"filter": "particles", "particles": 500, "seed": 3}),
    ],
)  # fmt: skip
def test_records(files: Files, flags: list[str], options: dict[str, Any]) -> None:
    expected = files.recognized(*flags)
    given = palpate.recognize(files.unknown, files.maps, **options)
    assert [comparable(record) for record in given] == [comparable(r) for r in expected]
    assert given[0].best == given[0]["best"] == expected[0]["best"]


def test_records_of_what_is_in_memory(files: Files) -> None:
    [expected] = files.recognized(*SMALL)
    maps = [palpate.read_map(path) for path in sorted(files.maps.iterdir())]
    [given] = palpate.recognize(palpate.read_recording(files.unknown), maps, **BINS)
    assert given.mode.pop("map") == "map 'E'"
    expected["mode"].pop("map")
    assert comparable(given) == comparable(expected)


def test_the_cells_of_a_map_and_the_readings_of_a_simulation(files: Files, device: palpate.Device) -> None:
    touches = palpate.read_recording(files.train[0])
    assert numpy.array_equal(built(device, touches).log_odds, palpate.read_map(files.maps / "A.map.h5").log_odds)
    assert numpy.array_equal(palpate.simulate("A", seed=1).pressure, touches.pressure)


def test_the_bins_of_a_histogram(files: Files, device: palpate.Device, tmp_path: pathlib.Path) -> None:
    [record] = files.recognized(*SMALL, "--none", 0, "--posterior", tmp_path / "p.h5")
    maps = [palpate.read_map(path) for path in sorted(files.maps.iterdir())]
    lattice = palpate.PoseLattice((-10, 10, 10), (-10, 10, 10), (0, 2 * numpy.pi, 8))
    belief = palpate.PoseHistogram(device, maps, lattice)
    recording = palpate.read_recording(files.unknown)
    belief.update(recording[:6])
    for touch in range(6, 9):  # the command takes the last three one by one
        belief.update(recording[touch])
    with h5py.File(tmp_path / "p.h5") as file:
        for i, expected in enumerate(file["log_likelihood"][:]):
            assert numpy.array_equal(belief.log_likelihood(i), expected)
    estimate = belief.estimate()
    assert list(estimate.identity) == list(record["identity"].values())
    refined = belief.refine(estimate.mode)
    assert list(refined.T_object_robot) == [record["refined"][of] for of in ("x_mm", "y_mm", "theta_rad")]
    # The record adds how far the maps may be off.
    added = numpy.array(record["refined"]["covariance"]) - refined.covariance
    assert (added.diagonal() >= 0).all()


def test_the_bytes_and_words_of_a_folder_of_maps(files: Files, tmp_path: pathlib.Path) -> None:
    train = [tmp_path / f"{letter}.h5" for letter in "AU"]
    for seed, file in enumerate(train, start=1):
        palpate.simulate(file.stem, palpate.random_poses(30, seed), seed=seed).save(file)
    flags = ("--origin", "1,2,30", "--symmetry", "U=1", "--prior", "0.3", "--frames", "0:25")
    said = command("map", *train, "-o", f"{tmp_path}/command/", *flags)
    options: Any = {"origin": (1, 2, 30), "symmetry": {"U": 1}, "prior": 0.3, "frames": (0, 25)}
    given = palpate.learn_maps(train, tmp_path / "python", **options)
    contents = [
        {file.name: file.read_bytes() for file in (tmp_path / folder).iterdir()} for folder in ("python", "command")
    ]
    assert contents[0] == contents[1]
    said = said.replace(f"{tmp_path}/command/", f"{tmp_path}/python/")
    assert given.words == said.replace("--sensor-model none", "sensor_model='none'").splitlines()

    # Without a folder nothing is written, and no file of another is taken in.
    in_memory = palpate.learn_maps([palpate.read_recording(file) for file in train], **options)
    assert given.sensor is not None and in_memory.sensor is not None
    assert in_memory.sensor.temperature == given.sensor.temperature
    for one, other in zip(in_memory.maps, given.maps, strict=True):
        assert one.label == other.label
        assert numpy.array_equal(one.log_odds, other.log_odds)
    assert {file.name for file in tmp_path.iterdir()} == {"A.h5", "U.h5", "command", "python"}

    # The folder brings its sensor to recognition.
    maps = tmp_path / "python"
    [expected] = printed("recognize", files.unknown, "--maps", maps, *SMALL)
    assert expected["sensor_model"] == str(maps / "sensor.yaml")
    [record] = palpate.recognize(files.unknown, maps, **BINS)
    assert comparable(record) == comparable(expected)
    read = [palpate.read_map(path) for path in sorted(maps.glob("*.map.h5"))]
    [of_read] = palpate.recognize(files.unknown, read, **BINS)
    assert of_read.sensor_model == record.sensor_model
    [by_eq7] = palpate.recognize(files.unknown, read, sensor_model="none", **BINS)
    assert "sensor_model" not in by_eq7
    others = [*read, palpate.read_map(files.maps / "A.map.h5")]
    assert "was not learned for" in warned(palpate.recognize, files.unknown, others, prior=0.3, **BINS)[1]


def comparable_plan(plan: dict[str, Any]) -> dict[str, Any]:
    return {**comparable(plan), "believed": comparable(plan["believed"])}


def test_plans(files: Files, tmp_path: pathlib.Path) -> None:
    fractions: list[float] = []
    plan = palpate.plan(
        files.unknown, files.maps, touches=2, goal="identity", samples=40, plan_seed=3,
        progress=fractions.append, **BINS,
    )  # fmt: skip
    task = ["plan", files.unknown, "--maps", files.maps, *SMALL]
    flags = ["--touches", 2, "--goal", "identity", "--samples", 40, "--plan-seed", 3]
    assert comparable_plan(plan) == comparable_plan(printed(*task, "--candidates", "grid", *flags))
    assert not any("--" in warning for warning in [*plan.get("warnings", ()), *plan.believed.get("warnings", ())])
    assert len(plan.candidates) > 50 and fractions[-1] == 1
    first = plan.candidates[0]
    assert plan.T_robot_sensor[0].tolist() == [first.x_mm, first.y_mm, first.theta_rad]
    assert repr(plan.believed).startswith("Record(")

    table = tmp_path / "poses.csv"
    table.write_text("x,y,theta\n0,0,0\n5,-3,1\n40,40,0\n")
    plan, said = warned(palpate.plan, files.unknown, files.maps, candidates=table, touches=3, **BINS)
    assert "poses taken to be in mm and rad" in said
    assert comparable_plan(plan) == comparable_plan(printed(*task, "--candidates", table, "--touches", 3))


def test_a_calibration(presses: list[pathlib.Path], tmp_path: pathlib.Path) -> None:
    flags = ["--bins", "6x6x6", "--theta-deg", "0:180", "--levels", 3]
    said = command("calibrate", *presses, "-o", tmp_path / "command.yaml", *flags)
    fractions: list[float] = []
    given = palpate.calibrate(
        [presses[0], palpate.read_recording(presses[1])],
        bins=(6, 6, 6), theta_deg=(0, 180), levels=3, progress=fractions.append,
    )  # fmt: skip
    given.sensor.save(tmp_path / "module.yaml")
    assert (tmp_path / "module.yaml").read_bytes() == (tmp_path / "command.yaml").read_bytes()
    rows = re.findall(r"^log-loss, nats +(.*)$", said, re.MULTILINE)
    for row, scores in zip(rows, (given, given.groups), strict=True):
        assert row.split() == [f"{one.log_loss:.3f}" for one in (scores.before, scores.table, scores.after)]
    assert given.objects == 2 and fractions == sorted(fractions) and fractions[-1] == 1
    assert repr(given) == f"SensorCalibration(2 objects, {given.after.right} of {given.after.records} touches right)"
    assert json.loads(json.dumps(given)) == given and given.tried[0].layer == "mean_level"


#: What a function refuses, the command line, and how Python spells the options that it names.
REFUSALS: dict[str, tuple[Callable[[Files], object], str, dict[str, str]]] = {
    "bins": (
        lambda files: palpate.recognize(files.unknown, files.maps, bins=(0, 1, 1)),
        "recognize {0.unknown} --maps {0.maps} --bins 0x1x1", {"--bins 0x1x1": "bins=(0, 1, 1)"},
    ),
    "particles": (
        lambda files: palpate.recognize(files.unknown, files.maps, filter="bounded", particles=1),
        "recognize {0.unknown} --maps {0.maps} --filter bounded --particles 1",
        {"--particles": "particles", "--filter bounded": "filter='bounded'",
         "--filter particles": "filter='particles'"},
    ),
    "samples_of_a_plan": (
        lambda files: palpate.plan(files.unknown, files.maps, samples=1),
        "plan {0.unknown} --maps {0.maps} --candidates grid --samples 1", {},
    ),
    "an_origin_of_unposed_touches": (
        lambda files: palpate.learn_maps(files.train[0], f"{files.folder}/new/", origin=(1, 2, 3), unposed=True),
        "map {0.train[0]} -o {0.folder}/new/ --origin 1,2,3 --unposed", {"--origin 1,2,3": "origin=(1, 2, 3)"},
    ),
    "a_region_of_unposed_presses": (
        lambda files: palpate.calibrate(files.train, unposed=True, x_mm=(-1, 1)),
        "calibrate {0.train[0]} {0.train[1]} -o {0.folder}/s.yaml --unposed --x-mm=-1:1",
        {"--bins, --x-mm, --y-mm, --theta-deg and --pivot-mm": "bins=, x_mm=, y_mm=, theta_deg= and pivot_mm="},
    ),
    "units_of_a_table": (
        lambda _: palpate.import_tables("p.csv", array=(2, 2, 1), pose_unit="m,turn"),  # type: ignore[arg-type]
        "import p.csv --array 2:2:1 -o o.h5 --pose-unit m,turn", {"--pose-unit m,turn": "pose_unit='m,turn'"},
    ),
    "records_without_truth": (
        lambda files: palpate.evaluate(files.without_truth), "evaluate {0.without_truth}", {},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSALS)
def test_refusals(name: str, files: Files) -> None:
    call, line, spelled = REFUSALS[name]
    before = sorted(files.folder.iterdir())
    expect_refused(lambda: call(files), *line.format(files).split(), spelled=spelled)
    assert sorted(files.folder.iterdir()) == before, "nothing is written"
