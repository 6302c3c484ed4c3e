#!/usr/bin/env python3
"""The list of sources to lint holds what changed within four hours of the newest commit, and what
includes it; what is compiled of them is found. The argument is the program that prints the list."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(sys.argv.pop())
HOURS_S = 4 * 3600


class ChangedSources(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.git("init", "-q")
        self.write("host/model/pose.hpp", "")
        self.write("host/io/file.hpp", '#include "model/pose.hpp"\n')
        self.write("host/io/file.cpp", '#include "io/file.hpp"\n')
        self.write("host/io/other.cpp", "#include <vector>\n")
        self.write("driver/board.cpp", '#include "palpate/touch.hpp"\n')
        self.write("host/include/palpate/touch.hpp", "")
        self.write("tests/file_test.cpp", '#include "io/file.hpp"\n')
        self.write(".clang-tidy", "Checks: bugprone-*\n")

    def write(self, name: str, text: str) -> None:
        file = self.root / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def git(self, *arguments: str, at_s: int = 0) -> None:
        stamp = f"{1_700_000_000 + at_s} +0000"
        who = {"GIT_AUTHOR_NAME": "a", "GIT_AUTHOR_EMAIL": "a@b"}
        who |= {"GIT_COMMITTER_NAME": "a", "GIT_COMMITTER_EMAIL": "a@b"}
        dates = {"GIT_AUTHOR_DATE": stamp, "GIT_COMMITTER_DATE": stamp}
        environment = {**os.environ, **who, **dates}
        subprocess.run(["git", *arguments], cwd=self.root, env=environment, check=True)

    def commit(self, at_s: int) -> None:
        self.git("add", "-A")
        self.git("commit", "-q", "-m", "a step", at_s=at_s)

    def listed(self, *flags: str) -> list[str]:
        command = [PROGRAM, *flags]
        run = subprocess.run(command, cwd=self.root, check=True, capture_output=True, text=True)
        return run.stdout.split()

    def test_a_header_brings_what_includes_it_through_others(self) -> None:
        self.commit(0)
        self.write("host/model/pose.hpp", "// changed\n")
        self.commit(2 * HOURS_S)
        self.assertEqual(self.listed(), ["host/io/file.cpp"])
        self.assertEqual(self.listed("--directly"), [])
        self.write("host/io/file.hpp", '#include "model/pose.hpp"\n// changed, too\n')
        self.assertEqual(self.listed("--directly"), ["host/io/file.cpp"])

    def test_a_public_header_brings_the_driver(self) -> None:
        self.commit(0)
        self.write("host/include/palpate/touch.hpp", "// changed\n")
        self.commit(2 * HOURS_S)
        self.assertEqual(self.listed(), ["driver/board.cpp"])

    def test_commits_of_four_hours_count_together(self) -> None:
        self.commit(0)
        self.write("host/io/other.cpp", "// changed\n")
        self.commit(2 * HOURS_S)
        self.write("README.md", "changed")
        self.commit(2 * HOURS_S + 3600)
        self.assertEqual(self.listed(), ["host/io/other.cpp"])

    def test_files_that_git_does_not_know_yet_count(self) -> None:
        self.commit(0)
        self.write("README.md", "changed")
        self.commit(2 * HOURS_S)
        self.assertEqual(self.listed(), [])
        self.write("host/io/new.cpp", '#include "io/file.hpp"\n')
        self.assertEqual(self.listed(), ["host/io/new.cpp"])

    def test_a_file_that_went_is_not_listed(self) -> None:
        self.commit(0)
        (self.root / "host/io/other.cpp").unlink()
        self.commit(2 * HOURS_S)
        self.assertEqual(self.listed(), [])

    def test_all_are_listed_where_the_rules_changed_or_all_is_young(self) -> None:
        everything = ["driver/board.cpp", "host/io/file.cpp", "host/io/other.cpp"]
        self.commit(0)
        self.assertEqual(self.listed(), everything)
        self.write(".clang-tidy", "Checks: performance-*\n")
        self.commit(2 * HOURS_S)
        self.assertEqual(self.listed(), everything)


class UnitsOf(unittest.TestCase):
    def test_sources_are_found_where_they_are_joined_or_alone(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder).resolve()
            units = [root / name for name in ("joined_0.cxx", "joined_1.cxx", "alone.cpp")]
            units[0].write_text(f'#include "{root}/a.cpp"\n#include "{root}/b.cpp"\n')
            units[1].write_text(f'#include "{root}/c.cpp"\n')
            units[2].write_text('#include "a.cpp"\n')
            commands = [{"file": str(unit)} for unit in units]
            (root / "compile_commands.json").write_text(json.dumps(commands))

            def asked(*names: str) -> subprocess.CompletedProcess[str]:
                return subprocess.run(
                    [PROGRAM.parent / "units_of", root], cwd=root, text=True, capture_output=True,
                    input="".join(name + "\n" for name in names),
                )  # fmt: skip

            self.assertEqual(asked("b.cpp").stdout.split(), [str(units[0])])
            both = asked("c.cpp", "alone.cpp")
            self.assertEqual(both.stdout.split(), [str(units[2]), str(units[1])])
            self.assertEqual((both.returncode, both.stderr), (0, ""))
            self.assertEqual(asked().stdout, "")
            lost = asked("b.cpp", "lost.cpp")
            self.assertEqual(lost.returncode, 1)
            self.assertIn("lost.cpp: compiled nowhere", lost.stderr)


if __name__ == "__main__":
    unittest.main()
