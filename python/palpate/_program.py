"""What programs on the module share: the facts that explain a run, and files that appear whole."""

import argparse
import datetime
import json
import os
import pathlib
import shlex
import sys
from collections.abc import Callable
from typing import Any

from ._error import Error
from ._palpate import Device

Json = dict[str, Any]


def begin(options: argparse.Namespace, **own: object) -> tuple[Device, Json]:
    """Opens the device, and prints the facts that explain a run's numbers, a program's `own` among them.

    What cannot be written is known before the minutes of work: the option plots names a folder, json a file.
    Raises Error where an output cannot be written, or the device not be opened.
    """
    for flag, value in vars(options).items():
        try:
            if flag == "plots" and value:
                os.makedirs(value, exist_ok=True)
            if flag == "json" and value:
                pathlib.Path(_part(value)).touch()
                os.remove(_part(value))
        except OSError as error:
            raise Error(
                f"--{flag} {value}: cannot be written: {error.strerror}; give another place"
            ) from error
    device = Device.open(options.device)
    facts: Json = {
        "device": device.name,
        "host threads": os.cpu_count(),
        **own,
        "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "command line": shlex.join(["python", *sys.orig_argv[1:]]),
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


def main(run: Callable[[], None], name: str) -> None:
    """Runs a program; says in one line what is wrong, with status 2 for input and 1 for the machine."""
    try:
        run()
    except (Error, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        sys.exit(2 if getattr(error, "fault", "system") == "input" else 1)
