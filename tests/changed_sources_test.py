#!/usr/bin/env python3
"""The list of sources to lint holds what changed since the branch left main, and what includes it; what
is compiled of them is found. The argument is the program that prints the list."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(sys.argv.pop())


class ChangedSources(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.git("init", "-q", "-b", "main")
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

    def git(self, *arguments: str) -> None:
        who = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", *who, *arguments], cwd=self.root, check=True)

    def commit(self, times: int = 1) -> None:
        self.git("add", "-A")
        for _ in range(times):
            self.git("commit", "-q", "--allow-empty", "-m", "a step")

    def listed(self, *flags: str) -> list[str]:
        command = [PROGRAM, *flags]
        run = subprocess.run(command, cwd=self.root, check=True, capture_output=True, text=True)
        return run.stdout.split()

    def test_a_header_brings_what_includes_it_through_others(self) -> None:
        self.commit(10)
        self.write("host/model/pose.hpp", "// changed\n")
        self.commit()
        self.assertEqual(self.listed(), ["host/io/file.cpp"])
        self.assertEqual(self.listed("--directly"), [])
        self.write("host/include/palpate/touch.hpp", "// changed, not committed\n")
        self.assertEqual(self.listed(), ["driver/board.cpp", "host/io/file.cpp"])

    def test_a_branch_counts_from_main_and_main_by_its_last_ten_commits(self) -> None:
        self.commit(10)
        self.write("host/io/other.cpp", "// changed\n")
        self.commit()
        self.git("checkout", "-q", "-b", "topic")
        self.write("driver/board.cpp", "// changed\n")
        self.commit(12)
        self.assertEqual(self.listed(), ["driver/board.cpp"])
        self.git("checkout", "-q", "main")
        self.assertEqual(self.listed(), ["host/io/other.cpp"])
        self.commit(10)
        self.assertEqual(self.listed(), [])

    def test_all_are_listed_where_the_rules_changed_or_commits_are_few(self) -> None:
        everything = ["driver/board.cpp", "host/io/file.cpp", "host/io/other.cpp"]
        self.commit(10)
        self.assertEqual(self.listed(), everything)
        self.commit()
        # A file that git does not know counts, and one that went does not.
        self.write("host/io/new.cpp", '#include "io/file.hpp"\n')
        (self.root / "host/io/other.cpp").unlink()
        self.assertEqual(self.listed(), ["host/io/new.cpp"])
        self.write(".clang-tidy", "Checks: performance-*\n")
        self.assertEqual(self.listed(), ["driver/board.cpp", "host/io/file.cpp", "host/io/new.cpp"])


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
