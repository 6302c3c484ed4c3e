"""What objects say of themselves."""

import numpy
import pytest

import palpate


def test_texts_tell_what_an_object_is(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    assert repr(device).startswith("Device('llvmpipe") or device.name not in ("", "llvmpipe")
    assert repr(maps[0]).startswith("OccupancyGrid('A', ")
    assert repr(unknown) == "Recording(9 touches of 36 elements in kPa)"
    assert repr(unknown[0]).startswith("Touch(36 elements at x ")
    belief = palpate.PoseHistogram(device, maps)
    assert repr(belief) == f"PoseHistogram(A, E, I on '{device.name}')"
    belief.update(unknown)
    assert "mode of object 1: x " in repr(belief.estimate())
    assert "+-" in repr(belief.refine())
    [record] = palpate.recognize(unknown, maps, bins=(10, 10, 8), device=device)
    assert repr(record).startswith("Record('E' with probability ")
    with pytest.raises(AttributeError, match="the record has no 'bset'; it has recording, "):
        record.bset  # noqa: B018


def test_poses_compose() -> None:
    T_a_b = numpy.array([1.0, 2.0, 0.5])
    T_b_c = (3.0, -1.0, 0.25)
    T_a_c = palpate.compose(T_a_b, T_b_c)
    points = numpy.array([[0.0, 0.0], [5.0, 1.0]])
    both = palpate.transform(T_a_b, palpate.transform(T_b_c, points))
    assert numpy.allclose(both, palpate.transform(T_a_c, points), atol=1e-12)
    assert numpy.allclose(palpate.compose(T_a_c, palpate.inverse(T_a_c)), 0, atol=1e-12)
    with pytest.raises(palpate.Error, match=r"T_a_b: shape \(2,\); give \(3,\)"):
        palpate.inverse((1, 2))


def test_pictures_are_of_maps_and_beliefs(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    belief = palpate.PoseHistogram(device, maps)
    belief.update(unknown)
    for shown in (maps[0], belief.marginals(1)):
        png = shown._repr_png_()
        assert png is not None
        assert png.startswith(b"\x89PNG")
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    wide = palpate.OccupancyGrid("A", maps[0].log_odds[:40], cell_mm=0.5, origin_mm=(0, 0))
    assert wide.plot(ax) is ax
    assert ax.get_images()[0].get_extent() == pytest.approx((-0.25, wide.nx / 2 - 0.25, -0.25, 19.75))
    ax = Figure().add_subplot()
    assert unknown.plot(ax) is ax
    [points] = ax.collections
    assert len(points.get_offsets()) == unknown.pressure.size
    ax = Figure().add_subplot()
    [record] = palpate.recognize(unknown, maps, device=device)
    assert record.plot(ax) is ax
    for line, radius in zip(ax.lines[1:3], (1.515, 2.448), strict=True):
        x, y, _ = record.refined.T_robot_object
        sd_x, sd_y, _ = record.refined.sd
        assert max(line.get_xdata()) - x == pytest.approx(radius * sd_x, rel=1e-2)
        assert max(line.get_ydata()) - y == pytest.approx(radius * sd_y, rel=1e-2)
    ax = Figure().add_subplot()
    assert maps[0].plot(ax) is ax
    left, right, bottom, top = ax.get_images()[0].get_extent()
    assert right - left == pytest.approx(maps[0].nx * maps[0].cell_mm)
    assert (left + 0.25, bottom + 0.25) == pytest.approx(tuple(maps[0].origin_mm))


def test_the_pose_error_is_that_of_the_refined_pose(
    maps: list[palpate.OccupancyGrid], unknown: palpate.Recording, device: palpate.Device
) -> None:
    [record] = palpate.recognize(unknown, maps, device=device)
    assert unknown.truth is not None
    refined = (record.refined["x_mm"], record.refined["y_mm"], record.refined["theta_rad"])
    error = palpate.pose_error_mm(maps[1], refined, unknown.truth.T_object_robot)
    assert error == record.refined_error_mm
    assert error < 1.0
