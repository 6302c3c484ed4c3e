"""learn_maps() makes the files of `palpate map`, and refuses in its words."""

import inspect
import pathlib

import numpy
import pytest
from conftest import Files, command, expect_refused

import palpate
from palpate import _palpate

SHARED = {"threshold", "ratio", "sensor_model", "touch_sd_mm", "touch_sd_deg", "frames", "device"}


def contents(folder: pathlib.Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir()}


def test_a_folder_has_the_bytes_and_words_of_the_command(tmp_path: pathlib.Path) -> None:
    train = []
    for seed, letter in enumerate("AU", start=1):
        train.append(tmp_path / f"{letter}.h5")
        palpate.simulate(letter, palpate.random_poses(30, seed), seed=seed).save(train[-1])
    flags = ("--origin", "1,2,30", "--symmetry", "U=1", "--prior", "0.3", "--frames", "0:25")
    said = command("map", *train, "-o", f"{tmp_path}/command/", *flags)
    options = {"origin": (1, 2, 30), "symmetry": {"U": 1}, "prior": 0.3, "frames": (0, 25)}
    given = palpate.learn_maps(train, tmp_path / "python", **options)  # type: ignore[arg-type]
    assert contents(tmp_path / "python") == contents(tmp_path / "command")
    said = said.replace(f"{tmp_path}/command/", f"{tmp_path}/python/")
    assert given.words == said.replace("--sensor-model none", "sensor_model='none'").splitlines()

    # Without a folder nothing is written, and no file of another is taken in.
    recordings = [palpate.read_recording(file) for file in train]
    in_memory = palpate.learn_maps(recordings, **options)  # type: ignore[arg-type]
    assert given.sensor is not None and in_memory.sensor is not None
    assert in_memory.sensor.temperature == given.sensor.temperature
    for one, other in zip(in_memory.maps, given.maps, strict=True):
        assert one.label == other.label
        assert numpy.array_equal(one.log_odds, other.log_odds)
    assert {file.name for file in tmp_path.iterdir()} == {"A.h5", "U.h5", "command", "python"}


def test_options_shared_with_recognition_are_those_of_its_table() -> None:
    assert set(_palpate.Request.options()) >= SHARED
    assert set(inspect.signature(palpate.learn_maps).parameters) >= SHARED


def test_it_refuses_in_the_words_of_the_command(files: Files, tmp_path: pathlib.Path) -> None:
    [train, *_] = files.train
    out = f"{tmp_path}/new/"
    expect_refused(
        lambda: palpate.learn_maps(train, out, cell_mm=0.0), "map", train, "-o", out, "--cell-mm", 0
    )
    expect_refused(
        lambda: palpate.learn_maps(train, out, origin=(1, 2, 3), unposed=True),
        "map", train, "-o", out, "--origin", "1,2,3", "--unposed",
        spelled={"--origin 1,2,3": "origin=(1, 2, 3)"},
    )  # fmt: skip
    with pytest.raises(TypeError, match=r"^cell_mm: 'wide'; give float \| None"):
        palpate.learn_maps(train, cell_mm="wide")  # type: ignore[arg-type]
    assert not (tmp_path / "new").exists()


def test_what_the_command_warns_of_is_a_warning(tmp_path: pathlib.Path) -> None:
    recording = palpate.simulate("A", numpy.zeros((5, 3)), seed=1)
    with pytest.warns(UserWarning, match="all 5 touches are at one pose.*give unposed="):
        palpate.learn_maps(recording, sensor_model="none")
