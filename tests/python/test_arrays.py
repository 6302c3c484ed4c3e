"""Arrays come in and go out without copies where they can, and are refused by name."""

import numpy
import pytest

import palpate


def address(array: numpy.typing.NDArray[numpy.generic]) -> int:
    return int(array.__array_interface__["data"][0])


def arrays(n: int = 4, e: int = 6) -> dict[str, numpy.typing.NDArray[numpy.float64]]:
    return {
        "pressure": numpy.arange(n * e, dtype=float).reshape(n, e),
        "poses": numpy.zeros((n, 3)),
        "elements_mm": palpate.grid_array(e, 1, 2.0),
    }


def test_a_recording_reads_the_arrays_in_place() -> None:
    given = arrays()
    recording = palpate.Recording(**given)
    assert address(recording.pressure) == address(given["pressure"])
    assert address(recording.T_robot_sensor) == address(given["poses"])
    assert address(recording.elements_mm) == address(given["elements_mm"])
    given["pressure"][2, 3] = 99.0
    assert recording[2].pressure[3] == 99.0


def test_slices_and_touches_share_the_memory() -> None:
    recording = palpate.Recording(**arrays())
    part = recording[1:3]
    assert len(part) == 2
    assert address(part.pressure) == address(recording.pressure) + 6 * 8
    assert address(recording[-1].pressure) == address(recording.pressure) + 3 * 6 * 8
    assert len(recording[::2]) == 2
    assert numpy.array_equal(recording[::2].pressure, recording.pressure[::2])
    with pytest.raises(IndexError):
        recording[4]
    assert [len(touch.pressure) for touch in recording] == [6, 6, 6, 6]  # ends by itself


def test_a_moving_array_has_a_row_for_each_touch() -> None:
    given = arrays()
    elements = numpy.stack([given["elements_mm"] + i for i in range(4)])
    recording = palpate.Recording(given["pressure"], given["poses"], elements)
    assert numpy.array_equal(recording[2].elements_mm, given["elements_mm"] + 2)
    assert recording[1:].elements_mm.shape == (3, 6, 2)


def test_a_slice_has_the_rows_of_every_array() -> None:
    rows = {"valid": numpy.eye(4, 6, dtype=bool), "time_s": numpy.arange(4.0),
            "device_time_s": numpy.arange(4.0) * 2, "lost_before": numpy.arange(4)}  # fmt: skip
    part = palpate.Recording(**arrays(), **rows, baseline=numpy.arange(6.0))[1:3]
    for name, values in rows.items():
        assert numpy.array_equal(getattr(part, name), values[1:3]), name
    assert part.baseline is not None
    assert len(part.baseline) == 6


def test_a_touch_reads_other_layouts_as_copies() -> None:
    elements = palpate.grid_array(2, 1, 2.0)
    pressure = numpy.array([[1.0, 2.0], [3.0, 4.0]])
    touch = palpate.Touch([0, 0, 0], elements, pressure[:, 0])
    assert touch.pressure.tolist() == [1.0, 3.0]
    assert palpate.Touch((0, 0, 0), elements, numpy.array([1, 2], "int16")).pressure[1] == 2.0
    assert palpate.Touch((0, 0, 0), elements, numpy.array([1, 2], ">f4")).pressure[1] == 2.0


def test_valid_flags_are_booleans_or_bytes_in_place() -> None:
    elements = palpate.grid_array(3, 1, 2.0)
    flags = numpy.array([True, False, True])
    touch = palpate.Touch((0, 0, 0), elements, numpy.zeros(3), flags)
    assert touch.valid is not None
    assert address(touch.valid) == address(flags)
    assert touch.valid.tolist() == [1, 0, 1]
    counts = palpate.Touch((0, 0, 0), elements, numpy.zeros(3), [0, 256, 1])  # 256 is 0 as a byte
    assert counts.valid is not None
    assert counts.valid.tolist() == [0, 1, 1]


