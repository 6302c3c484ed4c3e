"""What all programs share: their flags, and the facts that they begin with."""

import argparse
import platform
from collections.abc import Callable

import palpate
from palpate import _program
from palpate._program import Json, write

__all__ = ["Json", "at_least_1", "begin", "main", "parser", "write"]


def parser(name: str, description: str, *, plots: str = "", trials: str = "") -> argparse.ArgumentParser:
    """The flags that programs have. plots, trials: what these flags give; without, there is none."""
    flags = argparse.ArgumentParser(f"./dev bench {name}", description=description)
    flags.add_argument("--json", metavar="FILE", help="write the results to this file")
    if plots:
        flags.add_argument("--plots", metavar="FOLDER", help=f"{plots}, as PNG and SVG")
    if trials:
        flags.add_argument("--trials", type=at_least_1, metavar="N", help=trials)
    flags.add_argument("--quick", action="store_true", help="small sizes and few trials")
    flags.add_argument("--device", default="", help="Vulkan device, by a part of its name or index")
    return flags


def at_least_1(text: str) -> int:
    """A count of a flag."""
    if int(text) < 1:
        raise argparse.ArgumentTypeError(f"{int(text)}: give 1 or more")
    return int(text)


def main(run: Callable[[], None]) -> None:
    """Runs a program, as palpate's own."""
    _program.main(run, "bench")


def begin(
    options: argparse.Namespace,
    data: str = "simulated letters and sensor; the paper's recordings are not public",
) -> tuple[palpate.Device, Json]:
    """Opens the device and prints the facts. Raises palpate.Error as palpate._program.begin() does."""
    return _program.begin(options, python=platform.python_version(), data=data)
