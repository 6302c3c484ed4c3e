"""Runs the commands of the pages of docs/ as their readers do, and compares what they print with what
the pages quote."""

import json
import os
import pathlib
import re
import subprocess
from typing import Any

from command import COMMAND, CommandTest

ROOT = pathlib.Path(__file__).resolve().parents[2]
END_OF_BLOCK = "\x1e"


def blocks_in(page: str) -> list[tuple[str, list[str]]]:
    """The blocks ```sh of a page, each with the lines of fences without a language below it, which quote
    what it prints."""
    blocks: list[tuple[str, list[str]]] = []
    for language, text in re.findall(r"^```(.*)\n((?:(?!```).*\n)*)```", page, re.MULTILINE):
        if language == "sh":
            blocks.append((text, []))
        elif not language and blocks:
            blocks[-1][1].extend(text.splitlines())
    return blocks


def words_of(line: str) -> list[str]:
    """The words of a line; a coordinate and its standard deviation are two."""
    line = line.replace("+-", " ")
    if "per second" in line:  # how long it took is never the same
        line = re.sub(r"[0-9.]", "", line)
    # Dropped mass has one digit, and is at most 1e-4.
    return [word for word in line.split() if not re.fullmatch(r"dropped|0\.0001|.e-0.", word)]


def agree(quoted: str, printed: str) -> bool:
    """Equal, but that the last digit of numbers with a point may be one off: on another machine, float32
    rounds elsewhere."""
    number = re.compile(r"([-+]?[0-9]*\.([0-9]*))(.*)")
    a, b = number.fullmatch(quoted), number.fullmatch(printed)
    if quoted == printed or not a or not b or a[3] != b[3]:
        return quoted == printed
    return abs(float(a[1]) - float(b[1])) < 1.5 * 10.0 ** -len(a[2])


def holds(printed: list[str], quoted: list[str]) -> bool:
    """Whether a line has these words, in their order: a quotation may leave columns of a table out."""
    words = iter(printed)
    return all(any(agree(word, other) for other in words) for word in quoted)


class PageTest(CommandTest):
    """Runs pages in a folder of the test's own."""

    def run_page(self, page: str) -> tuple[str, str]:
        """Runs all blocks ```sh of a page, in their order, as one script that any failure ends, and
        returns what they print and what they complain of. A line that is quoted and not printed fails."""
        blocks = blocks_in((ROOT / "docs" / page).read_text())
        self.assertTrue(blocks, f"{page} has no commands")
        end = "printf '\\x1e'; printf '\\x1e' >&2\n"
        script = "".join(commands + end for commands, _ in blocks)
        environment = dict(os.environ, PYTHONDONTWRITEBYTECODE="1")
        folders = [pathlib.Path(COMMAND).parent]
        if "PALPATE_MODULE" in os.environ:
            folders.append(pathlib.Path(os.environ["PALPATE_PYTHON"]).parent)
            environment["PYTHONPATH"] = os.environ["PALPATE_MODULE"]
        environment["PATH"] = ":".join([*map(str, folders), environment["PATH"]])
        bash = ["bash", "-euo", "pipefail", "-c", script]
        run = subprocess.run(bash, cwd=self.folder, env=environment, capture_output=True, text=True)
        self.assertEqual(run.returncode, 0, run.stderr)
        printed = zip(run.stdout.split(END_OF_BLOCK), run.stderr.split(END_OF_BLOCK), strict=True)
        for (_, quoted), texts in zip(blocks, printed, strict=False):
            lines = [words_of(line) for line in "".join(texts).splitlines()]
            for line in quoted:
                if line != "..." and not any(holds(other, words_of(line)) for other in lines):
                    self.fail(f"the commands above it do not print: {line}\nbut:\n{''.join(texts)}")
        return run.stdout.replace(END_OF_BLOCK, ""), run.stderr.replace(END_OF_BLOCK, "")

    def json(self, file: str) -> Any:
        """What the commands have written."""
        return json.loads((self.folder / file).read_text())

    def scores(self, results: str) -> Any:
        """What `palpate evaluate` says about results."""
        return json.loads(self.done("evaluate", results, "--json", "-"))

    def assert_written(self, *names: str) -> None:
        for name in names:
            self.assertTrue((self.folder / name).exists(), name)
