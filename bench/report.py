"""What all programs share: their flags, their files, and the tables that they print."""

import argparse
import datetime
import json
import os
import pathlib
import platform
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import palpate

from .measures import Interval, wilson_interval

Json = dict[str, Any]


def parser(name: str, description: str, *, plots: str = "") -> argparse.ArgumentParser:
    """The flags that all programs have. plots: what --plots draws; without it there is no such flag."""
    flags = argparse.ArgumentParser(f"./dev bench {name}", description=description)
    flags.add_argument("--json", metavar="FILE", help="write the results to this file")
    if plots:
        flags.add_argument("--plots", metavar="FOLDER", help=f"{plots}, as PNG and SVG")
    flags.add_argument("--quick", action="store_true", help="small sizes and few trials")
    flags.add_argument("--device", help="Vulkan device, by a part of its name or index")
    return flags


def at_least_1(text: str) -> int:
    """A count of a flag, which argparse refuses below 1."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value}: give 1 or more")
    return value


def main(run: Callable[[], None]) -> None:
    """Runs a program; says in one line what is wrong, with status 2 for input and 1 for the machine."""
    try:
        run()
    except palpate.Error as error:
        print(f"bench: {error}", file=sys.stderr)
        sys.exit(2 if error.fault == "input" else 1)


class Run:
    """A run of a program: its device, the facts that explain its numbers, and its files."""

    def __init__(self, options: argparse.Namespace, folders: Json | None = None) -> None:
        """Opens the device, and prints the facts.

        folders: by flag, the names of the files that go to the flag's folder. What cannot be written is
        known before the minutes of work. Raises palpate.Error where two outputs are one file, where a
        folder cannot be made, or where the device cannot be opened.
        """
        given = vars(options)
        files = [given[flag] for flag in ("json", "html") if given.get(flag)]
        for flag, names in (folders or {}).items():
            if given.get(flag):
                files += [os.path.join(given[flag], name) for name in names]
                _make_folder(given[flag])
        _require_writable(files)
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


def _make_folder(folder: str) -> None:
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise palpate.Error(
            f"folder {folder}: {error.strerror}; give one that can be written to"
        ) from error


def _require_writable(files: Sequence[str]) -> None:
    seen = set()
    for file in files:
        path = os.path.realpath(file)
        if path in seen:
            raise palpate.Error(
                f"{file}: two outputs would overwrite each other; give another name"
            )
        seen.add(path)
        if os.path.isdir(path) or not os.access(os.path.dirname(path), os.W_OK):
            raise palpate.Error(f"{file}: cannot be written; give a file in a folder that can")


def write(path: str | pathlib.Path | None, content: str | bytes) -> None:
    """Writes a file whole or not at all; without a path, nothing."""
    if not path:
        return
    part = f"{path}.{os.getpid()}.part"
    try:
        with open(part, "wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
        os.replace(part, path)
    except OSError as error:
        failed = palpate.Error(f"{path}: {error.strerror}; make room, or give another folder")
        failed.fault = "system"
        raise failed from error


def write_json(path: str | None, document: Json) -> None:
    """Writes a document to a file, if there is one."""
    write(path, json.dumps(document, indent=2, ensure_ascii=False) + "\n")


@dataclass(frozen=True)
class Measurement:
    """A value, what it is held against, and its 95 % interval."""

    name: str
    value: float
    unit: str
    at_most: float | None = None
    at_least: float | None = None
    interval: Interval | None = None

    @property
    def reached(self) -> bool:
        """Whether the goal is met; true where there is none."""
        above = self.at_least is None or self.value >= self.at_least
        return above and (self.at_most is None or self.value <= self.at_most)

    def record(self) -> Json:
        """Name, value and unit; the goal, and whether it is reached; the interval."""
        record: Json = {"name": self.name, "value": self.value, "unit": self.unit}
        for goal in ("at_most", "at_least"):
            if getattr(self, goal) is not None:
                record |= {goal: getattr(self, goal), "reached": self.reached}
        if self.interval:
            record |= {"low": self.interval[0], "high": self.interval[1]}
        return record

    def row(self, case: str) -> str:
        """A row of the report's table."""
        goal = "" if self.at_most is None else f"≤ {self.at_most:.4g}"
        goal = goal if self.at_least is None else f"≥ {self.at_least:.4g}"
        reached = "" if not goal else "yes" if self.reached else "no"
        unit = self.unit
        if self.interval:
            unit += f" ({self.interval[0]:.4g} to {self.interval[1]:.4g})"
        return (
            f"| {case:<28} | {self.name:<46} | {self.value:>10.4g} {unit:<17} | {goal:<8} "
            f"| {reached:<7} |"
        )


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


@dataclass
class Report:
    """Prints cases as rows of one Markdown table, as soon as they are known, and keeps them."""

    facts: Json
    cases: list[Json] = field(default_factory=list)

    def __post_init__(self) -> None:
        print(
            f"\n| {'case':<28} | {'measured':<46} | {'value':<28} | {'goal':<8} | {'reached':<7} |"
        )
        print("|:--|:--|--:|:--|:--|", flush=True)

    def add(self, name: str, facts: Json, measurements: Iterable[Measurement]) -> None:
        """A case: `facts` are its sizes and whatever else explains the numbers."""
        rows = list(measurements)
        told = ", ".join(f"{fact}: {value}" for fact, value in facts.items())
        print(f"| **{name}** | {told} | | | |")
        for measurement in rows:
            print(measurement.row(name), flush=True)
        records = [measurement.record() for measurement in rows]
        self.cases.append({"name": name, **facts, "measurements": records})

    def document(self) -> Json:
        """The facts, and `cases`."""
        return {**self.facts, "cases": self.cases}
