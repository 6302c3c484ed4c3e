"""Which files `palpate batch` and `merge` write over, and what a task file from elsewhere may say."""

import json
import os
import re
import shutil

from batch_folder import Batch, batch


class Files(Batch):
    def test_of_others_are_left_alone(self) -> None:
        for file in ("chunks/000000.ndjson", "runs/000001.json", "notes.txt"):
            self.put(f"s/{file}", "of somebody else\n")
            self.assert_refused(batch("s"), "s:", f"holds '{file}'", "empty or a new")
            shutil.rmtree(self.folder / "s")
        for text in ("", "[]\n", '{"format":"palpate.recording"}\n'):
            self.put("r/task.ndjson", text)
            self.assert_refused(batch("r"), "r/task.ndjson", "is no task of palpate batch")

    def test_without_a_number_are_no_chunks(self) -> None:
        for file in ("notes.ndjson", "1.ndjson", "000001.ndjson.old", "000001"):
            self.put(f"r/chunks/{file}", "{}\n")
        self.assertEqual(self.merged("r"), self.expected)

    def test_are_written_through_no_link(self) -> None:
        links = [self.folder / "r" / file for file in ("runs/000001.json", "chunks/000001.ndjson")]
        for link in links:
            link.unlink()
            link.symlink_to(self.folder / "outside")
        self.palpate(*batch("r"), status=3)
        self.assertFalse((self.folder / "outside").exists() or any(link.is_symlink() for link in links))
        self.assertEqual(self.merged("r"), self.expected)
        for folder in ("chunks", "runs"):
            moved = (self.folder / "r" / folder).rename(self.folder / "moved")
            (self.folder / "r" / folder).symlink_to(moved)
            self.assert_refused(batch("r"), f"r/{folder}", "is a link")
            (self.folder / "r" / folder).unlink()
            moved.rename(self.folder / "r" / folder)

    def test_that_merge_and_evaluate_read_are_kept(self) -> None:
        (self.folder / "link").symlink_to("r/chunks/000001.ndjson")
        os.link(self.folder / "r/task.ndjson", self.folder / "hard")
        for file in ("r/task.ndjson", "r/chunks/000000.ndjson", "./r/../link", "hard"):
            self.assert_refused(["merge", "r", "-o", file], f"-o {file}", "RESULTS reads")
        self.assert_refused(["evaluate", "r", "--json", "r/task.ndjson"], "--json", "RESULTS reads")
        # evaluate would read it beside the chunks.
        self.assert_refused(["merge", "r", "-o", "r/chunks/all.ndjson"], "-o", "among the chunks")
        (self.folder / "r/chunks/000002.ndjson").unlink()
        into = ["merge", "r", "--partial", "-o"]
        self.assert_refused([*into, "r/chunks/000002.ndjson"], "-o", "among the chunks")
        self.palpate(*into, "r/all.ndjson")

    def test_of_a_damaged_task_or_another_version_are_refused(self) -> None:
        task = (self.folder / "r/task.ndjson").read_text()
        options = '"options":{'
        for old, new, words in (
            ('"version":4', '"version":3', "of an older palpate; remove the folder"),
            ('"version":4', '"version":5', "use a newer palpate"),
            (options, options + '"speed":"1",', "is damaged"),
            (options, options + '"x-mm":"1",', "is damaged"),
            (options, options + '"trace":"yes",', "is damaged"),
            (task.splitlines()[-1] + "\n", "", "is cut off"),
        ):
            self.put("r/task.ndjson", task.replace(old, new))
            self.assert_refused(["merge", "r"], "r/task.ndjson", words)

    # As many chunks as touches: no command may look for each of them.
    def test_of_very_many_chunks_take_no_time(self) -> None:
        def put_task(touches: str, chunk: int = 1) -> None:
            head = {"format": "palpate.batch", "version": 4, "program": "0", "inputs": 1, "unknowns": 1,
                    "chunk_unknowns": chunk, "options": {"each-frame": "true"}, "maps": [], "files": {},
                    "pressure_unit": "kPa", "unit_from": "", "reach_mm": 1, "bins": [1, 1, 1]}  # fmt: skip
            entry = f'{{"path":"u.h5","survey":[{touches},1,"kPa",""]}}'
            self.put("s/task.ndjson", f"{json.dumps(head)}\n{entry}\n")

        put_task("1000000000")
        self.put("s/chunks/000007.ndjson", '{"error":"u.h5: no such file"}\n')
        missing = "(unknowns 0 to 6, 8 to 999999999)"
        self.assert_refused(["merge", "s"], "999999999 of 1000000000 chunks are missing", missing)
        self.assertIn("1 of 1000000000 unknowns", self.palpate("merge", "s", "--partial").stderr)
        for touches in ("1000000001", "1000000000000", "18446744073709551615"):
            put_task(touches)
            self.assert_refused(["merge", "s"], "s/task.ndjson", "more than 1000000000 unknowns", "u.h5")
        for touches in ("1e12", "-1", "1e300", '"1"', "null", "99999999999999999999"):
            put_task(touches)
            self.assert_refused(["merge", "s"], "s/task.ndjson", "is damaged")
        put_task("9", chunk=2**64 - 1)
        self.assert_refused(["merge", "s"], "1 of 1 chunks are missing", "0 to 8")

        task = (self.folder / "r/task.ndjson").read_text()
        task = task.replace('"options":{', '"options":{"each-frame":"true",')
        self.put("r/task.ndjson", re.sub(r"\}\n$", ',"survey":[900000000,1,"kPa",""]}\n', task))
        self.assertIn("300000000 of 300000004 chunks", self.palpate("evaluate", "r").stderr)
