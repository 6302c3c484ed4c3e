"""`palpate live` on recorded and simulated streams, and on frames that another program writes to standard
input."""

import itertools
import json
import math
import os
import signal
from typing import Any

from command import PreparedTest, Running
from streams import Frames, StreamTest, posed

UNKNOWN_E = "simulate:E,rate=100,seed=3,object=random,touches=4,speed=max"
FLAGS = ["--maps", "maps", "--bins", "20x20x24"]


def live(sensor: str, *more: str) -> list[str]:
    return ["live", "--sensor", sensor, *FLAGS, *more]


def csv_lines(frames: Frames, sign: int = 1) -> list[str]:
    return [
        ",".join(map(repr, [time, *pose, *(sign * p for p in pressure)])) + "\n"
        for time, pose, pressure in zip(frames.time, frames.pose, frames.pressure, strict=True)
    ]


class Live(PreparedTest, StreamTest):
    """Of an E, among maps of A and E; its frames are in frames.h5, and their array in array.csv."""

    @classmethod
    def prepare(cls) -> None:
        cls.learn("AE")
        cls.make("record", "--sensor", UNKNOWN_E, "-o", "frames.h5")

    def setUp(self) -> None:
        super().setUp()
        self.frames = self.frames_of("frames.h5")

    def written(self) -> list[Any]:
        return [json.loads(line) for line in (self.folder / "live.jsonl").read_text().splitlines()]

    def touches(self, sensor: str, *more: str, **surroundings: Any) -> list[Any]:
        """What is believed after each touch."""
        self.palpate(*live(sensor, "--json", "live.jsonl", *more), **surroundings)
        return self.written()

    def assert_ended_by(self, number: int, *arguments: str, stdin: int | None = None) -> None:
        """The signal ends the program cleanly while it recognises."""
        with Running(self.folder, *arguments, stdin=stdin) as program:
            self.assertTrue(program.shows("latency ms"))
            program.program.send_signal(number)
            status, text = program.finish()
        self.assertEqual(status, 0, text)

    def test_recognises_a_simulated_letter(self) -> None:
        ended = self.palpate(*live(UNKNOWN_E, "--json", "-"))
        touches = [json.loads(line) for line in ended.stdout.splitlines()]
        self.assertEqual([touch["touch"] for touch in touches], [0, 1, 2, 3])
        for before, touch in itertools.pairwise([{"time": 0.0}, *touches]):
            self.assertEqual((touch["unknown"], touch["frames_lost"]), (0, 0))
            self.assertGreater(touch["time"], before["time"])
            self.assertGreater(touch["latency_ms"], 0)
            self.assertEqual(len(touch["touch_fit"]), touch["touch"] + 1)
        self.assertEqual((touch["best"], touch["right"], touch["truth"]["object"]), ("E", True, "E"))
        self.assertIn("dropped_mass", touch, "by bounds, though there are few bins")
        # A bin is 1 mm wide and 15 degrees, by which the letter's ends move about 3 mm.
        self.assertLess(touch["refined_error_mm"], 2)
        self.assertIn("4 touches", ended.stderr)

    def test_prints_a_line_for_each_touch(self) -> None:
        text = self.palpate(*live(UNKNOWN_E)).stdout
        self.assertNotIn("\033", text, "escape codes without a terminal")
        self.assert_named(
            text, "unknown  touch  best", "prob.  dropped", "\n      1      4  E ", "\ntruth: E at ",
            "4 touches", " 0 lost", "from frame to estimate: median ", "2 maps, ",
        )  # fmt: skip

    # Equal touches on one device give the same bits, one by one or together; files hold pressures in
    # float64. Readings that are huge or unknown, all of one element in a press, cost no touch.
    def test_believes_what_recognize_finds_afterwards(self) -> None:
        readings = self.frames.pressure
        readings[110][3] = readings[111][3] = 1e38
        readings[215][9] = readings[216][9] = -1e38
        for i, of_frame in enumerate(readings):
            of_frame[i % 36] = math.nan
            if 210 < i < 310:  # the second press
                of_frame[20] = math.nan
        self.record_lines("spoilt.h5", self.frames)
        for file, *flags in (
            ("frames", "--maps=maps", "--tolerance=1e-6"),  # the first touch places the lattice
            ("frames", *FLAGS, "--filter=bounded", "--tolerance=1e-6"),
            ("spoilt", *FLAGS, "--filter=histogram"),
        ):
            replay = f"replay:{file}.h5,speed=max"
            self.palpate("live", "--sensor", replay, "--json", "live.jsonl", *flags)
            touches = self.written()
            self.palpate("touches", f"{file}.h5", "-o", "touches.h5")
            [record] = self.records("touches.h5", "--trace", *flags)
            self.assertEqual((len(touches), len(record["trace"]), touches[-1]["best"]), (4, 4, "E"))
            for touch, step in zip(touches, record["trace"], strict=True):
                # What the array reads untouched is told to more than these digits by both.
                self.assertAlmostEqual(touch["fit"].pop("z"), step["fit"].pop("z"), places=9)
                for z, other in zip(touch["touch_fit"], step.pop("touch_fit"), strict=True):
                    self.assertAlmostEqual(z, other, places=9)
                self.assertEqual({key: touch[key] for key in step}, step)
        # 561 frames, and 99 of one element of which two or three are counted already.
        said = self.palpate(*live("replay:spoilt.h5,speed=max")).stdout
        self.assertRegex(said, r"4 touches.* 65[78] readings unknown")

    def test_ends_while_its_sources_never_do(self) -> None:
        for number in (signal.SIGINT, signal.SIGTERM):  # the poses' source never ends a line
            self.assert_ended_by(number, *live("simulate:A", "--poses", "/dev/zero"))
        for sent in (b"", b"1,2,"):  # the frames' source writes nothing any more
            reader, writer = os.pipe()
            os.write(writer, sent)
            self.assert_ended_by(signal.SIGINT, *live("-", "--array", "6:6:1.9"), stdin=reader)
            os.close(reader)
            os.close(writer)

    def test_joins_frames_with_poses_from_a_fifo(self) -> None:
        expected = self.touches("replay:frames.h5,speed=max")
        # A board that does not know where it is gives this stream, and a robot that does.
        unposed = ("pressures.csv", "--array", "array.csv", "--rows", "frames")
        self.palpate("import", *unposed, "-o", "bare.h5")
        lines = ["not a pose"]
        for i, (time, pose) in enumerate(zip(self.frames.time, self.frames.pose, strict=True)):
            if i % 5 == 0 or i + 1 == len(self.frames.time):
                lines.append(json.dumps({"time": time, **posed(pose)}))
        os.mkfifo(self.folder / "poses")
        fifo = os.open(self.folder / "poses", os.O_RDWR)  # it opens at once, and all fits into it
        os.write(fifo, ("\n".join(lines) + "\n").encode())
        said = self.palpate(*live("replay:bare.h5,speed=max", "--poses", "poses", "--json", "live.jsonl"))
        os.close(fifo)
        # When it happens, before the line of the end.
        self.assertEqual(said.stderr.count("\n"), 2, said.stderr)
        no_pose = "palpate: poses poses, line 1: is no JSON object, and no row of CSV"
        self.assert_named(said.stderr, no_pose, "1 lines of poses were skipped")
        for touch, other in zip(self.written(), expected, strict=True):
            self.assertEqual(touch["best"], other["best"])
            # The robot stands still in the steady phase, so that poses between its own are the same but
            # for rounding.
            for key, value in touch["pose"].items():
                self.assertAlmostEqual(value, other["pose"][key], places=9)
        poseless = live("replay:bare.h5,speed=max", "--json", "-")
        self.assert_refused(poseless, "bare.h5", "4 touches", "--poses")

    def test_begins_another_unknown_after_a_pause(self) -> None:
        patient = self.touches(UNKNOWN_E, "--reset-after", "2")
        told = [(touch["unknown"], touch["touch"]) for touch in patient]
        self.assertEqual(told, [(0, i) for i in range(4)])
        # From release to onset the simulated robot takes 0.3 s and more; a clock that is set back by an
        # hour, in the tare and between the second and the third touch, prolongs nothing.
        for i in range(20, len(self.frames.time)):
            self.frames.time[i] -= 3600 if i < 320 else 7200
        self.forget_baseline()
        lines = {"input": self.frames.lines()}
        for touches in (
            self.touches(UNKNOWN_E, "--reset-after", "0.2"),
            self.touches("-", "--array", "array.csv", "--reset-after", "0.2", **lines),
        ):
            told = [(touch["unknown"], touch["touch"]) for touch in touches]
            self.assertEqual(told, [(i, 0) for i in range(4)])
            self.assertEqual(touches[0]["best"], patient[0]["best"])
            self.assertNotEqual(touches[-1]["identity"], patient[-1]["identity"])

    def test_of_lines_is_that_of_a_replay(self) -> None:
        expected = self.touches("replay:frames.h5,speed=max")
        rows = csv_lines(self.frames)
        rows.insert(301, "cut off, 1\n")
        for lines in (self.frames.lines(), "".join(rows)):
            touches = self.touches("-", "--array", "array.csv", input=lines)
            for touch, other in zip(touches, expected, strict=True):
                for key in ("identity", "mode", "time", "pose"):
                    self.assertEqual(touch[key], other[key], key)
        said = self.palpate(*live("-", "--array", "6:6:1.9"), input="".join(rows)).stderr
        self.assert_named(said, "standard input, line 302: has 2 cells", "1 lines of frames were skipped")

    def test_of_lines_says_that_readings_fall_or_frames_are_swapped(self) -> None:
        falling = "".join(csv_lines(self.frames, sign=-1))
        array = ("--array", "6:6:1.9")
        said = self.palpate(*live("-", *array), input=falling).stderr
        self.assert_named(said, "the readings fall below their rest", "--sign -1")
        self.assertTrue(self.touches("-", *array, "--sign", "-1", input=falling))
        self.assertNotIn("fall", self.palpate(*live("-", *array, "--sign", "-1"), input=falling).stderr)
        rows = csv_lines(self.frames)
        for i in range(0, len(rows) - 1, 2):
            rows[i : i + 2] = rows[i + 1], rows[i]
        said = self.palpate(*live("-", *array), input="".join(rows)).stderr
        self.assertIn(f"time runs backwards at {len(rows) // 2} of {len(rows)} frames", said)

    def test_of_what_cannot_be_meant_is_refused(self) -> None:
        array = ("--array", "6:6:1.9")
        for arguments, *named in (
            (live("nothing"), "--poses", "nothing"),
            (live("nothing", "--poses", "-"), "nothing"),
            (live("replay:A.h5"), "A.h5", "rows"),
            (["live", "--sensor", UNKNOWN_E], "--maps", "missing"),
            (live(UNKNOWN_E, "--reset-after", "0"), "--reset-after"),
            (live(UNKNOWN_E, "--tare", "-1"), "--tare"),
            (live(UNKNOWN_E, "--json", "new.jsonl", "--steady", "2"), "steady = 2"),
            (live(UNKNOWN_E, "--json", "no/such.jsonl"), "--json", "no/such.jsonl"),
            (live("-"), "--array", "COLUMNS:ROWS:PITCH"),
            (live("-", *array, "--poses", "-"), "--poses -", "--sensor -", "x_mm"),
            (live("-", *array, "--pressure-unit", "psi"), "--pressure-unit psi", "kPa"),
            (live("simulate:A", *array), "--array", "--sensor -"),
        ):
            self.assert_refused(arguments, *named)
        wrong = self.palpate(*live("-", *array, "--json", "-"), status=2, input="1,2,3\n").stderr
        self.assert_named(wrong, "standard input, line 1", "3 numbers", "36 elements")
        self.assertEqual(wrong.count("\n"), 1, wrong)

    def test_ends_where_a_line_cannot_be_written(self) -> None:
        endless, full = live("simulate:A,speed=max"), lambda: os.dup2(os.open("/dev/full", os.O_WRONLY), 1)
        self.assertIn("/dev/full", self.palpate(*endless, "--json", "/dev/full", status=1).stderr)
        self.assertIn("standard output", self.palpate(*endless, status=1, preexec_fn=full).stderr)
