"""The module gives the numbers of the command, bit for bit."""

import json
import pathlib
from typing import Any

import h5py
import numpy
import pytest
from conftest import Files, command, comparable, expect_refused

import palpate

SMALL = ["--bins", "10x10x8"]


@pytest.mark.parametrize(
    ("flags", "options"),
    [
        ([*SMALL, "--trace", "--touch-sd-mm", "1", "--none", "2"],
         {"bins": (10, 10, 8), "trace": True, "touch_sd_mm": 1, "none": 2}),
        (["--x-mm=-7.5:7.5", "--bins", "12x9x7", "--pivot-mm", "0.25,-1", "--each-frame", "--frames", "2:5"],
         {"x_mm": (-7.5, 7.5), "bins": (12, 9, 7), "pivot_mm": (0.25, -1), "each_frame": True,
          "frames": (2, 5)}),
        (["--filter", "bounded", "--tolerance", "1e-3"], {"filter": "bounded", "tolerance": 1e-3}),
        (["--filter", "particles", "--particles", "500", "--seed", "3"],
         {"filter": "particles", "particles": 500, "seed": 3}),
    ],
)  # fmt: skip
def test_recognize_gives_the_records_of_the_command(
    files: Files, flags: list[str], options: dict[str, Any]
) -> None:
    expected = files.recognized(*flags)
    given = palpate.recognize(files.unknown, files.maps, **options)
    assert [comparable(record) for record in given] == [comparable(r) for r in expected]
    assert given[0].best == given[0]["best"] == expected[0]["best"]


def test_recordings_and_maps_in_memory_give_the_same_record(files: Files) -> None:
    expected = files.recognized(*SMALL)[0]
    maps = [palpate.read_map(path) for path in sorted(files.maps.iterdir())]
    [given] = palpate.recognize(palpate.read_recording(files.unknown), maps, bins=(10, 10, 8))
    assert given.mode.pop("map") == "map 'E'"
    expected["mode"].pop("map")
    assert comparable(given) == comparable(expected)


def test_a_folder_brings_the_sensor_that_was_learned_with_it(
    files: Files, tmp_path: pathlib.Path
) -> None:
    maps = tmp_path / "maps"
    command("simulate", "U", "-o", tmp_path / "U.h5", "--seed", 3)
    command("map", files.train[0], tmp_path / "U.h5", "-o", f"{maps}/")
    [expected] = json.loads(
        command("recognize", files.unknown, "--maps", maps, "--json", "-", *SMALL)
    )
    assert expected["sensor_model"] == str(maps / "sensor.yaml")
    [given] = palpate.recognize(files.unknown, maps, bins=(10, 10, 8))
    assert comparable(given) == comparable(expected)
    read = [palpate.read_map(path) for path in sorted(maps.glob("*.map.h5"))]
    [of_read] = palpate.recognize(files.unknown, read, bins=(10, 10, 8))
    assert of_read.sensor_model == given.sensor_model
    [by_eq7] = palpate.recognize(files.unknown, read, bins=(10, 10, 8), sensor_model="none")
    assert "sensor_model" not in by_eq7
    others = [*read, palpate.read_map(files.maps / "A.map.h5")]
    with pytest.warns(UserWarning, match="was not learned for"):
        palpate.recognize(files.unknown, others, bins=(10, 10, 8))


def test_a_map_has_the_cells_of_the_command(files: Files, device: palpate.Device) -> None:
    builder = palpate.MapBuilder(device)
    builder.add(palpate.read_recording(files.train[0]))
    expected = palpate.read_map(files.maps / "A.map.h5")
    assert numpy.array_equal(builder.build("A").log_odds, expected.log_odds)


def test_a_simulation_has_the_readings_of_the_command(tmp_path: pathlib.Path) -> None:
    command("simulate", "A", "-o", tmp_path / "a.h5", "--seed", 5)
    expected = palpate.read_recording(tmp_path / "a.h5")
    assert numpy.array_equal(palpate.simulate("A", seed=5).pressure, expected.pressure)


def test_a_histogram_has_the_bins_of_the_command(
    files: Files, device: palpate.Device, tmp_path: pathlib.Path
) -> None:
    record = files.recognized(*SMALL, "--none", 0, "--posterior", tmp_path / "p.h5")[0]
    maps = [palpate.read_map(path) for path in sorted(files.maps.iterdir())]
    lattice = palpate.PoseLattice(x_mm=(-10, 10, 10), y_mm=(-10, 10, 10),
                                  theta_rad=(0, 2 * numpy.pi, 8))  # fmt: skip
    belief = palpate.PoseHistogram(device, maps, lattice)
    recording = palpate.read_recording(files.unknown)
    belief.update(recording[:6])
    for touch in range(6, 9):  # the command takes the last three one by one
        belief.update(recording[touch])
    with h5py.File(tmp_path / "p.h5") as file:
        expected = file["log_likelihood"][:]
    assert numpy.array_equal(belief.log_likelihood(0), expected[0])
    assert numpy.array_equal(belief.log_likelihood(1), expected[1])
    estimate = belief.estimate()
    assert list(estimate.identity) == list(record["identity"].values())
    refined = belief.refine(estimate.mode)
    pose = [record["refined"][of] for of in ("x_mm", "y_mm", "theta_rad")]
    assert list(refined.T_object_robot) == pose
    # The record adds how far the maps may be off.
    added = numpy.array(record["refined"]["covariance"]) - refined.covariance
    assert (added.diagonal() >= 0).all()


def test_errors_are_those_of_the_command(files: Files) -> None:
    for flags, options, spelled in [
        (["--bins", "0x1x1"], {"bins": (0, 1, 1)}, {"--bins 0x1x1": "bins=(0, 1, 1)"}),
        (["--filter", "bounded", "--particles", "1"], {"filter": "bounded", "particles": 1},
         {"--particles": "particles", "--filter bounded": "filter='bounded'",
          "--filter particles": "filter='particles'"}),
    ]:  # fmt: skip
        expect_refused(
            lambda options=options: palpate.recognize(files.unknown, files.maps, **options),
            "recognize", files.unknown, "--maps", files.maps, *flags, spelled=spelled,
        )  # fmt: skip
