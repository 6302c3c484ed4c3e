"""What all programs share: their flags, and the files that they write."""

import argparse
import datetime
import json
import os
import pathlib
import platform
import shlex
import sys
from collections.abc import Callable
from typing import Any

import palpate

Json = dict[str, Any]


def parser(
    name: str, description: str, *, plots: str = "", trials: str = ""
) -> argparse.ArgumentParser:
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
    """Runs a program; says in one line what is wrong, with status 2 for input and 1 for the machine."""
    try:
        run()
    except (palpate.Error, OSError) as error:
        print(f"bench: {error}", file=sys.stderr)
        sys.exit(2 if getattr(error, "fault", "system") == "input" else 1)


def begin(options: argparse.Namespace) -> tuple[palpate.Device, Json]:
    """Opens the device, and prints the facts that explain a run's numbers.

    What cannot be written is known before the minutes of work. Raises palpate.Error where an output
    cannot be written, or where the device cannot be opened.
    """
    for flag, value in vars(options).items():
        try:
            if flag in ("csv", "plots") and value:
                os.makedirs(value, exist_ok=True)
            if flag in ("json", "html") and value:
                pathlib.Path(_part(value)).touch()
                os.remove(_part(value))
        except OSError as error:
            raise palpate.Error(
                f"--{flag} {value}: cannot be written: {error.strerror}; give another place"
            ) from error
    device = palpate.Device.open(options.device)
    now = datetime.datetime.now(datetime.timezone.utc)
    facts: Json = {
        "device": device.name,
        "host threads": os.cpu_count(),
        "python": platform.python_version(),
        "data": "simulated letters and sensor; the paper's recordings are not public",
        "date": now.strftime("%Y-%m-%dT%H:%M:%SZ"),
        "command line": shlex.join(sys.argv),
    }
    for name, fact in facts.items():
        print(f"{name}: {fact}  ")
    return device, facts


def _part(path: str | pathlib.Path) -> str:
    return f"{path}.{os.getpid()}.part"


def write(path: str | pathlib.Path | None, content: str | bytes | Json) -> None:
    """Writes a file whole or not at all, a document as JSON; without a path, nothing."""
    if not path:
        return
    if isinstance(content, dict):
        content = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
    pathlib.Path(_part(path)).write_bytes(
        content.encode() if isinstance(content, str) else content
    )
    os.replace(_part(path), path)
