"""What objects say of themselves, and how they are shown."""

import json
import os
import pathlib
import urllib.request

import pytest
from conftest import Maps, error_of
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import palpate


@pytest.fixture(scope="module")
def record(device: palpate.Device, maps: Maps, unknown: palpate.Recording) -> palpate.Record:
    [record] = palpate.recognize(unknown, maps, device=device)
    return record


def test_texts_tell_what_an_object_is(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording, posterior: palpate.PoseHistogram,
    record: palpate.Record,
) -> None:  # fmt: skip
    assert repr(device).startswith("Device('llvmpipe") or device.name not in ("", "llvmpipe")
    assert repr(maps[0]).startswith("OccupancyGrid('A', ")
    assert repr(unknown) == "Recording(9 touches of 36 elements in kPa)"
    assert repr(unknown[0]).startswith("Touch(36 elements at x ")
    assert "host_time_s=1764123456.789, " in repr(palpate.Frame(1764123456.789, [0.0]))
    assert repr(posterior) == f"PoseHistogram(A, E, I on '{device.name}')"
    assert "mode of object 1: x " in repr(posterior.estimate())
    assert "+-" in repr(posterior.refine())
    assert repr(record).startswith("Record('E' with probability ")


def test_records_complete_and_hold_arrays(record: palpate.Record) -> None:
    assert {"best", "refined", "mode"} <= set(dir(record))
    assert {"sd", "covariance", "keys"} <= set(dir(record.refined))
    assert record.refined.covariance.shape == (3, 3)
    assert record.refined.sd.tolist() == record["refined"]["sd"]
    assert record.mode.object == "E" and json.loads(json.dumps(record)) == record
    with pytest.raises(AttributeError, match="the record has no 'bset'; it has recording, "):
        record.bset  # noqa: B018


def test_pictures_are_of_maps_beliefs_and_records(
    maps: Maps, unknown: palpate.Recording, posterior: palpate.PoseHistogram, record: palpate.Record
) -> None:
    for shown in (maps[0], posterior.marginals(1)):
        png = shown._repr_png_()
        assert png is not None and png.startswith(b"\x89PNG")

    def drawn(shown: palpate.OccupancyGrid | palpate.Recording | palpate.Record) -> Axes:
        axes = Figure().add_subplot()
        assert shown.plot(axes) is axes
        return axes

    wide = palpate.OccupancyGrid("A", maps[0].log_odds[:40], cell_mm=0.5, origin_mm=(0, 0))
    assert drawn(wide).get_images()[0].get_extent() == pytest.approx((-0.25, wide.nx / 2 - 0.25, -0.25, 19.75))
    left, right, bottom, top = drawn(maps[0]).get_images()[0].get_extent()
    assert right - left == pytest.approx(maps[0].nx * maps[0].cell_mm)
    assert (left + 0.25, bottom + 0.25) == pytest.approx(tuple(maps[0].origin_mm))
    assert len(drawn(unknown[:0]).collections) == 1, "of no touch"
    [points] = drawn(unknown).collections
    assert len(points.get_offsets()) == unknown.pressure.size
    for line, radius in zip(drawn(record).lines[1:3], (1.515, 2.448), strict=True):
        for data, axis in ((line.get_xdata(), 0), (line.get_ydata(), 1)):
            reach = max(data) - record.refined.T_robot_object[axis]
            assert reach == pytest.approx(radius * record.refined.sd[axis], rel=1e-2)


def test_show_serves_files_and_draws_what_is_in_memory(tmp_path: pathlib.Path, maps: Maps) -> None:
    command = os.environ["PALPATE_COMMAND"]
    maps[0].save(tmp_path / "A.map.h5")
    page = palpate.show(tmp_path / "A.map.h5", command=command)
    assert isinstance(page, palpate.Page)
    with urllib.request.urlopen(page.url + "file/0") as answer:
        assert json.load(answer)["label"] == "A"
    assert f'<iframe src="{page.url}"' in page._repr_html_()
    page.close()
    assert "nothing.h5: no such file" in error_of(palpate.show, tmp_path / "nothing.h5", command=command)
    axes = palpate.show(maps[0])
    assert not isinstance(axes, palpate.Page) and axes.get_xlabel() == "x, mm"
