"""Files, beside h5py and in threads."""

import os
import pathlib
import threading
from collections.abc import Callable
from typing import Any

import h5py
import numpy
import pytest

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


def test_a_map_comes_back_as_it_was(tmp_path: pathlib.Path,
                                    maps: list[palpate.OccupancyGrid]) -> None:  # fmt: skip
    maps[0].save(tmp_path / "a.map.h5")
    back = palpate.read_map(tmp_path / "a.map.h5")
    assert numpy.array_equal(back.log_odds, maps[0].log_odds)
    assert back.origin_mm.tolist() == maps[0].origin_mm.tolist()
    own = palpate.OccupancyGrid("A", maps[0].log_odds, cell_mm=0.5, origin_mm=maps[0].origin_mm)
    assert numpy.array_equal(own.log_odds, maps[0].log_odds)
    assert own.observations is None and own.mean_level is None
    layers = {"observations": maps[0].log_odds * 0 + 3, "mean_level": maps[0].log_odds * 0 + 0.5}
    for name, cells in layers.items():
        one = palpate.OccupancyGrid("A", maps[0].log_odds, cell_mm=0.5, origin_mm=(0, 0),
                                    **{name: cells})  # fmt: skip
        assert numpy.array_equal(getattr(one, name), cells), name
    with pytest.raises(palpate.Error, match="prior"):
        palpate.OccupancyGrid("A", maps[0].log_odds, cell_mm=0.5, origin_mm=(0, 0), prior=1.5)


def test_files_are_refused_in_the_words_of_the_command(tmp_path: pathlib.Path) -> None:
    missing = tmp_path / "missing.h5"
    with pytest.raises(palpate.Error, match=f"^{missing}: .*") as refused:
        palpate.read_recording(missing)
    assert "\n" not in str(refused.value)
    text = tmp_path / "text.h5"
    text.write_text("no HDF5")
    with pytest.raises(palpate.Error, match="is not an HDF5 file"):
        palpate.read_map(text)
    with pytest.raises(palpate.Error) as refused:
        palpate.simulate("A").save(tmp_path / "no_folder" / "a.h5")
    assert refused.value.fault == "input"


@pytest.mark.parametrize("form", [str, os.fsencode, pathlib.Path])
def test_names_of_files_need_not_be_utf8(
    form: Callable[[str], Any], tmp_path: pathlib.Path, device: palpate.Device,
    maps: list[palpate.OccupancyGrid], unknown: palpate.Recording,
) -> None:  # fmt: skip
    name = os.fsdecode(os.fsencode(tmp_path) + b"/\xff")
    recording, grid, scene = (form(f"{name}.{end}") for end in ("h5", "map.h5", "yaml"))
    unknown.save(recording)
    maps[0].save(grid)
    pathlib.Path(f"{name}.yaml").write_bytes(b'objects: [{map: "' + os.fsencode(grid) + b'"}]')
    back = palpate.read_recording(recording)
    assert back.path == f"{name}.h5"
    assert palpate.read_map(grid).label == "A"
    for given in (recording, [recording], back):
        [record] = palpate.recognize(given, grid, bins=(5, 5, 4), device=device)
        assert (record.best, record.recording) == ("A", f"{name}.h5")
    [done] = palpate.recognize_many(recording, {"maps": grid, "bins": (5, 5, 4), "device": device.name})
    assert done.record.best == "A"
    missing = form(f"{name}.none")
    for read in (palpate.read_recording, palpate.simulate, palpate.open_sensor,
                 lambda path: palpate.recognize(back, grid, scene=path),
                 lambda path: palpate.recognize(back, path)):  # fmt: skip
        with pytest.raises(palpate.Error) as refused:
            read(missing)
        assert f"{name}.none" in str(refused.value)


def test_h5py_and_palpate_share_a_process_and_its_threads(tmp_path: pathlib.Path) -> None:
    recording = palpate.simulate("A", palpate.random_poses(20, seed=1))
    recording.save(tmp_path / "0.h5")
    failures: list[BaseException] = []

    def read_and_write(thread: int) -> None:
        try:
            for i in range(10):
                mine = tmp_path / f"{thread}.{i}.h5"
                if thread % 2 == 0:
                    palpate.read_recording(tmp_path / "0.h5").save(mine)
                    with h5py.File(mine) as file:
                        assert numpy.array_equal(file["pressure"][:], recording.pressure)
                else:
                    with h5py.File(mine, "w") as file:
                        file["numbers"] = numpy.arange(1000)
                    back = palpate.read_recording(tmp_path / "0.h5")
                    assert numpy.array_equal(back.pressure, recording.pressure)
        except BaseException as failure:
            failures.append(failure)

    threads = [threading.Thread(target=read_and_write, args=[thread]) for thread in range(4)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert not failures
