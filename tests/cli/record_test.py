"""`palpate record`: what it writes, what it says, and what it leaves where it ends early."""

import math
import signal
import statistics

from command import Running
from streams import ONE_TOUCH, StreamTest

NAN = math.nan
#: For as long as nobody ends it.
SLOWLY = ("record", "--sensor", "simulate:A,rate=1000,speed=5", "-o", "s.h5")


class Record(StreamTest):
    def refused(self, file: str, sensor: str, *flags: str, named: list[str]) -> None:
        self.assert_refused(["record", "--sensor", sensor, "-o", file, *flags], *named)

    def test_keeps_all_that_the_sensor_says(self) -> None:
        frames = self.recorded("s.h5", "simulate:E,touches=2,object=3:-4:30,speed=max")
        self.assertEqual(len(frames.time), 361)  # 1 s, 2 presses, 0.6 s, both ends
        self.assertTrue(all(math.isfinite(theta) for *_, theta in frames.pose))
        self.assertEqual(frames.lost, [0] * 361)
        self.assert_named(self.back, "361 frames of 36 elements", "--truth=E,3,-4,0.52359")
        end = frames.time[0] + 0.5
        tare = [p for time, p in zip(frames.time, frames.pressure, strict=True) if time <= end]
        self.assertEqual(len(tare), 51)
        for (*_, baseline), readings in zip(frames.array, zip(*tare, strict=True), strict=True):
            # Pressures are stored as float32, to 2.4e-7 of numbers below 8.
            self.assertAlmostEqual(baseline, statistics.median(readings), delta=2.4e-7)

        again = self.recorded("b.h5", "replay:s.h5,speed=max")
        self.assertEqual(again, frames)
        self.assertIn("--truth=E", self.back)
        untared = self.recorded("s.h5", ONE_TOUCH, "--tare", "0")
        self.assertEqual(len(untared.array[0]), 2, "without a baseline")
        self.assertIn("--object=A", self.back)

    def test_says_what_there_is_and_so_does_info(self) -> None:
        sensor = ("--sensor", "simulate:A,speed=max", "--seconds", "4", "--object", "letter")
        said = self.done("record", *sensor, "-o", "s.h5")
        self.assertEqual(said, "s.h5: 400 frames in 3.990 s, 100.0 Hz, 0 lost, 400 with a pose\n")
        self.assert_named(
            self.done("info", "s.h5"), "recording of letter", "frames            400",
            "rate              100.0 Hz", "lost              0", "baseline          ",
            "closed            yes", "simulated DigiTacts",
        )  # fmt: skip

    def test_takes_poses_from_a_file(self) -> None:
        begin = self.recorded("a.h5").time[0]
        rows = [f"{begin - 0.025 + 0.05 * i},{i},2,1\n" for i in range(21)]
        (self.folder / "poses.txt").write_text("time,x_mm,y_mm,theta_rad\n" + "".join(rows))
        frames = self.recorded("b.h5", "replay:a.h5,speed=max", "--poses", "poses.txt")
        self.assertAlmostEqual(frames.pose[0][0], 0.5, places=4)
        self.assertAlmostEqual(frames.pose[50][0], 10.5, places=4)
        self.assertTrue(math.isnan(frames.pose[200][2]), "the poses have ended")

    def test_is_ended_cleanly_by_a_signal(self) -> None:
        # A source of poses that never ends a line keeps nobody from ending the recording.
        endless = ("--poses", "/dev/zero")
        file = self.folder / "s.h5"
        for number, more in ((signal.SIGINT, ()), (signal.SIGINT, endless), (signal.SIGTERM, endless)):
            with Running(self.folder, *SLOWLY, *more) as program:
                self.assertTrue(program.reaches(file.exists))
                self.assertIn("closed            no: it is being recorded", self.done("info", "s.h5"))
                closing = self.palpate("info", "--close", "s.h5", status=2).stderr
                self.assert_named(closing, "s.h5", "wait until it is done")
                program.program.send_signal(number)
                status, text = program.finish()
            self.assertEqual(status, 0, text)
            self.assert_named(text, "s.h5: ", " frames in ", " 0 lost")
            self.assertIn("closed            yes", self.done("info", "s.h5"))
            file.unlink()

    def test_that_is_killed_leaves_a_readable_file(self) -> None:
        with Running(self.folder, *SLOWLY) as program:
            self.assertTrue(program.reaches((self.folder / "s.h5").exists))
        frames = self.frames_of("s.h5")
        self.assertTrue(frames.time)  # how many it appears with is the clock's matter
        self.palpate("touches", "s.h5", "-o", "t.h5", "--onset", "1000", status=2)
        cut_off = ("closed            no: it was cut off", "info --close")
        self.assert_named(self.done("info", "s.h5"), *cut_off)
        self.assertIn("closed            yes", self.done("info", "--close", "s.h5"))
        self.assertEqual(self.frames_of("s.h5"), frames)

    # The simulated robot begins its first press after 1.3 s.
    def test_with_a_touched_tare_leaves_what_was_there(self) -> None:
        self.refused("s.h5", ONE_TOUCH, "--tare", "1.6", named=["touched", "element"])
        self.palpate("record", "--sensor", "simulate:E,touches=1,speed=max", "-o", "s.h5")
        self.refused("s.h5", ONE_TOUCH, "--tare", "1.6", named=["touched", "element"])
        self.assertEqual([*self.content()], ["s.h5"])
        self.recorded("s.h5")
        self.assertIn("--object=A", self.back)

    # Of an array that is connected to nothing, or of which one element is: before anything of the tare is
    # saved and afterwards.
    def test_without_a_known_reading_leaves_what_was_there(self) -> None:
        frames = self.recorded("old.h5")
        self.forget_baseline()
        for unknown, tares, named in (
            (range(36), ("0",), "sensor -: none of its 261 frames has both a known reading"),
            (range(36), ("0.5", "60"), "element 0 reads no number while the baseline is taken"),
            ([7], ("0.1", "1"), "element 7 reads no number while the baseline is taken; mark it dead"),
        ):
            for readings in frames.pressure:
                readings[:] = [NAN if k in unknown else p for k, p in enumerate(readings)]
            for tare in tares:
                for file in ("old.h5", "new.h5"):
                    before = self.content()
                    said = self.record_lines(file, frames, "--tare", tare, status=2).stderr
                    self.assertEqual(said.count("\n"), 1, said)
                    self.assertIn(named, said)
                    self.assertTrue(self.content() == before, file)
            frames = self.frames_of("old.h5")
            self.forget_baseline()

    def test_keeps_unknown_readings_and_counts_frames_without_a_known_one_as_lost(self) -> None:
        frames = self.recorded("a.h5")
        self.forget_baseline()
        for i, readings in enumerate(frames.pressure):
            readings[i % 36] = NAN
        for i in (10, 11, 50):
            frames.pressure[i] = [NAN] * 36
        said = self.record_lines("b.h5", frames).stdout
        self.assert_named(said, "258 frames", "3 lost", "258 with a pose", "258 readings unknown")
        self.assertEqual(len(self.frames_of("b.h5").array[0]), 3, "with a baseline")
        self.assert_named(
            self.done("info", "b.h5"), "unknown readings  258 of 9288", "pressure          0 to",
            "lost              3 ", "with a pose       258 ",
        )  # fmt: skip
        self.assert_named(self.done("touches", "b.h5", "-o", "t.h5"), "1 touches", "3 lost", "258 readings unknown")

    # The clock is set back by an hour in the tare, and again afterwards: each step hides the 10 ms
    # between two frames.
    def test_is_not_prolonged_by_a_clock_that_is_set_back(self) -> None:
        frames = self.recorded("a.h5")
        self.forget_baseline()
        for i in range(20, 261):
            frames.time[i] -= 3600 if i < 150 else 7200
        said = self.record_lines("b.h5", frames).stdout
        self.assertIn("261 frames in 2.580 s, 100.8 Hz", said)
        info = self.done("info", "b.h5")
        self.assert_named(info, "duration          2.580 s", "rate              100.8 Hz")
        self.record_lines("b.h5", frames, "--seconds", "2", "--tare", "0.5")
        again = self.frames_of("b.h5")
        self.assertEqual(len(again.time), 202)
        self.assertEqual(len(again.array[0]), 3, "the first press is at 1.3 s")

    def test_of_what_cannot_be_recorded_is_refused(self) -> None:
        self.refused("s.h5", "replay:missing.h5", named=["missing.h5"])
        self.refused("s.h5", "simulate:A,speed=max", named=["simulate:A", "--seconds", "touches=N"])
        self.refused("no/s.h5", "simulate:A", named=["no/s.h5", "mkdir"])
        self.refused("s.h5", "simulate:A", "--seconds=-1", named=["--seconds"])
        self.refused("s.h5", "simulate:A", "--tare=nan", named=["--tare"])
        self.refused("s.h5", "simulate:A", "--poses", "missing", named=["poses missing", "FIFO"])
        for label in ("caf\udce9", "a\nb"):  # before the sensor is opened
            self.refused("s.h5", "replay:none.h5", "--object", label, named=["--object", "UTF-8"])
        self.assert_refused(["record", "-o", "s.h5"], "--sensor")
