"""`palpate import`: a row for each table, with the recording that it makes, read back by `palpate export`.
tests/python has a table of further shapes of logs, and one of what is refused."""

import csv
import dataclasses
import json
import math
import random
import re
import unittest
from typing import Any

from command import CommandTest

NAN = math.nan
FRAMES = "time,p0,p1\n0,1,2\n0.05,3,4\n0.1,5,6\n"
POSES = "time,x_mm,y_mm,theta_rad\n0,0,5,-1\n0.1,10,7,1\n"
READINGS = [[1, 2], [3, 4], [5, 6]]
SIX = "time,a,b,c,d,e,f\n0,1,2,3,4,5,6\n"
WITH_POSES = "--poses poses.csv"
PAIR = "x,y\n-1,0.5\n1,-0.25\n"


@dataclasses.dataclass
class Case:
    """Files beside log.csv and poses.csv, flags, and columns of the recording's tables."""

    files: dict[str, str]
    flags: str = ""
    readings: list[Any] | None = None
    time: list[float] | None = None
    poses: list[Any] | None = None
    array: list[Any] | None = None
    said: str = ""
    warned: str = ""


def log(text: str, **more: str) -> dict[str, str]:
    return {"log.csv": text} | {f"{name}.csv": table for name, table in more.items()}


def in_space(poses: list[Any], upright: bool = False, tilt: float = 0.0, heights: Any = (100,) * 3) -> str:
    """Poses of an array above the robot's xy plane, whose frame the given ones have, or of one beside the xz
    plane that this plane is turned to; angles about the moving axes x, z and x."""
    table = "time,a,b,c,d,e,f\n"
    for i, ((x, y, theta), height) in enumerate(zip(poses, heights, strict=True)):
        place = (x, -height, y) if upright else (x, y, height)
        table += ",".join(map(str, (0.05 * i, *place, math.pi / 2 * upright, theta, tilt))) + "\n"
    return table


THREE = [[1, 2, 0.5], [-3, 4, -2], [6, -5, 3]]
TURNED = [[1, -2, -0.5], [-3, -4, 2], [6, 5, -3]]
ORIGIN = [[0, 0, 0]] * 3
WITH_ARRAY = "--array array.csv --poses poses.csv"
BY_ANGLES = " --pose-unit mm,rad --pose-columns a:f --euler XZX"
UPRIGHT = "x and y are along (1, 0, 0) and (0, 0, -1) of the robot frame"

