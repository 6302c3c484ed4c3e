"""Runs programs on the module in the process of the test, as a shell starts them."""

import contextlib
import io
import sys
import warnings
from collections.abc import Callable
from typing import NamedTuple
from unittest import mock


class Done(NamedTuple):
    status: int
    out: str
    err: str


def run_program(main: Callable[[], object], *arguments: object) -> Done:
    """What main() makes of the arguments, and its exit status."""
    out, err, status = io.StringIO(), io.StringIO(), 0
    line = ["program", *map(str, arguments)]
    with (
        mock.patch.object(sys, "argv", line),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("always")
        try:
            returned = main()
            status = returned if isinstance(returned, int) else 0
        except SystemExit as end:
            status = int(end.code or 0)
    return Done(status, out.getvalue(), err.getvalue())
