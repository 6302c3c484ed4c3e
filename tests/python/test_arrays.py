"""Arrays come in and go out without copies where they can, and are refused by name."""

from typing import Any

import numpy
import pytest
from conftest import Maps, error_of

import palpate

GRID = palpate.grid_array(6, 1, 2.0)


def address(array: numpy.typing.NDArray[numpy.generic]) -> int:
    return int(array.__array_interface__["data"][0])


def arrays() -> dict[str, numpy.typing.NDArray[numpy.float64]]:
    """Of four touches of six elements."""
    pressure = numpy.arange(24.0).reshape(4, 6)
    return {"pressure": pressure, "poses": numpy.zeros((4, 3)), "elements_mm": palpate.grid_array(6, 1, 2.0)}


def test_a_recording_reads_the_arrays_in_place() -> None:
    given = arrays()
    recording = palpate.Recording(**given)
    for name, of in (("pressure", "pressure"), ("T_robot_sensor", "poses"), ("elements_mm", "elements_mm")):
        assert address(getattr(recording, name)) == address(given[of]), name
    given["pressure"][2, 3] = 99.0
    assert recording[2].pressure[3] == 99.0


def test_slices_and_touches_share_the_memory() -> None:
    recording = palpate.Recording(**arrays())
    part = recording[1:3]
    assert len(part) == 2
    assert address(part.pressure) == address(recording.pressure) + 6 * 8
    assert address(recording[-1].pressure) == address(recording.pressure) + 3 * 6 * 8
    assert numpy.array_equal(recording[::2].pressure, recording.pressure[::2])
    assert [len(touch.pressure) for touch in recording] == [6, 6, 6, 6]  # ends by itself


def test_arrays_that_were_checked_stay() -> None:
    recording = palpate.Recording(**arrays())
    for checked in (recording, recording[0]):
        with pytest.raises(AttributeError, match=f"pressure of a {type(checked).__name__} cannot be set"):
            checked.pressure = numpy.zeros(1)
    recording.object = "mug"
    assert recording[1:].object == "mug"


@pytest.mark.parametrize(
    ("reshaped", "shape", "named"),
    [
        ("pressure", (24,), "pressure"),
        ("pressure", (6, 4), "T_robot_sensor"),  # which has no six rows
        ("T_robot_sensor", (12,), "T_robot_sensor"),
        ("elements_mm", (2, 6), "elements_mm"),
        ("valid", (24,), "valid"),
    ],
)
def test_arrays_that_are_changed_in_place_are_refused_at_use(
    belief: palpate.PoseHistogram, maps: Maps, reshaped: str, shape: tuple[int, ...], named: str
) -> None:
    recording = palpate.Recording(**arrays(), valid=numpy.ones((4, 6), bool))
    getattr(recording, reshaped).shape = shape
    for use in (belief.update, lambda given: given.save("none.h5"),
                lambda given: palpate.recognize(given, maps)):  # fmt: skip
        assert error_of(use, recording) == f"{named}: was given another shape; make another Recording"


def test_a_touch_that_is_changed_in_place_is_refused_at_use(belief: palpate.PoseHistogram) -> None:
    touch = palpate.Touch((0, 0, 0), GRID, numpy.zeros(6))
    touch.pressure.shape = (2, 3)
    assert error_of(belief.update, [touch]) == "pressure: was given another shape; make another Touch"
    touch.pressure.shape = (6,)
    touch.pressure.dtype = numpy.dtype("int64")
    with pytest.raises(TypeError, match="pressure: was given another dtype"):
        belief.update(touch)


def test_attributes_of_another_type_are_refused_at_once() -> None:
    recording = palpate.Recording(**arrays())
    others = {"object": 3, "pressure_unit": None, "rows": b"touches", "sensor": 1, "serial": 7}
    for name, value in others.items():
        with pytest.raises(TypeError, match=f"^{name}: {value!r}; give str$"):
            palpate.Recording(**arrays(), **{name: value})
    for change in (lambda: palpate.Recording(**arrays(), truth="E"),
                   lambda: setattr(recording, "truth", "E")):  # fmt: skip
        with pytest.raises(TypeError, match=r"^truth: 'E'; give Truth \| None$"):
            change()
    with pytest.raises(TypeError, match="^object: None; give str$"):
        recording.object = None
    recording.truth = palpate.Truth("E", (0, 0, 0))
    recording.truth = None