CASES = {
    "frames_joined_with_poses_by_time": Case(
        {}, "--poses poses.csv --object A", READINGS, [0, 0.05, 0.1], [[0, 5, -1], [5, 6, 0], [10, 7, 1]],
        [[-1, 0], [1, 0]], "o.h5: 3 frames of 2 elements in 0.100 s, 3 with a pose; next: palpate touches o.h5 -o "
        "TOUCHES.h5\n",
    ),
    "readings_that_fall_under_load": Case(
        {"array.csv": "x,y,baseline\n-1,0,7\n1,0,8\n"}, "--sign -1 --array array.csv", [[-1, -2], [-3, -4], [-5, -6]],
        array=[[-1, 0, -7], [1, 0, -8]],
    ),
    "frames_outside_the_poses_and_in_a_gap": Case(
        {"poses.csv": "t,x,y,yaw\n0.01,1,2,3\n0.02,1,2,3\n0.07,1,2,3\n0.08,1,2,3\n"},
        "--poses poses.csv --largest-gap-s 0.06", poses=[[NAN] * 3, [1, 2, 3], [NAN] * 3],
    ),
    "frames_after_the_last_pose_lie_in_no_gap": Case(
        {"poses.csv": "time,x,y,theta_rad\n0,0,5,-1\n0.05,10,7,1\n"}, WITH_POSES,
        said="2 with a pose, 'x', 'y' taken to be in mm; next",
    ),
    "touches_at_unknown_poses": Case(
        {}, "--rows touches --unposed --object A", poses=ORIGIN, said="; next: palpate map o.h5 -o MAPS/ --unposed\n",
    ),
    "touches_of_an_unknown": Case(
        {}, "--rows touches --unposed", said="3 touches of 2 elements in 0.100 s; next: palpate recognize o.h5 --maps "
        "MAPS/ --each-frame\n",
    ),
    "frames_at_unknown_poses": Case(
        {}, "--unposed", said="0 with a pose; next: palpate touches o.h5 -o TOUCHES.h5 --unposed\n",
    ),
    "frames_without_poses": Case({}, "", READINGS, said="0 with a pose; next: palpate live --sensor replay:o.h5 --poses"),
    "rows_without_times_are_touches_with_a_truth": Case(
        log("x,y,theta,p0,p1\n1,2,3,4,5\n6,7,8,9,10\n"), "--poses log.csv --truth A,1,2,0.5", [[4, 5], [9, 10]],
        poses=[[1, 2, 3], [6, 7, 8]],
        said="o.h5: 2 touches of 2 elements, poses taken to be in mm and rad; next: palpate recognize o.h5 --maps MAPS/\n",
    ),
    # Two frames of one time: their poses cannot be told apart by time.
    "pressures_and_poses_row_by_row": Case(
        log("t,T,x_mm,y_mm,theta_rad,p0,p1\n0,20,1,0,0,1,2\n0,20,2,0,0,3,4\n0.1,20,3,0,0,5,6\n"),
        "--poses ./log.csv --pressure-columns P", READINGS, [0, 0, 0.1], [[1, 0, 0], [2, 0, 0], [3, 0, 0]],
    ),
    "poses_that_are_left_out": Case(
        log("t,x_mm,y_mm,theta_rad,p0,p1\n0,1,0,0,1,2\n0.1,3,0,0,5,6\n"), "--pressure-columns P",
        said="0 with a pose, its columns of poses left out (--poses log.csv); next",
    ),
    # The same readings in any table.
    **{
        name: Case(log(text), flags, READINGS, [0, 0.05, 0.1])
        for name, text, flags in [
            ("no_header", "0,1,2\n0.05,3,4\n0.1,5,6\n", ""),
            ("long", "time,element,pressure\n0,0,1\n0,1,2\n0.05,1,4\n0.05,0,3\n0.1,0,5\n0.1,1,6\n", ""),
            ("named", "time,load,q0,q1\n0,9,1,2\n0.05,9,3,4\n0.1,9,5,6\n", "--pressure-columns q"),
            ("from_to", "time,a,b,c\n0,1,2,9\n0.05,3,4,9\n0.1,5,6,9\n", "--pressure-columns a:b"),
            ("numbered_rows", ",time,a,b\n0,0,1,2\n1,0.05,3,4\n2,0.1,5,6\n", ""),
            ("rate", "1,2\n3,4\n5,6\n", "--rate 20"),
            ("nanoseconds", "stamp_ns,p0,p1\n0,1,2\n50000000,3,4\n100000000,5,6\n", ""),
            ("milliseconds", "when,p0,p1\n0,1,2\n50,3,4\n100,5,6\n", "--time-column when --time-unit ms"),
        ]
    },
    "units_of_poses_in_their_names": Case(
        {"poses.csv": "time,x_m,y_mm,yaw_deg\n0,0.25,-1,180\n0.1,0.5,0,90\n"}, WITH_POSES,
        poses=[[250, -1, math.pi], [375, -0.5, 0.75 * math.pi], [500, 0, 0.5 * math.pi]],
    ),
    "empty_cells_of_frames_are_unknown": Case(
        log("time,p0,p1,p2\n0,,2,\n0.1,3,nan,\n"), "--array 3:1:1", [[NAN, 2, NAN], [3, NAN, NAN]],
        array=[[-1, 0, 1], [0, 0, 1], [1, 0, 0]],
    ),
    "empty_cells_of_touches_are_dead": Case(
        log("x,y,theta,p0,p1\n0,0,0,1,\n0,0,0,2,3\n"), "--poses log.csv", [[1, NAN], [2, 3]],
        said="1 readings unknown or dead",
    ),
    "elements_of_a_text": Case(
        {"array.txt": "# x y in mm\n-1.5 0.5\n1.5 0.25  # the tip\n"}, "--array array.txt",
        array=[[-1.5, 0.5], [1.5, 0.25]],
    ),
    "elements_in_metres": Case(
        {"array.csv": "x_m,y_m,valid,baseline\n-0.0015,0.0005,1,3\n0.0015,0.00025,0,\n"}, "--array array.csv",
        array=[[-1.5, 0.5, 1, 3], [1.5, 0.25, 0, NAN]],
    ),
    "a_dead_element": Case({}, "--dead 1", array=[[-1, 0, 1], [1, 0, 0]]),
    "one_more_dead_element": Case(
        log("time,p0,p1,p2\n0,1,2,3\n", array="x,y,valid\n0,0,0\n2,0,1\n4,0,1\n"), "--array array.csv --dead 1",
        array=[[0, 0, 0], [2, 0, 0], [4, 0, 1]],
    ),
    "a_grid_row_by_row": Case(
        log(SIX), "--array 3:2:2.5",
        array=[[-2.5, -1.25], [0, -1.25], [2.5, -1.25], [-2.5, 1.25], [0, 1.25], [2.5, 1.25]],
    ),
    # Whole numbers that are no pressures.
    "whole_numbers": Case(
        log("time,p0,p1\n0,12,4095\n0.05,,3\n"), said="whole numbers up to 4095: raw? (--pressure-unit raw)",
    ),
    # Poses in space lie in the plane of the touches. In an upright plane, whose normal is the robot's y, x is
    # still the robot's and y its -z.
    "upright": Case(
        {"array.csv": PAIR, "poses.csv": in_space(THREE, upright=True)}, WITH_ARRAY + BY_ANGLES, poses=TURNED,
        array=[[-1, -0.5], [1, 0.25]], warned=UPRIGHT,
    ),
    "upright_and_down": Case(
        {"array.csv": PAIR, "poses.csv": in_space(THREE, upright=True, tilt=math.pi)}, WITH_ARRAY + BY_ANGLES,
        poses=TURNED, array=[[-1, 0.5], [1, -0.25]], warned=UPRIGHT,
    ),
    # The array looks up once, and down twice: it is turned over.
    "a_given_plane_needs_no_like_directions": Case(
        {"array.csv": PAIR, "poses.csv":
         "time,tx,ty,tz,qx,qy,qz,qw\n0,0,0,0,0,0,0,1\n0.05,1,2,0,1,0,0,0\n0.1,1,2,0,1,0,0,0\n"},
        WITH_ARRAY + " --pose-unit mm,rad --plane 0,0,1", poses=[[0, 0, 0], [1, 2, 0], [1, 2, 0]],
        array=[[-1, -0.5], [1, 0.25]], warned="turned over",
    ),
    "a_height_beside_an_angle_is_left_out": Case(
        {"poses.csv": "time,x,y,z,roll,yaw\n0,1,2,30,0.01,0.5\n1,1,2,30,6.29,0.5\n"}, WITH_POSES,
        warned="poses.csv: its column 'z' was left out",
    ),
    "a_trajectory_without_a_header": Case(
        {"poses.csv": "0 1 2 3 0 0 0 1\n0.1 2 3 3 0 0 0.479425538604203 0.8775825618903728\n"},
        "--poses poses.csv --pose-unit m,rad", poses=[[1000, 2000, 0], [1500, 2500, 0.5], [2000, 3000, 1]],
        warned="columns '2' to '8', in m\n",
    ),
    "tilt_under_load": Case(
        {"poses.csv": in_space(ORIGIN, tilt=0.2)}, WITH_POSES + BY_ANGLES + " --plane 0,0,2",
        warned="poses.csv: 2 of 2 poses under load are tilted by more than 3 degrees, 11.5 at most: press the array "
        "flat, or give the --plane",
    ),
    "height_under_load": Case(
        {"poses.csv": in_space(ORIGIN, heights=(190, 100, 103))}, WITH_POSES + BY_ANGLES,
        warned="palpate: poses.csv: the height under load varies by 3.0 mm: do all touches lie in one plane?\n",
    ),
    # Only the last two frames are pressed.
    "height_without_load": Case({"poses.csv": in_space(ORIGIN, heights=(190, 100, 100))}, WITH_POSES + BY_ANGLES),
}  # fmt: skip


