"""docs/architecture.md says what is: its table and its picture have the folders of tests/layers.py, in
the order in which they may use each other, its functions stand in the files that they link to, and the
lines of its diffs in the files that they name."""

import pathlib
import re
import runpy
import unittest
from xml.etree import ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/architecture.md"
BELOW = runpy.run_path(str(ROOT / "tests/layers.py"))["BELOW"]
#: From the top down.
FOLDERS = list(reversed(BELOW))


def name_of(folder: str) -> str:
    return folder.split("/")[-1]


class Folders(unittest.TestCase):
    def test_of_the_table_are_in_order_and_use_what_they_may(self) -> None:
        rows = re.findall(r"^\| `([a-z/]+)` \|[^|]+\| ([^|]+) \|[^|]+\|$", PAGE.read_text(), re.MULTILINE)
        self.assertEqual([folder for folder, _ in rows], FOLDERS)
        for place, (folder, may_use) in enumerate(rows):
            named = {name_of(name) for name in re.findall(r"`([^`]+)`", may_use)}
            below = {name_of(name) for name in FOLDERS[place + 1 :]}
            used = below - named if may_use.startswith("all but") else named
            self.assertEqual(used, set(BELOW[folder]) - {"shaders"}, folder)

    def test_of_the_picture_are_in_order_and_lie_above_what_they_use(self) -> None:
        svg = ElementTree.parse(ROOT / "docs/figures/layers.svg")
        texts = svg.findall(".//*[@class='folders']/{*}text")
        self.assertEqual([text.text for text in texts], [name_of(folder) for folder in FOLDERS])
        height = {text.text: float(text.attrib["y"]) for text in texts}
        for folder, below in BELOW.items():
            for used in set(below) - {"shaders"}:
                self.assertLess(height[name_of(folder)], height[used], f"{folder} uses {used}")


class Sources(unittest.TestCase):
    def test_have_the_functions_that_link_to_them(self) -> None:
        links = re.findall(r"\[`([\w:]+)\(\)`\]\(([^)]+)\)", PAGE.read_text())
        self.assertGreater(len(links), 12)
        for function, file in links:
            text = (PAGE.parent / file).read_text()
            self.assertRegex(text, rf"(?m)^[A-Za-z].*\b{function}\(", file)

    def test_have_the_lines_that_are_added_to_them(self) -> None:
        diffs = re.findall(r"```diff\n(.*?)```", PAGE.read_text(), re.DOTALL)
        self.assertEqual(len(diffs), 4)
        for line in "".join(diffs).splitlines():
            if line.startswith("+++ "):
                lines = (ROOT / line.removeprefix("+++ ")).read_text().splitlines()
            else:
                self.assertTrue(line.startswith("+"), line)
                self.assertIn(line[1:], lines)
