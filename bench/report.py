"""What all programs share: their flags, their files, and the tables that they print."""

import argparse
import datetime
import json
import os
import pathlib
import platform
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import palpate

from .measures import Interval, wilson_interval

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
        flags.add_argument("--trials", type=at_least(1), help=trials)
    flags.add_argument("--quick", action="store_true", help="small sizes and few trials")
    flags.add_argument("--device", help="Vulkan device, by a part of its name or index")
    return flags


def at_least(least: int) -> Callable[[str], int]:
    """A count of a flag, which argparse refuses below the least."""

    def count(text: str) -> int:
        if int(text) < least:
            raise argparse.ArgumentTypeError(f"{int(text)}: give {least} or more")
        return int(text)

    return count


def main(run: Callable[[], None]) -> None:
    """Runs a program; says in one line what is wrong, with status 2 for input and 1 for the machine."""
    try:
        run()
    except palpate.Error as error:
        print(f"bench: {error}", file=sys.stderr)
        sys.exit(2 if error.fault == "input" else 1)


class Run:
    """A run of a program: its device, and the facts that explain its numbers."""

    def __init__(
        self, options: argparse.Namespace, folders: Mapping[str, Sequence[str]] | None = None
    ) -> None:
        """Opens the device, and prints the facts.

        folders: by flag, the names of the files that go to the flag's folder. What cannot be written is
        known before the minutes of work. Raises palpate.Error where two outputs are one file, where a
        folder cannot be made, or where the device cannot be opened.
        """
        given = vars(options)
        files = [given[flag] for flag in ("json", "html") if given.get(flag)]
        for flag, names in (folders or {}).items():
            if folder := given.get(flag):
                files += [os.path.join(folder, name) for name in names]
                try:
                    os.makedirs(folder, exist_ok=True)
                except OSError as error:
                    raise palpate.Error(
                        f"folder {folder}: {error.strerror}; give one that can be written to"
                    ) from error
        paths = [os.path.realpath(file) for file in files]
        for i, path in enumerate(paths):
            if path in paths[:i]:
                raise palpate.Error(
                    f"{files[i]}: two outputs would overwrite each other; give another name"
                )
            if os.path.isdir(path) or not os.access(os.path.dirname(path), os.W_OK):
                raise palpate.Error(
                    f"{files[i]}: cannot be written; give a file in a folder that can"
                )
        self.device = palpate.Device.open(options.device or "")
        now = datetime.datetime.now(datetime.timezone.utc)
        self.facts: Json = {
            "device": self.device.name,
            "host threads": os.cpu_count(),
            "python": platform.python_version(),
            "data": "simulated letters and sensor; the paper's recordings are not public",
            "date": now.strftime("%Y-%m-%dT%H:%M:%SZ"),
            "command line": shlex.join(sys.argv),
        }
        for name, value in self.facts.items():
            print(f"{name}: {value}  ")


def write(path: str | pathlib.Path | None, content: str | bytes) -> None:
    """Writes a file whole or not at all; without a path, nothing."""
    if not path:
        return
    part = pathlib.Path(f"{path}.{os.getpid()}.part")
    try:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
        part.replace(path)
    except OSError as error:
        failed = palpate.Error(f"{path}: {error.strerror}; make room, or give another folder")
        failed.fault = "system"
        raise failed from error


def write_json(path: str | None, document: Json) -> None:
    """Writes a document to a file, if there is one."""
    write(path, json.dumps(document, indent=2, ensure_ascii=False) + "\n")


class Measurement(NamedTuple):
    """A value, what it is held against, and its 95 % interval."""

    name: str
    value: float
    unit: str
    at_most: float | None = None
    at_least: float | None = None
    interval: Interval | None = None

    def record(self) -> Json:
        """Name, value and unit; the goal, and whether it is reached; the interval."""
        record: Json = {"name": self.name, "value": self.value, "unit": self.unit}
        if self.at_most is not None:
            record |= {"at_most": self.at_most, "reached": self.value <= self.at_most}
        if self.at_least is not None:
            record |= {"at_least": self.at_least, "reached": self.value >= self.at_least}
        if self.interval:
            record |= {"low": self.interval[0], "high": self.interval[1]}
        return record


def share_of(
    name: str,
    count: int,
    trials: int,
    *,
    at_most: float | None = None,
    at_least: float | None = None,
) -> Measurement:
    """`count` of `trials` in percent, with its 95 % score interval (Wilson)."""
    low, high = wilson_interval(count, trials)
    interval = (100.0 * low, 100.0 * high)
    return Measurement(name, 100.0 * count / trials, "%", at_most, at_least, interval)


_ROW = "| {:<28} | {:<46} | {:<28} | {:<8} | {:<7} |"


class Report:
    """Prints cases as rows of one Markdown table, as soon as they are known, and keeps them."""

    def __init__(self, facts: Json) -> None:
        """facts: of the run."""
        self._document: Json = {**facts, "cases": []}
        print("\n" + _ROW.format("case", "measured", "value", "goal", "reached"))
        print("|:--|:--|--:|:--|:--|", flush=True)

    def add(self, name: str, facts: Json, measurements: Iterable[tuple[Any, ...]]) -> None:
        """A case: `facts` are its sizes and whatever else explains the numbers.

        measurements: a Measurement each, or a tuple of its first fields.
        """
        told = ", ".join(f"{fact}: {value}" for fact, value in facts.items())
        print(f"| **{name}** | {told} | | | |")
        records = [Measurement(*measurement).record() for measurement in measurements]
        for record in records:
            value = f"{record['value']:>10.4g} {record['unit']}"
            if "low" in record:
                value += f" ({record['low']:.4g} to {record['high']:.4g})"
            goal = "".join(
                f"{sign} {record[key]:.4g}"
                for sign, key in (("≤", "at_most"), ("≥", "at_least"))
                if key in record
            )
            reached = {None: "", True: "yes", False: "no"}[record.get("reached")]
            print(_ROW.format(name, record["name"], value, goal, reached), flush=True)
        self._document["cases"].append({"name": name, **facts, "measurements": records})

    def document(self) -> Json:
        """The facts of the run, and `cases`."""
        return self._document
