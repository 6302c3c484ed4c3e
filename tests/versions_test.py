#!/usr/bin/env python3
"""The version of CMakeLists.txt is that of the Python module, the node of ROS 2 and the newest release of
CHANGELOG.md, and the documents and examples ask for it."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]


def found(file: pathlib.Path, pattern: str) -> list[str]:
    return re.findall(pattern, file.read_text(), re.MULTILINE)


class Versions(unittest.TestCase):
    def test_agree(self) -> None:
        [version] = found(ROOT / "CMakeLists.txt", r"^project\(palpate VERSION (\S+) ")
        for file, pattern in {
            "pyproject.toml": r'^version = "(.+)"$',
            "examples/ros2/setup.py": r'^    version="(.+)",$',
            "examples/ros2/package.xml": r"^  <version>(.+)</version>$",
        }.items():
            self.assertEqual(found(ROOT / file, pattern), [version], file)
        releases = found(ROOT / "CHANGELOG.md", r"^## \[([\d.]+)\] - \d{4}-\d{2}-\d{2}$")
        self.assertEqual(releases[:1], [version])

    def test_that_programs_ask_for_agree(self) -> None:
        [minor] = found(ROOT / "CMakeLists.txt", r"^project\(palpate VERSION (\d+\.\d+)")
        files = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
        files += [*(ROOT / "examples").rglob("CMakeLists.txt"), *(ROOT / "tests").rglob("CMakeLists.txt")]
        asked = [(file.name, asked) for file in files for asked in found(file, r"find_package\(palpate ([\d.]+)")]
        self.assertGreater(len(asked), 3)
        self.assertEqual({version for _, version in asked}, {minor}, asked)


if __name__ == "__main__":
    unittest.main()