def test_a_slice_has_the_rows_of_every_array() -> None:
    rows = {"valid": numpy.eye(4, 6, dtype=bool), "time_s": numpy.arange(4.0),
            "device_time_s": numpy.arange(4.0) * 2, "lost_before": numpy.arange(4)}  # fmt: skip
    part = palpate.Recording(**arrays(), **rows, baseline=numpy.arange(6.0))[1:3]
    for name, values in rows.items():
        assert numpy.array_equal(getattr(part, name), values[1:3]), name
    assert part.baseline is not None and len(part.baseline) == 6
    moving = palpate.Recording(**{**arrays(), "elements_mm": numpy.stack([GRID + i for i in range(4)])})
    assert numpy.array_equal(moving[2].elements_mm, GRID + 2)
    assert moving[1:].elements_mm.shape == (3, 6, 2)


def test_a_touch_reads_other_layouts_as_copies_and_flags_in_place() -> None:
    rows = numpy.array([[1.0, 2.0]] * 6)
    for pressure in (rows[:, 1], numpy.full(6, 2, "int16"), numpy.full(6, 2, ">f4")):
        assert palpate.Touch([0, 0, 0], GRID, pressure).pressure.tolist() == [2.0] * 6
    flags = numpy.array([True, False, True] * 2)
    touch = palpate.Touch((0, 0, 0), GRID, numpy.zeros(6), flags)
    assert touch.valid is not None and address(touch.valid) == address(flags)
    assert touch.valid.tolist() == [1, 0, 1] * 2
    counts = palpate.Touch((0, 0, 0), GRID, numpy.zeros(6), [0, 256, 1] * 2)  # 256 is 0 as a byte
    assert counts.valid is not None and counts.valid.tolist() == [0, 1, 1] * 2


