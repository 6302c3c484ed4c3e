"""`palpate touches` cuts strokes into touches, and says why a recording has none."""

import os
import pathlib
import subprocess

import numpy
import pytest
from numpy.typing import NDArray

import palpate

RATE_HZ = 100.0
REST = 60  #: frames before, between and after presses
POSE = [3.0, -2.0, 0.4]  #: of the letter in the robot frame

Path = NDArray[numpy.float64]  #: of the array during a press, [n, 3], a pose a frame


def still(x: float, y: float, frames: int = 60) -> Path:
    return numpy.tile([x, y, 0.1], (frames, 1))


def stroke(begin: tuple[float, float], end: tuple[float, float], mm_per_s: float) -> Path:
    """A straight stroke, between rests of 0.1 s in which the array presses and lifts."""
    length = float(numpy.hypot(end[0] - begin[0], end[1] - begin[1]))
    part = numpy.linspace(0.0, 1.0, 1 + round(RATE_HZ * length / mm_per_s))[:, None]
    way = numpy.array(begin) + part * (numpy.array(end) - numpy.array(begin))
    rows = numpy.hstack([way, numpy.full((len(way), 1), 0.1)])
    return numpy.vstack([rows[:1].repeat(10, 0), rows, rows[-1:].repeat(10, 0)])


def frames(presses: list[Path], shape: str = "E", scale: float = 1.0) -> palpate.Recording:
    """A stream in which an array is pressed onto a letter along each path, and lifted between them."""
    pressures, poses = [], []
    for i, press in enumerate(presses):
        touches = palpate.simulate(shape, press, T_object_robot=POSE, seed=1 + i)
        rest = numpy.zeros((REST, touches.pressure.shape[1]))
        pressures += [rest, scale * touches.pressure, rest]
        poses += [press[:1].repeat(REST, 0), press, press[-1:].repeat(REST, 0)]
    pressure = numpy.vstack(pressures)
    time_s = numpy.arange(len(pressure)) / RATE_HZ
    return palpate.Recording(
        pressure, numpy.vstack(poses), touches.elements_mm, time_s=time_s, rows="frames", truth=touches.truth
    )


def run(folder: pathlib.Path, recording: palpate.Recording, *flags: str) -> "subprocess.CompletedProcess[str]":
    recording.save(folder / "f.h5")
    arguments = [os.environ["PALPATE_COMMAND"], "touches", "f.h5", "-o", "t.h5", "--drift-s", "0", *flags]
    return subprocess.run(arguments, cwd=folder, capture_output=True, text=True)


STROKES = [stroke((-8, -6), (8, -6), 20), stroke((8, 0), (-8, 0), 20), stroke((-8, 6), (8, 6), 20)]


def test_strokes_recognise_as_presses_at_the_same_places(
    tmp_path: pathlib.Path, maps: list[palpate.OccupancyGrid], device: palpate.Device
) -> None:
    done = run(tmp_path, frames(STROKES), "--slide", "4")
    assert done.returncode == 0, done.stderr
    cut = palpate.read_recording(tmp_path / "t.h5")
    # 16 mm of each stroke make four parts; their middles lie at -6, -2, 2 and 6 mm.
    assert len(cut) == 12
    numpy.testing.assert_allclose(numpy.sort(cut.T_robot_sensor[:4, 0]), [-6, -2, 2, 6], atol=0.3)
    presses = palpate.simulate("E", cut.T_robot_sensor, T_object_robot=POSE, seed=9)
    errors = []
    for recording in (cut, presses):
        [record] = palpate.recognize(recording, maps, device=device)
        assert record.best == "E"
        errors.append(record.refined_error_mm)
    assert errors[0] < errors[1] + 0.1


def test_a_press_that_does_not_slide_stays_one_touch(tmp_path: pathlib.Path) -> None:
    assert run(tmp_path, frames([still(0, 0), STROKES[0]]), "--slide", "4").returncode == 0
    assert len(palpate.read_recording(tmp_path / "t.h5")) == 1 + 4


@pytest.mark.parametrize(
    ("presses", "scale", "said"),
    [
        (STROKES, 1.0, "the press 0.6 s from its start, of 1.03 s, moved by 16.0 mm (hold the array still, or give "
                       "--slide MM)"),
        ([still(0, 0, 12)], 1.0, "was never steady for 0.1 s (press longer"),
        ([still(0, 0)], 0.01, "above their rest"),
        ([still(0, 0, 12)] * 5, 1.0, "and so did 2 more presses"),
    ],
)  # fmt: skip
def test_a_recording_without_touches_says_why(
    presses: list[Path], scale: float, said: str, tmp_path: pathlib.Path
) -> None:
    done = run(tmp_path, frames(presses, scale=scale), "--steady", "0.05")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert said in done.stderr
    assert not (tmp_path / "t.h5").exists()