class ImportTest(CommandTest):
    def setUp(self) -> None:
        super().setUp()
        self.put({"log.csv": FRAMES, "poses.csv": POSES})

    def put(self, files: dict[str, str]) -> None:
        for name, text in files.items():
            (self.folder / name).write_text(text)

    def arguments(self, flags: str) -> list[str]:
        array = [] if "--array" in flags else ["--array", "2:1:2"]
        return ["import", "log.csv", "-o", "o.h5", *array, *flags.split()]

    def said(self, flags: str = "") -> str:
        return self.done(*self.arguments(flags))

    def warned(self, flags: str) -> str:
        return self.palpate(*self.arguments(flags)).stderr

    def table(self, name: str) -> tuple[list[str], list[list[float]]]:
        [header, *rows] = csv.reader((self.folder / "tables" / name).read_text().splitlines())
        return header, [[float(cell or "nan") for cell in row] for row in rows]

    def assert_close(self, rows: list[Any], expected: list[Any]) -> None:
        flat = [[*row] if isinstance(row, list) else [row] for row in expected]
        self.assertEqual([len(row) for row in rows], [len(row) for row in flat])
        for a, b in zip(sum(rows, []), sum(flat, []), strict=True):
            self.assertTrue(abs(a - b) < 1e-9 or math.isnan(a) and math.isnan(b), f"{rows} is not {expected}")


