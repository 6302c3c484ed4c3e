"""Commands with a page, for its tests."""

import os
import pathlib
import re
import signal
import subprocess
from collections.abc import Callable, Iterator

import pytest

import palpate

#: Four touches of an E, at ten times the speed of a robot; what was touched is known.
STREAM = "simulate:E,seed=8,touches=4,speed=10,object=random"


class Paged:
    """A command with a page."""

    def __init__(self, folder: pathlib.Path, *arguments: str):
        self.process = subprocess.Popen(
            [os.environ["PALPATE_COMMAND"], *arguments],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        assert self.process.stdout is not None
        first = self.process.stdout.readline()
        match = re.fullmatch(r"the page is at (http://127\.0\.0\.1:(\d+)/).*\n", first)
        assert match, first + self.process.stdout.read()
        self.url, self.port = match[1], int(match[2])

    def end(self) -> str:
        """Ends the command as Ctrl-C does, and returns what it has said."""
        self.process.send_signal(signal.SIGINT)
        said, _ = self.process.communicate(timeout=60)
        assert self.process.returncode == 0, said
        return said


@pytest.fixture(scope="module")
def folder(
    tmp_path_factory: pytest.TempPathFactory, maps: list[palpate.OccupancyGrid]
) -> pathlib.Path:
    """A folder with maps of A, E and I."""
    folder = tmp_path_factory.mktemp("page")
    (folder / "maps").mkdir()
    for one in maps:
        one.save(folder / "maps" / f"{one.label}.map.h5")
    return folder


@pytest.fixture
def paged(folder: pathlib.Path) -> Iterator[Callable[..., Paged]]:
    """Starts commands, which end with the test."""
    started: list[Paged] = []

    def start(*arguments: str) -> Paged:
        started.append(Paged(folder, *arguments))
        return started[-1]

    yield start
    for one in started:
        one.process.kill()
        one.process.wait()


@pytest.fixture
def live(paged: Callable[..., Paged]) -> Callable[..., Paged]:
    """Starts `palpate live`, with a page at a free port or at `port`."""

    def start(*options: str, port: int = 0, sensor: str = STREAM) -> Paged:
        arguments = ["--sensor", sensor, "--maps", "maps", "--bins", "20x20x24", *options]
        return paged("live", *arguments, "--page", str(port))

    return start
