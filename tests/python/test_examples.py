"""The examples run, draw the pictures that stand next to them, and pass mypy --strict."""

import contextlib
import io
import pathlib
import runpy
import subprocess
import sys

import matplotlib
import numpy
import pytest
from matplotlib.image import imread

import palpate

ROOT = pathlib.Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples" / "python").glob("*.py"))
NODE = sorted((ROOT / "examples" / "ros2" / "palpate_ros2").glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_draws_its_picture(
    example: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with matplotlib.rc_context(), contextlib.redirect_stdout(io.StringIO()) as said:
        matplotlib.rcdefaults()  # of other programs in this process
        runpy.run_path(str(example), run_name="__main__")
    assert said.getvalue()
    [made] = tmp_path.glob("*.png")
    stored = example.with_suffix(".png")
    assert made.name == stored.name
    ours, theirs = imread(made), imread(stored)
    assert ours.shape == theirs.shape
    # Devices round differently, which moves a few pixels of a line or of a belief.
    difference = numpy.abs(ours - theirs).mean()
    assert difference < 0.005, f"look at {made} and {stored}; copy the first if it is right"


def test_types_are_strict(tmp_path: pathlib.Path) -> None:
    package = pathlib.Path(palpate.__file__).parent
    for file in ("_palpate.pyi", "reference.pyi", "py.typed"):
        assert (package / file).exists()
    assert (len(EXAMPLES), len(NODE)) == (3, 4)
    # The package is checked with the type stubs of its extension modules.
    command = ROOT / "python" / "palpate_command.py"
    for checked in ([*EXAMPLES, *NODE, command], ["-p", "palpate", "-p", "bench"]):
        run = subprocess.run(
            [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), *checked],
            cwd=ROOT, capture_output=True, text=True, timeout=300,
        )  # fmt: skip
        assert run.returncode == 0, run.stdout
