"""`palpate touches` cuts strokes into touches, and says why a recording has none."""

import pathlib
import subprocess

import numpy
import pytest
from conftest import Maps, run
from numpy.typing import NDArray

import palpate

RATE_HZ = 100.0
REST = 60  #: frames before, between and after presses
POSE = (3.0, -2.0, 0.4)  #: T_object_robot of the letter

Path = NDArray[numpy.float64]  #: of the array during a press, [n, 3], a pose a frame


def still(frames: int = 60) -> Path:
    return numpy.tile([0.0, 0.0, 0.1], (frames, 1))


def stroke(begin: tuple[float, float], end: tuple[float, float], mm_per_s: float = 20.0) -> Path:
    """A straight stroke, between rests of 0.1 s in which the array presses and lifts."""
    length = float(numpy.hypot(end[0] - begin[0], end[1] - begin[1]))
    part = numpy.linspace(0.0, 1.0, 1 + round(RATE_HZ * length / mm_per_s))[:, None]
    way = numpy.array(begin) + part * (numpy.array(end) - numpy.array(begin))
    rows = numpy.hstack([way, numpy.full((len(way), 1), 0.1)])
    return numpy.vstack([rows[:1].repeat(10, 0), rows, rows[-1:].repeat(10, 0)])


STROKES = [stroke((-9, -6), (8, -6)), stroke((9, 0), (-8, 0)), stroke((-9, 6), (8, 6))]


def cut(
    folder: pathlib.Path, presses: list[Path], *flags: str, scale: float = 1.0
) -> "subprocess.CompletedProcess[str]":
    """Cuts a stream in which an array is pressed onto an E along each path, and lifted between them."""
    pressures, poses = [], []
    for i, press in enumerate(presses):
        touches = palpate.simulate("E", press, T_object_robot=POSE, seed=1 + i)
        rest = numpy.zeros((REST, touches.pressure.shape[1]))
        pressures += [rest, scale * touches.pressure, rest]
        at = numpy.array(touches.T_robot_sensor)
        poses += [at[:1].repeat(REST, 0), at, at[-1:].repeat(REST, 0)]
    pressure = numpy.vstack(pressures)
    time_s = numpy.arange(len(pressure)) / RATE_HZ
    recording = palpate.Recording(
        pressure, numpy.vstack(poses), touches.elements_mm, time_s=time_s, rows="frames", truth=touches.truth
    )
    recording.save(folder / "f.h5")
    return run("touches", "f.h5", "-o", "t.h5", "--drift-s", "0", *flags, cwd=folder)


def test_strokes_recognise_as_presses_at_the_same_places(
    tmp_path: pathlib.Path, maps: Maps, device: palpate.Device
) -> None:
    done = cut(tmp_path, STROKES, "--slide", "4")
    assert done.returncode == 0, done.stderr
    touches = palpate.read_recording(tmp_path / "t.h5")
    # 17 mm of each stroke make four parts.
    assert len(touches) == 12
    places = numpy.array([palpate.compose(POSE, pose) for pose in touches.T_robot_sensor])
    numpy.testing.assert_allclose(places[:4, 0], [-7, -3, 1, 5], atol=0.5)
    presses = palpate.simulate("E", places, T_object_robot=POSE, seed=9)
    records = palpate.recognize([touches, presses], maps, device=device)
    assert [record.best for record in records] == ["E", "E"]
    assert records[0].refined_error_mm < records[1].refined_error_mm + 0.1


def test_a_press_stays_one_touch_beside_a_slow_stroke(tmp_path: pathlib.Path) -> None:
    # Of 0.04 mm from frame to frame.
    presses = [still(), stroke((-9, -6), (8, -6), 4.0)]
    assert cut(tmp_path, presses, "--slide", "4").returncode == 0
    assert len(palpate.read_recording(tmp_path / "t.h5")) == 1 + 4


@pytest.mark.parametrize(
    ("presses", "scale", "said"),
    [
        (STROKES, 1.0, "s, moved by 17.0 mm (hold the array still, or give --slide MM)"),
        ([still(12)], 1.0, "was never steady for 0.1 s (press longer"),
        ([still()], 0.01, "above their rest"),
        ([still(12)] * 5, 1.0, "and 2 more presses make no touch"),
    ],
)
def test_a_recording_without_touches_says_why(
    presses: list[Path], scale: float, said: str, tmp_path: pathlib.Path
) -> None:
    done = cut(tmp_path, presses, "--steady", "0.05", scale=scale)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert said in done.stderr
    assert not (tmp_path / "t.h5").exists()


def test_strokes_shorter_than_their_parts_say_so(tmp_path: pathlib.Path) -> None:
    assert "give a smaller --slide" in cut(tmp_path, STROKES, "--steady", "0.05", "--slide", "50").stderr
