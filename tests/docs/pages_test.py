"""Every command of the pages of docs/ runs as its readers run it, prints what the page quotes, and ends in
what it tells."""

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
            blocks[-1][1].extend(["...", *text.splitlines()])
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


def runs_of(lines: list[str]) -> list[list[str]]:
    """Lines with the indented ones below them, such as what else a table says of an unknown."""
    runs: list[list[str]] = [[""]]
    for line in lines:
        runs += [] if line.startswith(" ") else [[]]
        runs[-1].append(line)
    return runs


def holds(printed: list[str], quoted: list[str]) -> bool:
    """Whether a line has these words, in their order: a quotation may leave columns of a table out."""
    words = iter(printed)
    return all(any(agree(word, other) for other in words) for word in quoted)


class Pages(CommandTest):
    """Runs pages in a folder of the test's own."""

    def run_page(self, page: str) -> tuple[str, str]:
        """Runs all blocks ```sh of a page, in their order, as one script that any failure ends, and
        returns what they print and what they complain of. A line that is quoted and not printed fails, as
        does an indented one that is not printed below the line that it is quoted below."""
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
            runs = [[words_of(line) for line in run] for run in runs_of("".join(texts).splitlines())]
            for head, *below in runs_of(quoted)[1:]:
                left_out = head == "..."
                beside = [run for run in runs if left_out or holds(run[0], words_of(head))]
                for line in below if left_out or below else [head]:
                    if not any(holds(other, words_of(line)) for run in beside for other in run):
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

    # Some 15 seconds of a processor: most go into learning the sensor.
    def test_start_recognises_an_e(self) -> None:
        _, complained = self.run_page("start.md")
        self.assertEqual(complained, "")
        self.assert_written("maps.png", "sheets/unknown.png")

    # Some 13 seconds of a processor: three maps, and every command on automatic bins.
    def test_how_sure_tells_the_stranger(self) -> None:
        said, complained = self.run_page("how_sure.md")
        self.assertEqual(complained, "")
        self.assert_written("sheets/stranger.png")
        known, _ = self.json("result.json")
        self.assertNotIn("warnings", known)
        self.assertIn("% of the belief unproven", said)  # the budget of 1 ms

    # Some 40 seconds of a processor, a third of them for the fit, which recognises twelve unknowns again
    # for every displacement that it tries.
    def test_misplaced_touches_are_noticed_measured_and_averaged(self) -> None:
        self.run_page("misplaced.md")
        for results in ("exact.json", "averaged.json"):
            self.assertEqual(self.scores(results)["accuracy"], 1, results)

    # The page runs the Python module. Some 23 seconds of a processor, for lattices of up to
    # a million bins by the histogram.
    def test_bins_help_the_mode_only(self) -> None:
        said, complained = self.run_page("bins.md")
        self.assertEqual(complained, "")
        self.assert_written("sweep/sweep_own_bins.png", "sweep/sweep_own_time.svg")
        points = self.json("sweep.json")["points"]
        self.assertEqual(len(points), 7)
        for point, error_mm, sd_mm in [(3, 0.275, 0.211), (6, 0.189, 0.144)]:
            self.assertAlmostEqual(points[point]["refined_error_mm"]["mean"], error_mm, delta=0.02)
            self.assertAlmostEqual(points[point]["sd_mm"], sd_mm, delta=0.02)
        # The page's table, with room for other rounding.
        for results, error_mm, room, refined_mm, refined_room in [
            ("auto.json", 0.40, 0.03, 0.18, 0.02),
            ("fine.json", 0.24, 0.03, 0.19, 0.02),
            ("coarse.json", 1.19, 0.06, 0.96, 0.06),
        ]:
            records = self.json(results)
            for field, mean, delta in [
                ("error_mm", error_mm, room),
                ("refined_error_mm", refined_mm, refined_room),
            ]:
                told = sum(record[field] for record in records) / len(records)
                self.assertAlmostEqual(told, mean, delta=delta, msg=f"{results} {field}")
        for counts in ("62 x 71 x 200", "124 x 141 x 400"):
            self.assertIn(f"2 maps, {counts} bins each", said)

    def test_programs_act_on_lines_of_touches(self) -> None:
        self.run_page("programs.md")
        self.assert_written("ros/A.yaml", "ros/E.yaml")
        [record, *_] = self.json("result.json")
        self.assertEqual(record["best"], "E")
        self.assertIn("none", record)

    def test_batch_recognises_and_merges(self) -> None:
        _, complained = self.run_page("batch.md")
        self.assertIn("listed/: 4 of 4 unknowns, 1 failed", complained)
        self.assertEqual(self.scores("results")["accuracy"], 1)
        self.assert_written("all.ndjson", "shared.ndjson", "results/runs/000002.json")

    # Some 34 seconds of a processor: the sensor of an array of 256 elements is learned, and 18 touches
    # are recognised with it, each alone.
    def test_own_sensor_finds_the_unknown(self) -> None:
        said, complained = self.run_page("own_sensor.md")
        self.assertEqual(complained, "", "the logs of the page are in order")
        self.assertNotIn("Suspicious", said)
        self.assert_written("maps.png", "drawn.png", "maps/sensor.yaml", "sheets/unknown.png")
        for results in ("before.json", "after.json"):
            self.assertEqual(self.scores(results)["accuracy"], 1, results)

    # Without any pose: 4 letters and one that was never learned. Some 17 seconds of a processor, most to
    # find where presses lie on each other.
    def test_own_presses_at_unknown_poses_make_a_recogniser(self) -> None:
        _, complained = self.run_page("own_presses.md")
        self.assertEqual(complained, "", "the logs of the page are in order")
        self.assert_written("maps.png")

    def test_files_has_a_program_that_writes_a_recording(self) -> None:
        page = (ROOT / "docs/files.md").read_text()
        [program, *_] = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
        # Debian's Python, with the package python3-h5py.
        subprocess.run(["/usr/bin/python3", "-c", program], cwd=self.folder, check=True)
        info = self.done("info", "disc.h5")
        self.assert_named(info, "recording of disc", "touches           25", "0.5 to 12 kPa")
        self.assertIn("elements          36", info)
        self.done("map", "disc.h5", "-o", "disc.map.h5")
        area = (
            "import h5py; map = h5py.File('disc.map.h5'); cells = map['log_odds'][:]; "
            "print((cells > 0).sum() * map.attrs['cell_mm'] ** 2)"
        )
        said = subprocess.check_output(["/usr/bin/python3", "-c", area], cwd=self.folder)
        # A disc with a radius of 8 mm has 201 mm2; elements 2 mm apart show its edge to half of that.
        self.assertAlmostEqual(float(said), 201, delta=50)