def test_read_only_arrays_are_read(belief: palpate.PoseHistogram, unknown: palpate.Recording) -> None:
    pressure = unknown.pressure.copy()
    pressure.flags.writeable = False
    frozen = palpate.Recording(pressure, unknown.T_robot_sensor, unknown.elements_mm)
    assert address(frozen.pressure) == address(pressure)
    with pytest.raises(ValueError):
        frozen.pressure[0, 0] = 1.0
    belief.update(frozen)
    assert belief.estimate().identity.argmax() == 1


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"pressure": numpy.zeros(6)}, r"pressure: shape (6,); give (n, e)"),
        ({"poses": numpy.zeros((5, 3))}, "poses: shape (5, 3); give (n, 3) with n = 4 of pressure"),
        ({"elements_mm": numpy.zeros((7, 2))}, "elements_mm: shape (7, 2); give (e, 2) with e = 6 of pressure"),
        ({"elements_mm": numpy.zeros((3, 6, 2))},
         "elements_mm: shape (3, 6, 2); give (n, e, 2) with n = 4 of pressure and e = 6 of pressure"),
        ({"time_s": numpy.zeros((4, 1))}, "time_s: shape (4, 1); give (n,) with n = 4 of pressure"),
        ({"pressure": numpy.full((4, 6), 1j)}, "pressure: dtype complex128; give numbers (float64)"),
        ({"pressure": [[1.0], [2.0, 3.0]]}, "pressure: is no array of numbers; give numbers (float64)"),
        ({"lost_before": [0, 0, 0, -1]}, "lost_before: has a count below 0; give whole numbers from 0"),
        ({"valid": numpy.zeros(6)}, "valid: dtype float64; give booleans, False for a dead element"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_by_name(changed: dict[str, object], message: str) -> None:
    assert error_of(palpate.Recording, **(arrays() | changed)) == message


def test_masked_readings_are_unknown(device: palpate.Device, maps: Maps, unknown: palpate.Recording) -> None:
    dead = numpy.zeros(unknown.pressure.shape, bool)
    dead[:, 3] = dead[2, 17] = True
    junk = numpy.where(dead, numpy.inf, unknown.pressure)
    masked = numpy.ma.masked_array(junk, mask=dead)
    rest = (unknown.T_robot_sensor, unknown.elements_mm)

    def believed(touches: palpate.Recording | list[palpate.Touch]) -> bytes:
        belief = palpate.PoseHistogram(device, maps)
        belief.update(touches)
        return belief.log_likelihood(1).tobytes()

    expected = believed(palpate.Recording(unknown.pressure, *rest, valid=~dead))
    recording = palpate.Recording(masked, *rest)
    assert address(recording.pressure) == address(junk)  # in place
    others = [palpate.Recording(numpy.ma.masked_array(junk, mask=dead & ~dead[0]), *rest, valid=valid)
              for valid in (~dead[0], ~dead)]  # fmt: skip
    touches = [palpate.Touch(pose, unknown.elements_mm, pressure)
               for pose, pressure in zip(unknown.T_robot_sensor, masked, strict=True)]  # fmt: skip
    for same in (recording, palpate.Recording(list(masked), *rest), touches, *others):
        assert believed(same) == expected
    assert palpate.Recording(numpy.ma.masked_array(junk, mask=False), *rest).valid is None
    values = palpate.Frame(0.0, masked[2]).values
    assert numpy.flatnonzero(numpy.isnan(values)).tolist() == [3, 17]
    assert numpy.array_equal(values[~dead[2]], unknown.pressure[2][~dead[2]])


def test_only_readings_may_be_masked(maps: Maps) -> None:
    for name, value in {**arrays(), "valid": numpy.ones(6, int), "time_s": numpy.zeros(4),
                        "lost_before": numpy.zeros(4, int)}.items():  # fmt: skip
        masked = numpy.ma.masked_array(value, mask=False)
        given: Any = arrays() | {name: masked}
        palpate.Recording(**given)
        masked[0] = numpy.ma.masked
        if name != "pressure":
            assert error_of(palpate.Recording, **given).startswith(f"{name}: has masked values")
    grid = numpy.ma.masked_less(maps[0].log_odds, 0.0)
    said = error_of(palpate.OccupancyGrid, "A", grid, cell_mm=0.5, origin_mm=(0, 0))
    assert said.startswith("log_odds: has masked values")


def test_results_are_views_that_keep_their_memory(maps: Maps, posterior: palpate.PoseHistogram) -> None:
    assert address(maps[0].log_odds) == address(maps[0].log_odds)
    assert not maps[0].log_odds.flags.writeable
    identity = posterior.estimate().identity  # of an Estimate that nothing else keeps
    xy = posterior.marginals(1).xy
    cells = palpate.OccupancyGrid("A", numpy.ones((3, 4)), cell_mm=1, origin_mm=(0, 0)).log_odds
    for _ in range(100):
        numpy.ones(3)
    assert identity.sum() == pytest.approx(1.0, abs=1e-12)
    assert (cells == 1).all()
    assert xy.shape == (25, 25)
    assert xy.sum() == pytest.approx(identity[1], abs=1e-6)
    assert posterior.log_likelihood(0).shape == posterior.lattice.shape == (16, 25, 25)


def test_what_is_no_touch_is_refused(device: palpate.Device, belief: palpate.PoseHistogram) -> None:
    assert "touches: item 0 is a int; give a Touch" in error_of(belief.update, [3])
    said = error_of(palpate.PoseHistogram, device, ["A.map.h5"])
    assert "maps: item 0 is a str; give OccupancyGrid" in said
    assert error_of(palpate.inverse, (1, 2)).startswith("T_a_b: shape (2,); give (3,)")
    error_of(belief.update, palpate.Touch((0, 0, 0), [[0, 0]], [numpy.inf]))  # an infinite pressure is not sound
    assert belief.estimate().identity[0] == pytest.approx(1 / 3)
