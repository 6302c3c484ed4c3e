"""The examples run, and pass mypy --strict."""

import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples" / "python").glob("*.py"))


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_draws_its_picture(example: pathlib.Path, tmp_path: pathlib.Path) -> None:
    run = subprocess.run(
        [sys.executable, example], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout
    assert [path.suffix for path in tmp_path.glob("*.png")] == [".png"]


def test_types_are_strict() -> None:
    package = ROOT / "python" / "palpate"
    stubs = pathlib.Path(os.environ["MYPYPATH"]) / "palpate" / "_palpate.pyi"
    assert stubs.exists()
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull, *EXAMPLES,
         stubs.parent / "__init__.py", stubs.parent / "recognition.py", stubs.parent / "streams.py",
         stubs.parent / "plots.py"],
        cwd=ROOT, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout
    assert len(EXAMPLES) == 3
    assert (package / "py.typed").exists()
