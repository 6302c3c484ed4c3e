"""What a notebook shows: figures of what is in memory, and Palpate's page for files and streams."""

import atexit
import os
import pathlib
import re
import shutil
import subprocess
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ._error import Error
from ._palpate import Marginals, OccupancyGrid
from ._recording import Recording
from .results import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_Path = str | os.PathLike[str]


class Page:
    """A page of `palpate view`, which a notebook shows in place; it ends with the interpreter."""

    def __init__(self, url: str, process: "subprocess.Popen[str] | None" = None):
        self.url = url
        self._process = process

    def close(self) -> None:
        """Ends the command that serves the page, where show() has started it."""
        if self._process is not None:
            self._process.terminate()
            self._process.wait()

    def __repr__(self) -> str:
        return f"Page({self.url!r})"

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="900" style="border: 0"></iframe>'


def show(
    what: OccupancyGrid | Marginals | Recording | Record | _Path | Sequence[_Path],
    *,
    command: str | None = None,
) -> "Axes | Page":
    """Shows a map, a belief, touches or a record as a figure, and files or a stream as a page.

    what: an object that has plot(), whose axes are returned; files or folders that `palpate view`
    takes; or the address of a page that `palpate live --page` serves, "http://127.0.0.1:8080/".
    command: the program `palpate`; by default that of the package, else the first on the path.
    Raises Error where a file cannot be shown or the program is missing. A page is served on this
    machine's loopback address, at a free port.
    """
    if not isinstance(what, str | os.PathLike | Sequence):
        return what.plot()
    if isinstance(what, str) and what.startswith(("http://", "https://")):
        return Page(what)
    paths: list[_Path] = [what] if isinstance(what, str | os.PathLike) else list(what)
    program = command or _program()
    process = subprocess.Popen(
        [program, "view", *(os.fspath(path) for path in paths), "--page", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None and process.stderr is not None
    match = re.search(r"http://\S+/", process.stdout.readline())
    if match is None:
        said: Any = process.communicate()[1]
        raise Error(said.removeprefix("palpate: ").strip())
    page = Page(match[0], process)
    atexit.register(page.close)
    return page


def _program() -> str:
    own = pathlib.Path(__file__).parent / "bin" / "palpate"
    found = str(own) if own.exists() else shutil.which("palpate")
    if found is None:
        raise Error("the program palpate is missing; name it with command=")
    return found
