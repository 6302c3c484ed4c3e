"""Files, beside h5py and in threads; and streams of frames."""

import os
import pathlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import h5py
import numpy
import pytest
from conftest import Maps, error_of

import palpate


def test_a_recording_comes_back_as_it_was(tmp_path: pathlib.Path) -> None:
    recording = palpate.Recording(
        numpy.arange(12.0).reshape(3, 4) / 3,
        [[1, 2, 0.5], [3, 4, 1.5], [5, 6, -2]],
        palpate.grid_array(2, 2, 3.0),
        valid=[True, True, False, True],
        time_s=[10.0, 11.0, 12.0],
        object="mug",
        pressure_unit="raw",
        truth=palpate.Truth("mug", (1, 2, 3)),
        baseline=[1, 2, 3, 4],
        device_time_s=[0, 1, 2],
        lost_before=[0, 7, 0],
    )
    recording.save(tmp_path / "r.h5")
    back = palpate.read_recording(tmp_path / "r.h5")
    for name in ("pressure", "T_robot_sensor", "elements_mm", "valid", "time_s", "baseline",
                 "device_time_s", "lost_before"):  # fmt: skip
        assert numpy.array_equal(getattr(back, name), getattr(recording, name)), name
    assert (back.object, back.pressure_unit, back.rows) == ("mug", "raw", "touches")
    assert back.truth is not None
    assert back.truth.T_object_robot.tolist() == [1, 2, 3]
    assert back.path == str(tmp_path / "r.h5")


def test_a_map_of_arrays_holds_the_layers_that_are_given(maps: Maps) -> None:
    cells = maps[0].log_odds
    layers = {"observations": cells * 0 + 3, "mean_level": cells * 0 + 0.5}
    for given in ({}, *({name: layer} for name, layer in layers.items())):
        one = palpate.OccupancyGrid("A", cells, cell_mm=0.5, origin_mm=(0, 0), **given)
        assert numpy.array_equal(one.log_odds, cells)
        for name in layers:
            held = getattr(one, name)
            assert numpy.array_equal(held, given[name]) if name in given else held is None, name
    assert "prior" in error_of(palpate.OccupancyGrid, "A", cells, cell_mm=0.5, origin_mm=(0, 0), prior=1.5)


@pytest.mark.parametrize("form", [str, os.fsencode, pathlib.Path])
def test_names_of_files_need_not_be_utf8(
    form: Callable[[str], Any], tmp_path: pathlib.Path, device: palpate.Device,
    maps: Maps, unknown: palpate.Recording,
) -> None:  # fmt: skip
    name = os.fsdecode(os.fsencode(tmp_path) + b"/\xff")
    recording, grid = (form(f"{name}.{end}") for end in ("h5", "map.h5"))
    unknown.save(recording)
    maps[0].save(grid)
    back = palpate.read_recording(recording)
    assert back.path == f"{name}.h5"
    assert palpate.read_map(grid).label == "A"
    for given in (recording, [recording], back):
        [record] = palpate.recognize(given, grid, bins=(5, 5, 4), device=device)
        assert (record.best, record.recording) == ("A", f"{name}.h5")
    [done] = palpate.recognize_many(recording, {"maps": grid, "bins": (5, 5, 4), "device": device.name})
    assert done.record.best == "A"
    for read in (palpate.read_recording, palpate.simulate, palpate.open_sensor,
                 lambda path: palpate.recognize(back, grid, scene=path),
                 lambda path: palpate.recognize(back, path)):  # fmt: skip
        assert f"{name}.none" in error_of(read, form(f"{name}.none"))


def test_h5py_and_palpate_share_a_process_and_its_threads(tmp_path: pathlib.Path) -> None:
    recording = palpate.simulate("A", palpate.random_poses(20, seed=1))
    recording.save(tmp_path / "0.h5")

    def read_and_write(thread: int) -> None:
        for i in range(10):
            mine = tmp_path / f"{thread}.{i}.h5"
            back = palpate.read_recording(tmp_path / "0.h5")
            if thread % 2 == 0:
                back.save(mine)
                with h5py.File(mine) as file:
                    assert numpy.array_equal(file["pressure"][:], recording.pressure)
            else:
                with h5py.File(mine, "w") as file:
                    file["numbers"] = numpy.arange(1000)
                assert numpy.array_equal(back.pressure, recording.pressure)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(read_and_write, range(4)))  # raises what a thread does


class Stream:
    """A sensor of three elements at 100 Hz, as far as touches() asks it."""

    elements_mm = palpate.grid_array(3, 1, 2.0)
    baseline = numpy.zeros(3)
    valid = None

    def __iter__(self) -> Any:
        """Two touches, from whose begin on an element is not known; the stream ends during the second."""
        for time_s in numpy.arange(0, 4, 0.01):
            pressed = time_s % 2 >= 1
            values = [0.0, 20.0 * pressed, numpy.nan if pressed else 0.0]
            yield palpate.Frame(time_s, values, (1, 2, 3))


def test_touches_of_a_stream_come_with_their_unknown_elements_also_at_the_end() -> None:
    found = list(palpate.touches(Stream()))  # type: ignore[arg-type]
    assert len(found) == 2
    for touch in found:
        assert touch.T_robot_sensor.tolist() == [1, 2, 3]
        assert touch.pressure[:2] == pytest.approx([0, 20])
        assert touch.valid is not None and touch.valid.tolist() == [1, 1, 0]


def test_a_detector_takes_each_option() -> None:
    for option in ("onset", "release", "min_steady_s", "steady", "smooth_s", "drift_s"):
        with pytest.raises(palpate.Error, match=rf"\b{option}\b"):
            palpate.TouchDetector(**{option: -1.0})  # type: ignore[arg-type]
