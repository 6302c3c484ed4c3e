"""Runs the programs of bench/ as a user does."""

import json
import os
import pathlib
import subprocess
import sys
from typing import Any

import pytest

import palpate


class Program:
    """One run of a program: its document, what it printed, and the folder with its files."""

    def __init__(self, folder: pathlib.Path, name: str, *arguments: object) -> None:
        self.folder = folder
        done = run(name, "--json", folder / "results.json", *arguments)
        assert done.returncode == 0, done.stderr
        self.output = done.stdout
        self.document: dict[str, Any] = json.loads((folder / "results.json").read_text())

    def expect_charts(self, *names: str) -> None:
        """Expects these charts, whole, in the folder "plots"."""
        for name in names:
            assert (self.folder / "plots" / f"{name}.png").read_bytes().startswith(b"\x89PNG"), name
            svg = (self.folder / "plots" / f"{name}.svg").read_text()
            assert svg.endswith("</svg>\n"), name


def run(name: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Runs a program to its end, whatever comes of it; name: that of its module."""
    device = os.environ.get("PALPATE_DEVICE", "llvmpipe")
    return subprocess.run(
        [sys.executable, "-m", name, "--device", device, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.fixture(scope="session")
def device() -> palpate.Device:
    return palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))
