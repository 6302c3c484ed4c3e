"""The reader of an XELA array's letters, on arrays that the simulator makes."""

import pathlib
from typing import Any

import numpy
import pytest
from conftest import expect_refused
from numpy.typing import NDArray
from program import Done, run_program

import bench.program
import palpate
from bench import xela
from bench.xela import recording_of

PITCH_MM = 4.7
STEP_MM = 0.47
SHARP = palpate.SensorModel(element_mm=1.0, force_spread=0, gain_spread=0, noise_kpa=0)


def places(taxel: int, j: int, i: int, reverse: bool) -> tuple[float, float]:
    """Where a taxel lay at a position, as the pictures of the array's authors interleave readings:
    pixel (10 m + i, 10 n + j) of taxel (m, n), or (10 m + 9 - i, 10 n + 9 - j), rows downwards."""
    row = 10 * (taxel // 4) + (9 - i if reverse else i)
    column = 10 * (taxel % 4) + (9 - j if reverse else j)
    return STEP_MM * (column - 19.5), -STEP_MM * (row - 19.5)


def readings(letter: str, reverse: bool) -> NDArray[Any]:
    """[10, 10, 6, 48]: presses that grow, hold with a ripple of 1 %, and end."""
    at = [places(taxel, j, i, reverse) for j in range(10) for i in range(10) for taxel in range(16)]
    touch = palpate.simulate(letter, [[0.0, 0.0, 0.0]], elements_mm=at, sensor=SHARP)
    normal = numpy.reshape(touch.pressure, (10, 10, 1, 16))
    course = numpy.array([0.0, 0.5, 1.0, 1.01, 0.99, 0.2]).reshape(6, 1)
    array = numpy.full((10, 10, 6, 16, 3), 7.0)  # shear, which says nothing of contact
    array[..., 2] = normal * course
    return array.reshape(10, 10, 6, 48)


@pytest.mark.parametrize("reverse", [False, True])
def test_readings_lie_where_the_robot_took_them(reverse: bool) -> None:
    array = readings("F", reverse)
    recording = recording_of(array, PITCH_MM, reverse=reverse, object="F")
    assert (len(recording), recording.pressure_unit, recording.object) == (100, "raw", "F")
    elements = numpy.asarray(recording.elements_mm)
    for k, pose in enumerate(recording.T_robot_sensor):
        expected = [places(taxel, k // 10, k % 10, reverse) for taxel in range(16)]
        assert numpy.allclose(palpate.transform(pose, elements), expected, atol=1e-9)
    held = array.reshape(100, 6, 16, 3)[:, 2, :, 2]
    assert numpy.allclose(recording.pressure, held, atol=1e-9), "the mean of the held frames"


def test_the_program_writes_a_recording_and_refuses_other_arrays(tmp_path: pathlib.Path) -> None:
    def run(array: NDArray[Any]) -> Done:
        numpy.save(tmp_path / "letter.npy", array)
        flags = ("--pitch-mm", PITCH_MM, "--object", "F", "-o", tmp_path / "F.h5")
        return run_program(lambda: bench.program.main(xela.run), tmp_path / "letter.npy", *flags)

    array = readings("F", False)
    for wrong in (array[0], array[..., :47], array.astype(complex), array[:, :, :0]):
        expect_refused(run(wrong), "letter.npy: shape (")
    assert run(array).status == 0
    assert len(palpate.read_recording(tmp_path / "F.h5")) == 100
