"""Runs the programs of bench/ in the process of the test."""

import importlib
import json
import os
import pathlib
import sys
from typing import Any

import pytest

import bench.program
import palpate

sys.path.append(str(pathlib.Path(__file__).parents[1] / "support"))
from program import Done, run_program

DEVICE = os.environ.get("PALPATE_DEVICE", "llvmpipe")


class Program:
    """One run of a program: its document, what it printed, and the folder with its files."""

    def __init__(self, folder: pathlib.Path, name: str, *arguments: object) -> None:
        self.folder = folder
        done = run(name, "--json", folder / "results.json", *arguments)
        assert done.status == 0, done.err
        self.output = done.out
        self.document: dict[str, Any] = json.loads((folder / "results.json").read_text())

    def expect_charts(self, *names: str) -> None:
        """Expects these charts, whole, in the folder "plots"."""
        for name in names:
            assert (self.folder / "plots" / f"{name}.png").read_bytes().startswith(b"\x89PNG"), name
            svg = (self.folder / "plots" / f"{name}.svg").read_text()
            assert svg.endswith("</svg>\n"), name


def run(name: str, *arguments: object) -> Done:
    """Runs a program to its end, whatever comes of it; name: that of its module."""
    program = importlib.import_module(name).program
    return run_program(lambda: bench.program.main(program), "--device", DEVICE, *arguments)


def expect_refused(done: Done, words: str) -> None:
    assert (done.status, done.err.count("\n")) == (2, 1), done.err
    assert words in done.err


@pytest.fixture(scope="session")
def device() -> palpate.Device:
    return palpate.Device.open(DEVICE)
