"""What `palpate recognize` writes and prints. What records hold, and which options they follow, is tested
where it is made: here the command has to pass it on."""

import json
import os
import signal
from typing import Any

from command import Ended, PreparedTest, Running

ONE_TOUCH = "one touch cannot tell"


class Recognize(PreparedTest):
    """The A of u.h5 and the I of i.h5, among maps of both."""

    @classmethod
    def prepare(cls) -> None:
        cls.learn("AI")
        for letter, file, touches in (("A", "u", "6"), ("I", "i", "6"), ("O", "o", "48")):
            pose = ("--touches", touches, "--object-pose=2,-3,57")
            cls.make("simulate", letter, "-o", f"{file}.h5", *pose)

    def u(self, *flags: str) -> dict[str, Any]:
        [record] = self.records("u.h5", "--maps", "maps", *flags)
        return record

    def printed(self, *arguments: str) -> Ended:
        return self.palpate("recognize", *arguments, "--maps", "maps")

    def test_has_the_documented_keys_in_records_and_traces(self) -> None:
        record = self.u("--trace")
        of_step = {
            "T_robot_object", "best", "bins_evaluated", "blocks_bounded", "decision", "dropped_mass",
            "error_mm", "fit", "identity", "identity_bounds", "mode", "mode_certain", "modes", "none",
            "refined", "refined_error_mm", "right", "touch_fit",
        }  # fmt: skip
        # By bounds, as the automatic bins are many.
        of_record = of_step | {"device", "recording", "seconds", "touches", "trace", "truth"}
        self.assertEqual({*record}, of_record)
        self.assertEqual((record["recording"], record["touches"], record["device"]), ("u.h5", 6, "none"))
        self.assertEqual([*record["identity"]], ["A", "I", "(none)"])
        self.assertEqual(record["none"], record["identity"]["(none)"])
        self.assertEqual(
            {*record["mode"]}, {"log_likelihood", "map", "object", "theta_rad", "x_mm", "y_mm"}
        )
        self.assertEqual(record["mode"]["map"], "maps/A.map.h5")
        of_pose = {"T_robot_object", "covariance", "sd", "share", "theta_rad", "x_mm", "y_mm"}
        self.assertEqual({*record["refined"]}, of_pose)
        self.assertEqual((record["truth"]["object"], record["right"]), ("A", True))
        self.assertLess(record["refined_error_mm"], 1)
        self.assertGreater(record["seconds"], 0)
        for i, step in enumerate(record["trace"], start=1):
            self.assertEqual({*step} - {"warnings", "symmetry"}, of_step)
            self.assertEqual(len(step["touch_fit"]), i)
        self.assertEqual(i, 6)
        for key in of_step - {"bins_evaluated", "blocks_bounded"}:
            self.assertEqual(step[key], record[key], key)
        three = self.u("--touches=3")
        self.assertNotIn("trace", three)
        for key in ("best", "T_robot_object", "right", "error_mm"):
            self.assertEqual(three[key], record["trace"][2][key], key)

    def test_names_the_device_that_was_used(self) -> None:
        named = self.u("--bins=5x5x4", "--filter=histogram", "--device=0")
        self.assertIn(named["device"], self.done("devices"))
        self.assertNotIn("dropped_mass", named)
        self.assertEqual(self.u("--bins=5x5x4", "--device=0")["device"], "none")

    def test_gives_the_same_records_again_in_a_file_or_printed(self) -> None:
        both = ("i.h5", "u.h5", "--maps", "maps", "--none=0")
        printed = self.records(*both)
        text = self.done("recognize", *both, "--json", "r.json")
        self.assertIn("2 of 2 right", text)
        stored = json.loads((self.folder / "r.json").read_text())
        for record in [*stored, *printed]:
            del record["seconds"]
        self.assertEqual(stored, printed)
        told = [(each["recording"], each["best"]) for each in stored]
        self.assertEqual(told, [("i.h5", "I"), ("u.h5", "A")])

    def test_prints_the_tables_of_its_records(self) -> None:
        record = self.u()
        text = self.printed("u.h5", "--trace").stdout
        trace, table = text.split("\nu.h5: ", 1)
        self.assertTrue(trace.startswith("u.h5\n  touch  best"), trace)
        self.assert_named(trace, "dropped", "touch's z")
        decision = record["decision"]
        words = ("act: " if decision["act"] else "do not act: ") + decision["because"]
        self.assertTrue(table.startswith(words), table)
        off = f"  {record['refined_error_mm']:.2f} mm off\n"
        self.assert_named(table, "\nrecording  touches  best", off, " bins each by bounds\n")

    def test_says_how_the_filter_works_only_where_asked_to(self) -> None:
        few = ("u.h5", "--bins=25x25x16", "--filter=histogram")
        usual = self.printed(*few)
        self.assertEqual(usual.stderr, "")
        self.assertIn("2 maps, 25 x 25 x 16 bins each, on ", usual.stdout)
        self.assertNotIn("dropped", usual.stdout)
        told = self.printed(*few, "--verbose")
        self.assert_named(
            told.stderr, "device: ", " MiB", "filter: histogram in ", "lattice: x -10 to 10 mm",
            "pivot 0, 0 mm", "seconds: ",
        )  # fmt: skip
        self.assertEqual(told.stdout, usual.stdout)

    def test_says_why_the_filter_was_chosen(self) -> None:
        bins, bounded = "--bins=9x9x8", "filter: bounded, "
        for flags, *said in (
            ((bins,), bounded, "chosen by --filter auto"),
            ((bins, "--tolerance=1e-3", "--budget-ms=60000"),
             bounded, "tolerance 0.001, budget 60000 ms", "chosen by --tolerance"),
            (("--filter=particles", "--augmented"),
             "10000 particles, multinomial resampling, random particles added"),
        ):  # fmt: skip
            self.assert_named(self.printed("u.h5", *flags, "--verbose").stderr, *said)

    def test_judges_by_the_truth_that_a_recording_has(self) -> None:
        (self.folder / "p.csv").write_text("1," * 35 + "9,0,0,0\n" + "9," * 35 + "1,1,1,0\n")
        columns = ("--pose-columns", "37:39", "--pressure-columns", "1:36", "--array", "6:6:1.9")
        self.palpate("import", "p.csv", "--poses", "p.csv", *columns, "-o", "untold.h5")
        few = ("--maps", "maps", "--frames=0:2", "--bins=9x9x8")
        untold, named = self.records("untold.h5", "A.h5", *few)
        self.assertFalse({"right", "error_mm", "refined_error_mm", "truth"} & {*untold})
        self.assertEqual(named["truth"], {"object": "A"})
        [wrong] = self.records("u.h5", "--maps", "maps/I.map.h5", "--none=0")
        told = [wrong[key] for key in ("right", "error_mm", "refined_error_mm")]
        self.assertEqual(told, [False, None, None])

    def test_takes_each_frame_for_an_unknown_of_its_own(self) -> None:
        all = self.records("u.h5", "--maps", "maps", "--each-frame", "--frames=2:4")
        self.assertEqual([(each["frame"], each["touches"]) for each in all], [(2, 1), (3, 1)])
        # --none takes no recording for its number.
        few = ("--bins=20x20x72", "--maps", "maps", "--none", "u.h5")
        self.assertEqual(self.palpate("recognize", "--each-frame", *few).stdout.count(ONE_TOUCH), 1)

    def test_gives_json_of_a_file_name_that_is_not_utf8(self) -> None:
        os.rename(self.folder / "u.h5", os.fsencode(self.folder) + b"/u\xff.h5")
        [record] = self.records("u\udcff.h5", "--maps", "maps")
        self.assertEqual(record["recording"], "u\ufffd.h5")

    def test_names_pictures_after_their_unknowns_and_leaves_the_record_alone(self) -> None:
        few = ("--touches=2", "--bins=20x20x16", "--filter=bounded")
        plain = self.u(*few)
        [drawn, _] = self.records("u.h5", "i.h5", "--maps", "maps", "--png", "new/sheets", *few)
        self.assertNotIn("trace", drawn)
        for key in ("best", "T_robot_object"):
            self.assertEqual(drawn[key], plain[key])
        self.printed("u.h5", "--png=frames", "--each-frame", "--frames=4:6", "--bins=15x15x12")
        by_particles = self.u("--png=particles", "--filter=particles")
        self.assertTrue(by_particles["right"] and 1 <= by_particles["effective_sample_size"] <= 10_000)
        self.assertFalse({"refined", "touch_fit", "none", "contradicted"} & {*by_particles})
        pictures = {file: text for file, text in self.content().items() if file.endswith(".png")}
        of_frames = {"frames/u.4.png", "frames/u.5.png"}
        others = {"new/sheets/u.png", "new/sheets/i.png", "particles/u.png"}
        self.assertEqual({*pictures}, of_frames | others)
        for file, text in pictures.items():
            self.assertTrue(text.startswith(b"\x89PNG") and len(text) > 10_000, file)

    def test_calls_an_object_that_was_never_learned_none(self) -> None:
        # A surer map than a sensor deserves explains nothing of an O's touches.
        self.palpate("map", "A.h5", "-o", "sure.map.h5", "--peak=0.9999", "--sensor-model=none")
        few = ("o.h5", "--maps", "sure.map.h5", "--gamma=0", "--bins=20x20x16")
        [record] = self.records(*few, "--none=1", "--touches=12", "--png=sheets")
        self.assertEqual((record["best"], record["right"], record["error_mm"]), ("(none)", True, None))
        self.assertEqual(record["mode"]["object"], "A", "the best object's bin")
        self.assertIn("1 map, 20 x 20 x 16 bins", self.palpate("recognize", *few).stdout)
        self.assertFalse(self.u("--none=1e300", "--touches=1")["right"], "an A that was learned")

    def test_says_once_what_the_lattice_does_not_resolve(self) -> None:
        for flag, said in (("--touch-sd-mm=0.9", "touch-sd of 0.9 mm"), ("--slip-sd-deg=1", "slip-sd of 1 degrees")):
            narrow = self.printed("u.h5", "i.h5", "--bins=10x10x36", flag).stderr
            self.assertEqual(narrow.count(f"does not resolve {said}"), 1)
        self.assertEqual(self.printed("u.h5", "--bins=25x25x48", "--touch-sd-mm=1", "--touch-sd-deg=5").stderr, "")

    def test_like_other_commands_says_where_bins_are_wider_than_the_sensor_models(self) -> None:
        learned = "format: palpate.sensor_model\nversion: 1\nbins: {x_mm: 1, y_mm: 1, theta_rad: 0.5}\n"
        (self.folder / "s.yaml").write_text(learned)
        sensor = "simulate:A,rate=100,seed=3,touches=2,speed=max"
        wide = ("--maps=maps", "--sensor-model=s.yaml", "--bins=10x10x15")
        for command in (
            ["recognize", "u.h5", "--filter=bounded"],
            ["live", "--sensor", sensor],
            ["plan", "u.h5", "--candidates", "u.h5", "--samples=16"],
            ["batch", "u.h5", "-o", "r", "--filter=histogram"],
            ["batch", "u.h5", "-o", "s", "--filter=bounded"],
        ):
            self.assertIn("calibrate with --bins 10x10x15", self.palpate(*command, *wide).stderr, command)
        into_itself = ["recognize", "u.h5", "--maps=maps", "--sensor-model=s.yaml", "--json=s.yaml"]
        self.assert_refused(into_itself, "--json s.yaml", "--sensor-model reads")

    def test_shows_its_progress_on_a_terminal_until_ctrl_c(self) -> None:
        self.printed("u.h5", "--bins=5x5x4", "--each-frame")
        # A touch says next to nothing with this gamma, so that bounds evaluate nearly all of 2.6e10 bins.
        endless = (
            "recognize", "u.h5", "--maps", "maps/A.map.h5", "--each-frame", "--filter=bounded",
            "--gamma=0.45", "--x-mm=-60:60", "--y-mm=-60:60", "--bins=6000x6000x720", "--json", "-",
        )  # fmt: skip
        with Running(self.folder, *endless, terminal=True) as program:
            self.assertTrue(program.shows("\rrecognising   0 %, 0 % of unknown 1 of 6, "))
            self.assertTrue(program.shows(" s so far"))
            program.type("\x03")
            status, text = program.finish()
        self.assertEqual(status, -signal.SIGINT)
        self.assertNotIn("{", text, "JSON comes whole or not at all")
