"""`palpate plan`, and the plans of `palpate live`."""

import json
import math
from typing import Any

from command import PreparedTest


def command(candidates: str, *more: str) -> list[str]:
    """By bounds, which need no device, unless a filter is asked for, and after two touches."""
    arguments = ["plan", "u.h5", "--maps", "maps", "--bins=15x15x24", "--candidates", candidates, *more]
    for flag in ("--touches=2", "--filter=bounded"):
        if not any(given.startswith(flag.split("=")[0]) for given in more):
            arguments.append(flag)
    return arguments


class Plan(PreparedTest):
    """After touches of an A, which is to be told from an I."""

    @classmethod
    def prepare(cls) -> None:
        cls.learn("AI")
        cls.make("simulate", "A", "-o", "u.h5", "--touches", "6", "--object-pose=2,-3,57")
        for file, rows in {
            "c.csv": "400,400,0\n0,0,0\n3,-2,45\n-5,4,90\n6,6,135\n",
            "far.csv": "400,400,0\n",
            "one.csv": "3,-2,45\n",
        }.items():
            (cls.prepared / file).write_text("x_mm,y_mm,theta_deg\n" + rows)

    def text(self, candidates: str, *more: str) -> str:
        return self.done(*command(candidates, *more))

    def plan(self, candidates: str, *more: str) -> Any:
        return json.loads(self.text(candidates, *more, "--json", "-"))

    def assert_ranked(self, candidates: list[Any], goal: str) -> None:
        """By this gain, and the parts of each add up."""
        gains = [candidate["gain"] for candidate in candidates]
        self.assertEqual(gains, sorted(gains, key=lambda gain: -gain[goal]))
        for gain in gains:
            self.assertAlmostEqual(gain["identity"] + gain["pose"], gain["both"], delta=1e-12)
            for part in ("identity", "pose", "both"):
                self.assertGreaterEqual(gain[part], 0)
                self.assertTrue(0 <= gain["standard_error"][part] < 0.3)

    def test_lists_no_flag_in_its_help_that_it_refuses(self) -> None:
        text = self.done("plan", "--help")
        for flag in ("--particles", "--resampling", "--augmented", "--seed"):
            self.assertNotIn(f"  {flag} ", text)
        self.assert_named(text, "  --filter ", "  --budget-ms ")

    def test_ranks_the_rows_of_a_table_by_either_filter(self) -> None:
        for filter in ("bounded", "histogram"):
            all = self.plan("c.csv", f"--filter={filter}")
            believed, ranked = all["believed"], all["candidates"]
            self.assertEqual((all["goal"], all["touches"], believed["best"]), ("both", 2, "A"))
            self.assertEqual("dropped_mass" in believed, filter == "bounded")
            entropy = believed["entropy"]
            self.assertAlmostEqual(entropy["identity"] + entropy["pose"], entropy["both"], delta=1e-12)
            self.assertEqual(len(ranked), 5)
            self.assert_ranked(ranked, "both")
            self.assertEqual(ranked[-1]["index"], 0, "400 mm away")
            self.assertAlmostEqual(ranked[-1]["gain"]["both"], 0, delta=1e-4)
            self.assertGreater(ranked[0]["gain"]["both"], 0.5)
            [third] = [candidate for candidate in ranked if candidate["index"] == 2]
            self.assertEqual((third["x_mm"], third["y_mm"]), (3, -2))
            self.assertAlmostEqual(third["theta_rad"], math.pi / 4)

    def test_takes_a_recordings_touches_or_a_grid_about_the_object(self) -> None:
        self.assertEqual(len(self.plan("u.h5")["candidates"]), 6)
        ranked = self.plan("grid", "--goal", "pose")["candidates"]
        self.assertTrue(100 <= len(ranked) <= 300)
        self.assert_ranked(ranked, "pose")
        # A letter of 25 mm about 4 mm from the robot's origin.
        self.assertLess(max(math.hypot(each["x_mm"], each["y_mm"]) for each in ranked), 40)

    def test_prints_the_ten_best_with_the_gain_of_its_goal_once(self) -> None:
        text = self.text("grid")
        self.assert_named(text, "touch next at x ", "gain nats", "\n  10  ")
        self.assertNotIn("\n  11  ", text)
        self.assertEqual(text[text.index("rank") :].count("+"), 11, "standard errors")
        for goal in ("identity", "pose"):
            text = self.text("one.csv", "--goal", goal)
            heading = text[text.index("rank") :].splitlines()[0]
            self.assertEqual((heading.count(goal), heading.count(f"{goal} nats")), (1, 1))
            self.assertIn(", 1 candidate in ", text)

    def test_says_what_recognize_says_of_the_touches(self) -> None:
        few = ("u.h5", "--maps", "maps", "--bins=6x6x4")
        [record] = self.records(*few)
        text = self.done("plan", *few, "--candidates", "c.csv")
        self.assertTrue(text.startswith("do not act: " + record["decision"]["because"]), text)
        self.assert_named(text, *(f"u.h5: {warning}" for warning in record["warnings"]))
        all = json.loads(self.done("plan", *few, "--candidates", "c.csv", "--json", "-"))
        self.assertLessEqual({*record["warnings"]}, {*all["warnings"]})

    def test_says_what_limits_the_gains(self) -> None:
        few = "2 samples cannot show more than 0.69 nats"
        self.assertIn(few, self.text("c.csv", "--samples=2"))
        self.assertTrue(any(few in words for words in self.plan("c.csv", "--samples=2")["warnings"]))
        # Two touches leave few of these bins, which the next touch still divides.
        text = self.text("c.csv", "--samples=512")
        self.assertIn("above what is unknown, which is counted in bins", text)
        text = self.text("far.csv")
        self.assertNotIn("the best gain", text)
        self.assertIn("of the pose, counted in bins", text)

    def test_recommends_no_touch_that_tells_nothing(self) -> None:
        (self.folder / "maps/I.map.h5").unlink()
        text = self.text("c.csv", "--goal=identity")
        self.assertIn("no candidate tells anything about the identity", text)
        self.assertNotIn("touch next", text)
        ranked = self.plan("c.csv", "--goal=identity")["candidates"]
        self.assert_ranked(ranked, "both")
        self.assertEqual(ranked[-1]["index"], 0, "400 mm away")

    def test_says_what_one_touch_and_the_lattice_cannot_tell(self) -> None:
        note = "one touch cannot tell"
        self.assertIn(note, self.text("one.csv", "--none", "--touches=1"))
        self.assertNotIn(note, self.text("one.csv", "--none"))
        complained = self.palpate(*command("one.csv", "--touch-sd-deg", "1")).stderr
        self.assertEqual(complained.count("does not resolve"), 1)
        self.assertIn("does not resolve touch-sd of 1 degrees", complained)

    def test_refuses_bad_input_in_one_line(self) -> None:
        for file, text in {
            "empty.csv": "x,y,theta\n",
            "space.csv": "tx,ty,tz,qx,qy,qz,qw\n1,2,3,0,0,0,1\n",
            "wrong.csv": "x,y,angle\n1,2,3\n",
            "nan.csv": "x_mm,y_mm,theta_rad\n1,2,3\nnan,nan,nan\n",
        }.items():
            (self.folder / file).write_text(text)
        self.assert_refused(["plan", "u.h5", "--maps", "maps"], "--candidates")
        self.assert_refused(command("none.csv"), "none.csv")
        self.assert_refused(command("empty.csv"), "empty.csv", "no row")
        self.assert_refused(command("space.csv"), "space.csv", "poses in space", "give x, y and theta")
        self.assert_refused(command("wrong.csv"), "wrong.csv", "'theta'", "rename its columns")
        wrong = self.palpate(*command("wrong.csv"), status=2).stderr
        self.assertNotIn("--pose-columns", wrong, "a flag of import")
        self.assert_refused(command("nan.csv"), "nan.csv", "pose 1", "unknown")
        self.assert_refused(command("grid", "--goal", "all"), "--goal all", "identity, pose or both")
        self.assert_refused(command("grid", "--samples", "1"), "--samples 1")
        self.assert_refused(command("grid", "--filter=particles"), "--filter particles", "histogram")

    def test_of_live_follows_each_estimate(self) -> None:
        sensor = "simulate:A,rate=100,seed=3,object=random,touches=3,speed=max"
        live = ["live", "--sensor", sensor, "--maps", "maps", "--bins=9x9x16"]
        for filter in ("histogram", "bounded"):
            more = ("--plan=both", "--filter", filter, "--json=live.jsonl")
            self.assertIn("touch next at x ", self.palpate(*live, *more).stdout)
            lines = [json.loads(line) for line in (self.folder / "live.jsonl").read_text().splitlines()]
            self.assertEqual(len(lines), 6)
            for estimate, planned in zip(lines[::2], lines[1::2], strict=True):
                self.assertIn("best", estimate, "the estimate does not wait for the plan")
                self.assertNotIn("next", estimate)
                for key in ("unknown", "touch"):
                    self.assertEqual(planned[key], estimate[key])
                self.assertEqual({*planned["next"]}, {"x_mm", "y_mm", "theta_rad", "gain"})
                self.assertGreater(planned["next"]["gain"]["both"], 0.1)
        self.assert_refused([*live, "--plan=all"], "--plan all", "identity, pose or both")
        self.assert_refused([*live, "--plan=both", "--filter=particles"], "--plan both", "histogram")