class Import(ImportTest):
    def test_reads_tables(self) -> None:
        for name, case in CASES.items():
            with self.subTest(name):
                self.put({"log.csv": FRAMES, "poses.csv": POSES, **case.files})
                done = self.palpate(*self.arguments(case.flags))
                self.assertIn(case.said, done.stdout)
                warned = re.sub("palpate: poses.csv: its poses are .* axes XZX .*\n", "", done.stderr)
                self.assertIn(case.warned, warned)
                self.assertEqual(warned == "", case.warned == "", warned)
                if not (case.readings or case.poses or case.array):
                    continue
                self.done("export", "o.h5", "-o", "tables")
                names, rows = self.table("pressures.csv")
                timed = names[0] == "time"
                if case.readings is not None:
                    self.assert_close([row[timed:] for row in rows], case.readings)
                if case.time is not None:
                    self.assert_close([row[:1] for row in rows], case.time)
                if case.poses is not None:
                    self.assert_close(self.table("poses.csv")[1], case.poses)
                if case.array is not None:
                    self.assert_close(self.table("array.csv")[1], case.array)

    def test_says_what_a_recording_is_of(self) -> None:
        for names, row in (("theta_deg", "0,0,0"), ("z,roll_deg,pitch_deg,yaw_deg", "0,0,0,0,0,0")):
            self.put({"poses.csv": f"time,x_m,y_mm,{names}\n0,{row}\n0.1,{row}\n"})
            flags = "--poses poses.csv --truth A,0.5,2,90 --pressure-unit raw --object A"
            self.assert_named(self.palpate(*self.arguments(flags)).stdout, "--onset P")
            back = self.done("export", "o.h5", "-o", "t")
            self.assert_named(back, "--pressure-unit raw", "--object=A", f"--truth=A,500,2,{math.pi / 2}")
        self.said()
        self.assertNotIn(b"sensor_pose", (self.folder / "o.h5").read_bytes())
        self.assert_named(self.done("info", "o.h5"), "frames            3", "with a pose       0 frames")

    def test_a_grids_readings_come_in_any_order(self) -> None:
        """What stands where, seen with x to the right and y upwards: the upper row, then the lower one."""
        self.put({"log.csv": SIX})
        for flags, expected in (
            ("", [4, 5, 6, 1, 2, 3]),
            ("--first-element top-left", [1, 2, 3, 4, 5, 6]),
            ("--first-element top-right", [3, 2, 1, 6, 5, 4]),
            ("--first-element bottom-right", [6, 5, 4, 3, 2, 1]),
            ("--order columns", [2, 4, 6, 1, 3, 5]),
            ("--order columns --first-element top-left", [1, 3, 5, 2, 4, 6]),
            ("--order columns --first-element top-right", [5, 3, 1, 6, 4, 2]),
        ):
            self.said("--array 3x2x2.5 " + flags)
            self.done("export", "o.h5", "-o", "tables")
            [row] = self.table("pressures.csv")[1]
            places = [(-y, x) for x, y in self.table("array.csv")[1]]
            self.assertEqual([reading for _, reading in sorted(zip(places, row[1:]))], expected, flags)

    def test_the_largest_gap_follows_the_poses(self) -> None:
        """Frames at 100 Hz and poses at 10 Hz, of which some are lost; the steps of the poses round to both sides
        of 0.1 s."""
        self.put({"log.csv": "time,p0,p1\n" + "".join(f"{1.7e9 + i * 0.01},1,2\n" for i in range(201))})
        for lost, flags, said in (
            (1, "", ", 201 with a pose; next"),
            # 0.3 s, in which 29 frames lie.
            (2, "", ", 172 with a pose, 29 without one as the poses around them are more than 0.25 s apart "
                    "(--largest-gap-s); next"),
            (2, " --largest-gap-s 0.31", ", 201 with a pose; next"),
        ):  # fmt: skip
            rows = (f"{1.7e9 + i * 0.1},{i},0,0\n" for i in range(21) if not 8 <= i < 8 + lost)
            self.put({"poses.csv": "time,x_mm,y_mm,theta_rad\n" + "".join(rows)})
            self.assertIn(said, self.said(WITH_POSES + flags))


