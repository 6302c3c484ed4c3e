"""The records of `palpate batch`, of which recordings they are, and who reads them."""

import json
import os
import shutil
from typing import Any

from batch_folder import BROKEN, RECORDINGS, Batch, batch, batch_of, name, parse


class Records(Batch):
    def test_are_those_of_recognize_without_time_and_device(self) -> None:
        batched = parse(self.expected)
        names = [name(i) for i in range(RECORDINGS)]
        self.assertEqual([record["recording"] for record in batched], names)
        self.assertIn(names[BROKEN], batched.pop(BROKEN)["error"])
        del names[BROKEN]
        alone = self.recognized(*names, "--maps", "maps", "--bins", "10x10x10", "--filter", "bounded")
        self.assertEqual(batched, alone)

    def test_have_times_and_devices_beside_them(self) -> None:
        told = json.loads((self.folder / "r/runs/000001.json").read_text())
        self.assertEqual(len(told.pop("seconds")), 3)
        del told["host"]
        self.assertEqual(told, {"first": 3, "unknowns": 3, "failed": 1, "device": "none"})
        self.palpate(*batch_of([name(0)], "h", "--filter", "histogram"))
        used = json.loads((self.folder / "h/runs/000000.json").read_text())["device"]
        self.assertIn(used, self.done("devices"))

    def test_by_bounds_need_no_device(self) -> None:
        none: dict[str, Any] = {"env": os.environ | {"PALPATE_VULKAN_LIBRARY": "/nonexistent/libvulkan.so.1"}}
        self.palpate(*batch("s"), status=3, **none)
        self.assertEqual(self.merged("s"), self.expected)
        self.palpate("batch", name(0), "-o", "e", "--maps", "maps", "--filter", "bounded", "--bins", "auto", **none)
        self.assert_failed(1, batch_of([name(0)], "d", "--filter", "histogram"), "install libvulkan1", **none)

    def test_of_an_object_named_error_are_no_failures(self) -> None:
        flags = ("--sensor-model", "none", "--label", "error")
        self.palpate("map", "A.h5", "-o", "maps/error.map.h5", *flags)
        for _ in range(2):
            self.assertIn("1 failed", self.palpate(*batch("s"), status=3).stdout)
        joined = self.palpate("merge", "s")
        of_error = [record for record in parse(joined.stdout) if "error" in record.get("identity", {})]
        self.assertEqual(len(of_error), RECORDINGS - 1)
        self.assertIn("11 of 11 unknowns, 1 failed", joined.stderr)

    def test_that_are_damaged_are_refused(self) -> None:
        chunk = self.folder / "r/chunks/000002.ndjson"
        first = chunk.read_text().splitlines(keepends=True)[0]
        for line in ('{"recording": "u/07.h5", "touc\n', "\n", "7\n"):
            chunk.write_text(first + line + first)
            named = ("000002.ndjson", "line 2", "no record", "remove it")
            self.assert_failed(2, ["merge", "r", "-o", "all"], *named)
        chunk.write_text(first + first)
        self.assert_failed(2, batch("r"), "000002.ndjson", "2 records instead of 3", "remove it")

    def test_do_not_depend_on_threads_or_the_order_of_inputs(self) -> None:
        self.palpate(*batch("s", "--threads", "1"), status=3)
        self.assertEqual(self.merged("s"), self.expected)
        inputs = [name(3), name(1), name(2)]
        for filter in ("histogram", "particles", "auto"):
            more = ("--filter", filter, "--chunk", "1", "--threads", "5")
            self.palpate(*batch_of(inputs, "a" + filter, *more))
            self.palpate(*batch_of(inputs[::-1], "b" + filter, *more))
            a, b = (parse(self.merged(results + filter)) for results in "ab")
            self.assertEqual(a, b[::-1], filter)

    def test_may_be_of_every_touch(self) -> None:
        self.import_presses(name(2), "--array", "6:6:1.9", "--pressure-unit", "raw")
        self.palpate(*batch("s", "--each-frame", "--frames", "1:4"), status=3)
        records = parse(self.merged("s"))
        self.assertEqual(len(records), 10 * 3 + 1, "a broken recording is one unknown")
        self.assertEqual([record["frame"] for record in records[:9]], 3 * [1, 2, 3])
        self.assertEqual([record["recording"] for record in records[2:4]], [name(0), name(1)])
        # Each touch has the error.
        self.assertTrue(all("pressure_unit" in record["error"] for record in records[6:9]))

    def test_of_frames_are_errors(self) -> None:
        self.done("record", "--sensor", "simulate:A,speed=max", "--seconds", "1", "-o", name(2))
        self.palpate(*batch("s"), status=3)
        records = parse(self.merged("s"))
        self.assertIn("palpate touches", records[2]["error"])
        self.assertIn("best", records[3])

    def test_share_the_region_of_all_recordings(self) -> None:
        # The second array reaches further than the first.
        self.import_presses("wide.h5", "--array", "6:6:2.9")
        flags = [name(0), "wide.h5", "--maps", "maps", "--filter", "bounded"]
        self.palpate("batch", "-o", "s", "--chunk", "1", *flags)
        self.assertEqual(parse(self.merged("s")), self.recognized(*flags))

    def test_of_a_manifest_are_of_its_frames_and_labels(self) -> None:
        self.put("u/list.csv", "path,frames,label\n00.h5,1:3,E\n01.h5,,\n00.h5,0:1,A\n")
        self.palpate(*batch_of(["u/list.csv"], "s"))
        labelled, whole, own = parse(self.merged("s"))
        self.assertEqual(labelled["recording"], name(0), "paths are relative to the manifest")
        self.assertEqual([record["touches"] for record in (labelled, whole, own)], [2, 5, 1])
        self.assertEqual(labelled["truth"]["object"], "E")
        self.assertIn("T_robot_object", own["truth"], "the label is the recording's own")

    def test_of_wrong_inputs_are_refused(self) -> None:
        for text, *named in (
            ("file,label\na.h5,A\n", "list.csv", "column 'file'", "path"),
            ("label\nA\n", "list.csv", "column 'path' is missing"),
            ("path,frames\na.h5,5:2\n", "list.csv:2", "column 'frames'", "5:2"),
            ("path,label\n,A\n", "list.csv:2", "column 'path' is empty"),
            ("path\n", "list.csv", "names no recording"),
        ):
            self.put("list.csv", text)
            self.assert_refused(batch_of(["list.csv"], "s"), *named)
        (self.folder / "empty").mkdir()
        self.assert_refused(batch_of(["empty"], "s"), "empty", "without recordings")
        self.assert_refused(batch_of(["u/*.h6"], "s"), "u/*.h6", "no file matches")
        self.assert_refused(batch("s", "--budget-ms", "5"), "--budget-ms 5", "clock")
        for wrong in ("2/2", "1", "a/2", "0/0", "-1/2", "0/1000001", "/"):
            self.assert_refused(batch("s", f"--shard={wrong}"), "--shard", wrong, "I/N")

    def test_of_patterns_and_folders_are_in_the_order_of_names(self) -> None:
        shutil.copy(self.folder / "maps/A.map.h5", self.folder / "u/Z.map.h5")
        self.palpate(*batch_of(["u/??.h5"], "s", "--chunk", "3"), status=3)
        self.assertEqual(self.merged("s"), self.expected)
        self.palpate(*batch("r"), status=3)  # a map is no recording

    def test_are_evaluated_from_the_folder_and_the_merged_file(self) -> None:
        folder = self.palpate("evaluate", "r", "--json", "-")
        self.assertIn("1 unknown could not be recognised", folder.stderr)
        self.assertEqual(json.loads(folder.stdout)["records"], RECORDINGS - 1)
        self.palpate("merge", "r", "-o", "all.ndjson")
        self.assertEqual(self.palpate("evaluate", "all.ndjson", "--json", "-").stdout, folder.stdout)
        (self.folder / "r/chunks/000001.ndjson").unlink()
        self.assertIn("1 of 4 chunks are missing", self.palpate("evaluate", "r").stderr)
