"""`palpate batch` is killed, meets a full disk, other processes and other inputs."""

import ctypes
import os
import resource
import shutil
import signal
import time

from batch_folder import Batch, batch, batch_of, name, parse
from command import Ended, Running


class Resumption(Batch):
    def times(self, results: str) -> dict[str, int]:
        """When each chunk was written."""
        chunks = (self.folder / results / "chunks").iterdir()
        return {chunk.name: chunk.stat().st_mtime_ns for chunk in chunks}

    def test_after_kills_ends_in_the_same_bytes(self) -> None:
        chunks = self.folder / "s/chunks"
        for kills in range(6):
            with Running(self.folder, *batch("s", "--threads", str(1 + kills % 3))) as program:
                program.reaches(lambda: len([*chunks.glob("*")]) >= kills - 1)
        self.palpate(*batch("s"), status=3)
        self.assertEqual(self.merged("s"), self.expected)

    def test_does_nothing_twice(self) -> None:
        before, written = self.content("r"), self.times("r")
        self.assert_named(self.palpate(*batch("r"), status=3).stdout, "11 done before", "1 failed")
        self.assertTrue((self.content("r"), self.times("r")) == (before, written))
        (self.folder / "r/chunks/000002.ndjson").unlink()
        self.assertIn("8 done before, 3 now", self.palpate(*batch("r"), status=3).stdout)
        self.assertEqual(self.merged("r"), self.expected)
        changed = {chunk for chunk, when in self.times("r").items() if when != written[chunk]}
        self.assertEqual(changed, {"000002.ndjson"})

    def test_keeps_finished_chunks_where_the_disk_is_full(self) -> None:
        # The task file is smaller than a chunk of three records.
        task = (self.folder / "r/task.ndjson").stat().st_size
        self.assertLess(task, (self.folder / "r/chunks/000002.ndjson").stat().st_size)

        def limit() -> None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (task, task))

        self.assert_failed(1, batch("s"), "s/chunks/00000", "write", preexec_fn=limit)
        self.assertFalse([file for file in self.content("s") if ".part" in file])
        self.palpate(*batch("s"), status=3)
        self.assertEqual(self.merged("s"), self.expected)

    # Two threads: the one that cannot write its first chunk ends the other.
    def test_ends_soon_where_a_file_cannot_be_written(self) -> None:
        many = batch_of(["A.h5"], "s", "--each-frame", "--chunk", "1", "--threads", "2")
        self.palpate(*many, "--shard", "191/192")
        (self.folder / "s/runs/000000.json").mkdir()
        self.assert_failed(2, many, "s/runs/000000.json")
        self.assertLess(len([*(self.folder / "s/chunks").iterdir()]), 191)

    def test_by_many_processes_writes_the_bytes_of_one(self) -> None:
        def without_runs(results: str) -> dict[str, bytes]:
            content = self.content(results).items()
            return {file: text for file, text in content if not file.startswith("runs")}

        for other in ("0/1", "0/2", "1/2"):
            # They meet at the task file.
            shards = ("0/1", other, "0/1", other)
            programs = [Running(self.folder, *batch("s", "--shard", shard)) for shard in shards]
            for program in programs:
                with program:
                    self.assertIn(program.finish()[0], (0, 3))
            self.assertTrue(without_runs("s") == without_runs("r"), other)
            shutil.rmtree(self.folder / "s")

    def test_reads_a_folder_that_cannot_be_written(self) -> None:
        def drop_override() -> None:
            ctypes.CDLL(None).prctl(24, 1)  # PR_CAPBSET_DROP, CAP_DAC_OVERRIDE

        def read_only(*arguments: str, status: int = 0) -> Ended:
            folders = [self.folder / folder for folder in ("r/chunks", "r/runs", "r")]
            for folder in folders:
                folder.chmod(0o500)
            try:  # obeying permissions, even where the test runs as root
                return self.palpate(*arguments, status=status, preexec_fn=drop_override)
            finally:
                for folder in folders:
                    folder.chmod(0o700)

        self.assertEqual(read_only("merge", "r").stdout, self.expected)
        self.assertIn("11 done before", read_only(*batch("r"), status=3).stdout)
        (self.folder / "r/chunks/000002.ndjson").unlink()
        self.assertIn("cannot create a file in folder", read_only(*batch("r"), status=2).stderr)

    def test_with_other_flags_inputs_or_maps_is_refused(self) -> None:
        gamma = ("--gamma is '0.2', but was not given for its results", "another folder")
        self.assert_refused(batch("r", "--gamma", "0.2"), "r:", *gamma)
        self.assert_refused(batch_of(["u"], "r", "--chunk", "4"), "--chunk is '4', but was '3' for its results")
        for more in (11, 12):
            shutil.copy(self.folder / name(0), self.folder / name(more))
        self.assert_refused(batch("r"), "r:", "13 inputs", "11")
        for more in (11, 12):
            (self.folder / name(more)).unlink()
        # Seconds are too coarse for a file that is made again at once.
        changed = self.folder / name(7)
        when = changed.stat().st_mtime_ns
        os.utime(changed, ns=(when, when + 1000))
        self.assert_refused(batch("r"), "r:", f"{name(7)} has changed", "another folder")
        changed.write_bytes(changed.read_bytes() + b"\0")
        os.utime(changed, ns=(when, when))
        self.assert_refused(batch("r"), f"{name(7)} has changed")
        shutil.copy(self.folder / "maps/A.map.h5", self.folder / "maps/E.map.h5")
        self.assert_refused(batch("r"), "r:", "maps/E.map.h5 has changed", "another folder")
        self.put("u/list.csv", "path,frames\n00.h5,0:2\n")
        self.palpate(*batch_of(["u/list.csv"], "s"))
        self.put("u/list.csv", "path,frames\n00.h5,0:3\n")
        self.assert_refused(batch_of(["u/list.csv"], "s"), "of u/00.h5 with other frames or label")

    def test_by_shards_counts_the_unknowns_of_its_own(self) -> None:
        # A chunk of another shard may hold some of a recording's touches.
        more = ("--each-frame", "--chunk", "3", "--shard", "0/2")
        said = self.palpate(*batch_of([name(1), name(3)], "t", *more)).stdout
        self.assertIn("6 unknowns of shard 0/2, 6 now", said)

    def test_that_is_merged_in_part_says_what_is_missing(self) -> None:
        for chunk in (1, 3):
            (self.folder / f"r/chunks/{chunk:06}.ndjson").unlink()
        part = self.palpate("merge", "r", "--partial")
        self.assertEqual(len(parse(part.stdout)), 6)
        self.assertIn("missing: 3 to 5, 9 to 10", part.stderr)
        self.palpate(*batch_of(["u"], "s", "--chunk", "1", "--shard", "1/2"))
        self.assert_refused(["merge", "s"], "(unknowns 0 to 0, 2 to 2, 4 to 4, and more)")

    # Younger ones may be another process's.
    def test_removes_after_a_day_what_a_killed_process_has_left(self) -> None:
        now = time.time()
        for file, hours in (("chunks/.palpate-1-0.part", 25), ("runs/.palpate-1-1.part", 25),
                            (".palpate-1-2.part", 25), ("chunks/.palpate-1-3.part", 23)):  # fmt: skip
            self.put(f"s/{file}", "{")
            os.utime(self.folder / "s" / file, (now, now - 3600 * hours))
        self.palpate(*batch("s"), status=3)  # the folder is its own
        left = [file for file in self.content("s") if ".part" in file]
        self.assertEqual(left, ["chunks/.palpate-1-3.part"])

    def test_takes_any_bytes_for_a_path(self) -> None:
        os.rename(self.folder / name(0), os.fsencode(self.folder) + b"/u/\xc3\xbc \x80\xff.h5")
        self.palpate(*batch("s"), status=3)
        self.assertIn("11 done before", self.palpate(*batch("s"), status=3).stdout)