class ClocksOfLogs(ImportTest):
    """What import, touches, map and check say of logs whose clocks differ."""

    def put_logs(self, ahead_s: float) -> None:
        """Thirty presses of two elements, of 0.4 to 0.8 s each, and 0.5 s of travel between them; the poses'
        clock is so much ahead."""
        noise = random.Random(3)
        log, poses, at_s = "time,p0,p1\n", "time,x_mm,y_mm,theta_rad\n", 0.0
        for press in range(31):
            travel = [(0, 6 * press + 0.24 * i) for i in range(25)]
            for pressure, place_mm in travel + [(10, 6 * (press + 1))] * (noise.randint(20, 40) if press < 30 else 0):
                log += f"{at_s:.3f},{pressure + 0.1 * noise.random():.3f},0.2\n"
                poses += f"{at_s + ahead_s:.3f},{place_mm:.3f},0,0.1\n"
                at_s += 0.02
        self.put({"log.csv": log, "poses.csv": poses})

    def findings(self) -> list[Any]:
        found: list[Any] = json.loads(self.done("check", "t\udce9.h5", "--json", "-"))
        return found

    def test_that_differ_are_said_until_their_offset_is_given(self) -> None:
        self.put_logs(0.62)
        flags = "--object cup --poses poses.csv"
        self.assert_named(
            self.warned(flags), "palpate: poses.csv: the poses' clock seems 0.6", " s ahead: in ",
            "of 30 presses the array moves, is lifted, or has no pose; with --pose-delay 0.6",
        )  # fmt: skip
        self.assert_named(
            self.done("touches", "o.h5", "-o", "t\udce9.h5"),
            " left out as not steady, clocks differ (palpate import --pose-delay 0.6",
        )
        self.assert_named(self.palpate("map", "t\udce9.h5", "-o", "m.h5").stderr, "h5: the poses' clock seems")
        *_, clock, dropped = self.findings()
        self.assertEqual((clock["what"], dropped["what"], dropped["nats"]), ("clock", "dropped", 0))
        self.assertGreater(clock["nats"], 20)
        self.assertTrue(clock["flag"].startswith("--pose-delay 0.6"), clock)
        self.assertEqual(dropped["flag"], clock["flag"])
        self.assert_named(clock["words"], "t\ufffd.h5: the poses' clock seems")
        self.assert_named(dropped["words"], "; the clocks differ: import with ")
        self.assertIn("ahead", self.warned(flags + " --pose-delay 0.2"))
        self.said(flags + " --pose-delay 0.62")
        self.assertIn("30 touches in ", self.done("touches", "o.h5", "-o", "t\udce9.h5"))
        self.assertFalse({"clock", "dropped"} & {found["what"] for found in self.findings()})
        self.put_logs(-3600.3)
        self.assert_refused(self.arguments(WITH_POSES), "poses.csv", "finds a pose", "their offset but for 1.05 s",
                            "--pose-delay -3600.")  # fmt: skip
