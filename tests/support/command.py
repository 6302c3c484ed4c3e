"""The command `palpate`, run as its users do."""

import fcntl
import json
import os
import pathlib
import pty
import select
import shutil
import signal
import subprocess
import tempfile
import termios
import time
import unittest
from collections.abc import Callable
from typing import Any

COMMAND = os.environ["PALPATE_COMMAND"]
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored by what a shell runs in the background


Ended = subprocess.CompletedProcess[str]


def run(folder: pathlib.Path, *arguments: str, **more: Any) -> Ended:
    """Runs the command in a folder, on which its relative paths depend. A hang ends after two minutes."""
    ended = subprocess.run(
        [COMMAND, *arguments], cwd=folder, capture_output=True, text=True, errors="surrogateescape",
        timeout=120, **more,
    )  # fmt: skip
    # Where the machine is busy, `live` sees a sensor of any speed at its tare, and says so.
    ended.stderr = ended.stderr.removeprefix("palpate: taring: do not touch the array\n")
    return ended


class Running:
    """The command while it runs. What it prints and says comes in one text."""

    def __init__(
        self, folder: pathlib.Path, *arguments: str, stdin: int | None = None, terminal: bool = False
    ) -> None:
        # Where the machine has no pseudo-terminal to give, this fails with the reason.
        self._reader, end = pty.openpty() if terminal else os.pipe()
        self._text = ""
        self.program = subprocess.Popen(
            [COMMAND, *arguments], cwd=folder, stdin=end if terminal else stdin, stdout=end, stderr=end,
            start_new_session=terminal,
            preexec_fn=(lambda: fcntl.ioctl(1, termios.TIOCSCTTY, 0)) if terminal else None,
        )  # fmt: skip
        os.close(end)

    def __enter__(self) -> "Running":
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()
        os.close(self._reader)

    def _read_more(self) -> bool:
        try:
            piece = os.read(self._reader, 4096)
        except OSError:  # a terminal ends so when the program is gone
            return False
        self._text += piece.decode()
        return bool(piece)

    def shows(self, text: str) -> bool:
        """Waits until the program has shown this; false if it ends before."""
        while text not in self._text:
            if not self._read_more():
                return False
        return True

    def type(self, keys: str) -> None:
        """On its terminal."""
        os.write(self._reader, keys.encode())

    def reaches(self, state: Callable[[], bool]) -> bool:
        """Waits until this is true; false if the program ends before."""
        while not state():
            if self.program.poll() is not None:
                return state()
            time.sleep(0.005)
        return True

    def finish(self) -> tuple[int, str]:
        """Waits for the end: the status, or minus the signal that ended it, and all that was shown."""
        while self._read_more():
            pass
        return self.program.wait(120), self._text

    def kill(self) -> None:
        """Kills the program, and waits for the end of the process that it watches, which dies with it."""
        if self.program.poll() is not None:
            return
        children = pathlib.Path(f"/proc/{self.program.pid}/task/{self.program.pid}/children")
        ends = [os.pidfd_open(int(child)) for child in children.read_text().split()]
        self.program.kill()
        self.program.wait()
        for end in ends:
            select.select([end], [], [])
            os.close(end)


class CommandTest(unittest.TestCase):
    """Runs the command in a folder of the test's own."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def palpate(self, *arguments: str, status: int = 0, **more: Any) -> Ended:
        ended = run(self.folder, *arguments, **more)
        self.assertEqual(ended.returncode, status, ended.stderr)
        return ended

    def done(self, *arguments: str) -> str:
        """Standard output of a run that has to go well and say nothing else."""
        ended = self.palpate(*arguments)
        self.assertEqual(ended.stderr, "")
        return ended.stdout

    def records(self, *arguments: str) -> list[dict[str, Any]]:
        """The records of `recognize` with these arguments."""
        records: list[dict[str, Any]] = json.loads(self.done("recognize", *arguments, "--json", "-"))
        return records

    def content(self, folder: str = ".") -> dict[str, bytes]:
        """Every file below the folder."""
        root = self.folder / folder
        files = [path for path in root.rglob("*") if path.is_file()]
        return {os.fsdecode(path.relative_to(root)): path.read_bytes() for path in files}

    def assert_named(self, text: str, *named: str) -> None:
        for part in named:
            self.assertIn(part, text)

    def assert_failed(self, status: int, arguments: list[str], *named: str, **more: Any) -> None:
        """One line on standard error that names these."""
        ended = self.palpate(*arguments, status=status, **more)
        self.assertEqual((ended.stderr.count("\n"), ended.stderr[-1]), (1, "\n"), ended.stderr)
        self.assert_named(ended.stderr, *named)
        self.assertEqual(ended.stdout, "")

    def assert_refused(self, arguments: list[str], *named: str) -> None:
        """Status 2, one line on standard error, and the folder as it was before."""
        before = self.content()
        self.assert_failed(2, arguments, *named)
        self.assertTrue(self.content() == before, f"{arguments} have changed the folder")


class PreparedTest(CommandTest):
    """The files of prepare() are made once for all tests of a class, and each has copies of its own."""

    prepared: pathlib.Path

    @classmethod
    def setUpClass(cls) -> None:
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.prepared = pathlib.Path(folder.name)
        cls.prepare()

    @classmethod
    def prepare(cls) -> None:
        raise NotImplementedError

    @classmethod
    def make(cls, *arguments: str) -> None:
        run(cls.prepared, *arguments, check=True)

    @classmethod
    def learn(cls, letters: str) -> None:
        """Maps of these letters in maps/, and what they are built of."""
        for letter in letters:
            cls.make("simulate", letter, "-o", f"{letter}.h5")
        recordings = [f"{letter}.h5" for letter in letters]
        cls.make("map", *recordings, "-o", "maps/", "--cell-mm", "1", "--sensor-model", "none")

    def setUp(self) -> None:
        super().setUp()
        shutil.copytree(self.prepared, self.folder, dirs_exist_ok=True)  # with the times of the files