def test_read_only_arrays_are_read(device: palpate.Device,
                                   maps: list[palpate.OccupancyGrid],
                                   unknown: palpate.Recording) -> None:  # fmt: skip
    pressure = unknown.pressure.copy()
    pressure.flags.writeable = False
    frozen = palpate.Recording(pressure, unknown.T_robot_sensor, unknown.elements_mm)
    assert address(frozen.pressure) == address(pressure)
    with pytest.raises(ValueError):
        frozen.pressure[0, 0] = 1.0
    belief = palpate.PoseHistogram(device, maps)
    belief.update(frozen)
    assert belief.estimate().identity.argmax() == 1


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"pressure": numpy.zeros(6)}, r"pressure: shape (6,); give (n, e)"),
        ({"poses": numpy.zeros((5, 3))},
         "poses: shape (5, 3); give (n, 3) with n = 4 of pressure"),
        ({"poses": numpy.zeros((4, 2))},
         "poses: shape (4, 2); give (n, 3) with n = 4 of pressure"),
        ({"elements_mm": numpy.zeros((7, 2))},
         "elements_mm: shape (7, 2); give (e, 2) with e = 6 of pressure"),
        ({"elements_mm": numpy.zeros((3, 6, 2))},
         "elements_mm: shape (3, 6, 2); give (n, e, 2) with n = 4 of pressure and e = 6 of pressure"),
        ({"time_s": numpy.zeros((4, 1))}, "time_s: shape (4, 1); give (n,) with n = 4 of pressure"),
        ({"pressure": numpy.full((4, 6), 1j)},
         "pressure: dtype complex128; give numbers (float64)"),
        ({"pressure": [["a"] * 6] * 4}, "pressure: dtype <U1; give numbers (float64)"),
        ({"pressure": [[1.0], [2.0, 3.0]]}, "pressure: is no array of numbers; give numbers (float64)"),
        ({"elements_mm": [[1.0], [2.0, 3.0]]},
         "elements_mm: is no array of numbers; give numbers (float64)"),
        ({"lost_before": [0, 0, 0, -1]},
         "lost_before: has a count below 0; give whole numbers from 0"),
        ({"valid": numpy.zeros(6)},
         "valid: dtype float64; give booleans, False for a dead element"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_by_name(changed: dict[str, object], message: str) -> None:
    with pytest.raises(palpate.Error) as refused:
        palpate.Recording(**(arrays() | changed))  # type: ignore[arg-type]
    assert str(refused.value) == message
    assert refused.value.fault == "input"


def test_masked_readings_are_unknown(device: palpate.Device,
                                     maps: list[palpate.OccupancyGrid],
                                     unknown: palpate.Recording) -> None:  # fmt: skip
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
    assert believed(recording) == expected
    assert believed(palpate.Recording(list(masked), *rest)) == expected
    assert believed([palpate.Touch(pose, unknown.elements_mm, pressure)
                     for pose, pressure in zip(unknown.T_robot_sensor, masked, strict=True)]
                    ) == expected  # fmt: skip
    for valid in (~dead[0], ~dead):
        both = palpate.Recording(numpy.ma.masked_array(junk, mask=dead & ~dead[0]), *rest, valid=valid)
        assert believed(both) == expected
    assert palpate.Recording(numpy.ma.masked_array(junk, mask=False), *rest).valid is None
    values = palpate.Frame(0.0, masked[2]).values
    assert numpy.flatnonzero(numpy.isnan(values)).tolist() == [3, 17]
    assert numpy.array_equal(values[~dead[2]], unknown.pressure[2][~dead[2]])


def test_only_readings_may_be_masked(maps: list[palpate.OccupancyGrid]) -> None:
    for name, value in {**arrays(), "valid": numpy.ones(6, int), "time_s": numpy.zeros(4),
                        "lost_before": numpy.zeros(4, int)}.items():  # fmt: skip
        masked = numpy.ma.masked_array(value, mask=False)
        palpate.Recording(**(arrays() | {name: masked}))
        masked[0] = numpy.ma.masked
        if name != "pressure":
            with pytest.raises(palpate.Error, match=f"^{name}: has masked values"):
                palpate.Recording(**(arrays() | {name: masked}))
    grid = numpy.ma.masked_less(maps[0].log_odds, 0.0)
    with pytest.raises(palpate.Error, match="^log_odds: has masked values"):
        palpate.OccupancyGrid("A", grid, cell_mm=0.5, origin_mm=(0, 0))


def test_results_are_views_that_keep_their_memory(maps: list[palpate.OccupancyGrid],
                                                  device: palpate.Device,
                                                  unknown: palpate.Recording) -> None:  # fmt: skip
    assert address(maps[0].log_odds) == address(maps[0].log_odds)
    assert not maps[0].log_odds.flags.writeable
    belief = palpate.PoseHistogram(device, maps)
    belief.update(unknown)
    identity = belief.estimate().identity  # of an Estimate that nothing else keeps
    xy = belief.marginals(1).xy
    for _ in range(100):
        numpy.ones(3)
    assert identity.sum() == pytest.approx(1.0, abs=1e-12)
    assert xy.shape == (25, 25)
    assert xy.sum() == pytest.approx(identity[1], abs=1e-6)
    assert belief.log_likelihood(0).shape == belief.lattice.shape == (16, 25, 25)


def test_what_is_no_touch_is_refused(device: palpate.Device,
                                     maps: list[palpate.OccupancyGrid]) -> None:  # fmt: skip
    belief = palpate.PoseHistogram(device, maps)
    with pytest.raises(palpate.Error, match="touches: item 0 is a int; give a Touch"):
        belief.update([3])  # type: ignore[list-item]
    with pytest.raises(palpate.Error, match="maps: item 0 is a str; give OccupancyGrid"):
        palpate.PoseHistogram(device, ["A.map.h5"])  # type: ignore[list-item]
    with pytest.raises(palpate.Error):  # an infinite pressure is not sound
        belief.update(palpate.Touch((0, 0, 0), [[0, 0]], [numpy.inf]))
    assert belief.estimate().identity[0] == pytest.approx(1 / 3)
