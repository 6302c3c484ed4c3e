"""The functions of palpate.commands give the numbers of the commands, and refuse in their words."""

import json
import math
import pathlib
import re
from typing import Any, Literal

import numpy
import pytest
from conftest import Files, command, comparable, expect_refused
from matplotlib.figure import Figure

import palpate

SMALL = ["--bins", "10x10x8"]


# Evaluation


def record(truth: str, best: str, a: float, b: float, none: float, **more: object) -> dict[str, Any]:
    identity = {"A": a, "B": b, "(none)": none}
    return {"truth": {"object": truth}, "best": best, "identity": identity, "none": none, **more}


#: Four of known classes and two of M, which no map has; one without truth, and one with an error.
RECORDS = [
    record("A", "A", 0.9, 0.1, 0.0, error_mm=0.5, refined_error_mm=0.25),
    record("A", "B", 0.2, 0.8, 0.0, error_mm=None),
    record("B", "B", 0.05, 0.95, 0.0, error_mm=1.0, refined_error_mm=0.125),
    record("B", "(none)", 0.1, 0.3, 0.6),
    record("M", "(none)", 0.2, 0.1, 0.7, fit={"z": -5.0}),
    record("M", "A", 0.85, 0.1, 0.05, fit={"z": float("nan")}),
    {"best": "A", "identity": {"A": 1.0}},
    {"recording": "\udcff.h5", "touches": 0, "error": "is not there"},
]


def expect_scores(scores: palpate.Scores | None, expected: dict[str, Any]) -> None:
    assert scores is not None
    for name in ("records", "right", "accuracy", "log_loss", "calibration_error"):
        assert getattr(scores, name) == expected[name], name
    assert list(scores.accuracy_interval) == expected["accuracy_interval"]
    for given, row in zip(scores.reliability, expected["reliability"], strict=True):
        assert (given.lower, given.upper, given.records) == (row["lower"], row["upper"], row["records"])
        if given.records:
            assert given.mean_confidence == row["mean_confidence"]
            assert given.accuracy == row["accuracy"] == given.right / given.records
        else:
            assert math.isnan(given.accuracy)


def test_an_evaluation_has_the_numbers_of_the_command(tmp_path: pathlib.Path) -> None:
    finite = json.loads(json.dumps(RECORDS), parse_constant=lambda _: None)
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "r.json").write_text(json.dumps(finite[:-1]))
    (tmp_path / "failed.json").write_text('{"recording": "f.h5", "touches": 0, "error": "is not there"}')
    both = [tmp_path / "results", tmp_path / "failed.json"]
    expected = json.loads(command("evaluate", *both, "--json", "-"))
    for results in (RECORDS, both, [both[0], palpate.Record(RECORDS[-1])]):
        given = palpate.evaluate(results)
        expect_scores(given.all, expected)
        expect_scores(given.known, expected["known_classes"])
        assert given.unknown is not None
        assert given.unknown.right == expected["unknown_classes"]["called_none"] == 1
        area = expected["unknown_classes"]["area_under_curve"]
        for name, value in area.items():
            assert getattr(given.known_against_unknown, name) == value, name
        assert given.confusion.tolist() == expected["confusion"]["counts"]
        assert given.answers == expected["confusion"]["columns"]
        for scores, row in zip(given.classes, expected["classes"], strict=True):
            assert (scores.label, scores.known, scores.recall) == (
                row["class"], row["known"], row["recall"]
            )  # fmt: skip
            assert list(scores.recall_interval) == row["recall_interval"]
        assert given.error_mm == (expected["error_mm"]["median"], 2)
        assert given.refined_error_mm == (expected["refined_error_mm"]["median"], 2)
        assert (given.without_truth, given.failed) == (expected["without_truth"], 1)
        counts = [int(text.get_text()) for text in given.plot(Figure().add_subplot()).texts]
        assert counts == [count for row in expected["confusion"]["counts"] for count in row if count]
        [*_, accuracy, _] = given.all.plot(Figure().add_subplot()).lines
        assert [*zip(*accuracy.get_data(), strict=True)] == [
            (each.mean_confidence, each.accuracy) for each in given.all.reliability if each.records
        ]


def test_what_is_recognised_can_be_evaluated(files: Files) -> None:
    task: palpate.Task = {"maps": files.maps, "bins": (10, 10, 8)}
    records = palpate.recognize(files.unknown, files.maps, bins=(10, 10, 8))
    given = palpate.evaluate(records[0])
    assert (given.all.records, given.all.right) == (1, int(records[0].right))
    assert given.known is None and given.known_against_unknown is None
    assert palpate.evaluate(palpate.recognize_many(files.unknown, task)).error_mm == given.error_mm
    assert given.error_mm == (records[0].error_mm, 1)


def test_none_that_is_true_has_the_weight_of_the_flag_without_a_number(files: Files) -> None:
    [flag] = palpate.recognize(files.unknown, files.maps, none=True, bins=(10, 10, 8))
    [auto] = palpate.recognize(files.unknown, files.maps, none="auto", bins=(10, 10, 8))
    assert flag.identity == auto.identity


def test_what_is_no_record_with_a_truth_is_refused(tmp_path: pathlib.Path) -> None:
    (tmp_path / "r.json").write_text(json.dumps(RECORDS[6:7]))
    expect_refused(lambda: palpate.evaluate(tmp_path / "r.json"), "evaluate", tmp_path / "r.json")
    with pytest.raises(palpate.Error, match="^records: none of 1 record"):
        palpate.evaluate(RECORDS[6])
    with pytest.raises(palpate.Error, match="^records: record 1: field 'best' is missing"):
        palpate.evaluate([RECORDS[0], {"truth": {"object": "A"}}])
    with pytest.raises(palpate.Error, match="^records: record 0 is no JSON object"):
        palpate.evaluate([3])  # type: ignore[list-item]


# Plans


def planned(files: Files, *flags: object) -> dict[str, Any]:
    output = command("plan", files.unknown, "--maps", files.maps, "--json", "-", *SMALL, *flags)
    plan: dict[str, Any] = json.loads(output)
    return plan


def expect_plan(plan: palpate.Plan, expected: dict[str, Any]) -> None:
    candidates = expected["candidates"]
    assert plan.index.tolist() == [row["index"] for row in candidates]
    poses = [[row["x_mm"], row["y_mm"], row["theta_rad"]] for row in candidates]
    assert plan.T_robot_sensor.tolist() == poses
    for name in ("identity", "pose", "both"):
        assert getattr(plan.gains, name).tolist() == [row["gain"][name] for row in candidates]
        errors = [row["gain"]["standard_error"][name] for row in candidates]
        assert getattr(plan.gains, f"{name}_error").tolist() == errors
    entropy = expected["believed"].pop("entropy")
    assert (plan.identity_nats, plan.pose_nats) == (entropy["identity"], entropy["pose"])
    assert comparable(plan.believed) == comparable(expected["believed"])
    for name in ("recording", "touches", "goal", "samples", "seed", "device"):
        assert getattr(plan, name) == expected[name], name
    # Each face names options in its own words.
    assert len(plan.warnings) == len(expected.get("warnings", []))
    assert not any("--" in warning for warning in plan.warnings)


def test_a_plan_is_that_of_the_command(files: Files, tmp_path: pathlib.Path) -> None:
    fractions: list[float] = []
    plan = palpate.plan(
        files.unknown, files.maps, bins=(10, 10, 8), touches=2, goal="identity", samples=40,
        plan_seed=3, progress=fractions.append,
    )  # fmt: skip
    flags = ["--touches", 2, "--goal", "identity", "--samples", 40, "--plan-seed", 3]
    expect_plan(plan, planned(files, "--candidates", "grid", *flags))
    assert len(plan.index) > 50 and fractions[-1] == 1

    plan = palpate.plan(
        files.unknown, files.maps, bins=(10, 10, 8), touches=2, samples=40,
        filter="bounded", tolerance=1e-3, budget_ms=1e6,
    )  # fmt: skip
    flags = ["--touches", 2, "--samples", 40, "--tolerance", "1e-3", "--budget-ms", "1e6"]
    expect_plan(plan, planned(files, "--candidates", "grid", *flags))
    assert plan.device == "none" and "dropped_mass" in plan.believed
    hurried = palpate.plan(files.unknown, files.maps, bins="fine", touches=1, budget_ms=1e-6)
    assert hurried.believed.dropped_mass > 1e-5

    table = tmp_path / "poses.csv"
    table.write_text("x,y,theta\n0,0,0\n5,-3,1\n40,40,0\n")
    expected = planned(files, "--candidates", table, "--touches", 3)
    with pytest.warns(UserWarning, match="poses taken to be in mm and rad"):
        plan = palpate.plan(files.unknown, files.maps, candidates=table, bins=(10, 10, 8), touches=3)
    expect_plan(plan, expected)


def test_a_plan_takes_arrays_and_maps_in_memory(
    files: Files, device: palpate.Device, tmp_path: pathlib.Path
) -> None:
    maps = [palpate.read_map(path) for path in sorted(files.maps.iterdir())]
    unknown = palpate.read_recording(files.unknown)
    poses = unknown.T_robot_sensor[3:]
    plan = palpate.plan(
        unknown, maps, candidates=poses, device=device, bins=(10, 10, 8), frames=(0, 3)
    )
    rows = [",".join(map(repr, pose)) for pose in poses.tolist()]
    (tmp_path / "poses.csv").write_text("\n".join(["x_mm,y_mm,theta_rad", *rows]) + "\n")
    expected = planned(files, "--candidates", tmp_path / "poses.csv", "--frames", "0:3")
    assert plan.believed.mode.pop("map") == "map 'E'"
    expected["believed"]["mode"].pop("map")
    expect_plan(plan, expected)
    assert numpy.array_equal(plan.T_robot_sensor, poses[plan.index])


@pytest.mark.parametrize(
    ("flags", "options"),
    [
        (["--candidates", "grid", "--samples", 1], {"samples": 1}),
        (["--candidates", "grid", "--goal", "size"], {"goal": "size"}),
        (["--candidates", "grid", "--touches", 99], {"touches": 99}),
        (["--candidates", "grid", "--gamma", 2], {"gamma": 2}),
        (["--candidates", "none.csv"], {"candidates": "none.csv"}),
    ],
)
def test_a_plan_is_refused_in_the_words_of_the_command(
    files: Files, flags: list[Any], options: dict[str, Any]
) -> None:
    expect_refused(
        lambda: palpate.plan(files.unknown, files.maps, **options),
        "plan", files.unknown, "--maps", files.maps, *flags,
    )  # fmt: skip


def test_candidates_that_are_no_poses_are_refused(files: Files) -> None:
    cases: list[tuple[Any, str]] = [
        (numpy.zeros((2, 2)), r"candidates: shape \(2, 2\); give \(n, 3\)"),
        (numpy.zeros((0, 3)), "^candidates: holds no pose"),
        ([[numpy.nan, 0, 0]], "^candidates: pose 0 .* is unknown or out of reach"),
    ]
    for candidates, message in cases:
        with pytest.raises(palpate.Error, match=message):
            palpate.plan(files.unknown, files.maps, candidates=candidates)
    with pytest.raises(TypeError, match="not list"):  # a plan is of one recording
        palpate.plan([files.unknown], files.maps)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="unexpected keyword argument 'each_frame'"):
        palpate.plan(files.unknown, files.maps, each_frame=True)  # type: ignore[call-arg]


# Calibration


@pytest.fixture(scope="module")
def presses(tmp_path_factory: pytest.TempPathFactory) -> list[pathlib.Path]:
    """Ten touches of each of two letters, all over them."""
    folder = tmp_path_factory.mktemp("presses")
    paths = []
    for letter in "AU":
        palpate.simulate(letter, palpate.training_grid()[::19]).save(folder / f"{letter}.h5")
        paths.append(folder / f"{letter}.h5")
    return paths


@pytest.mark.parametrize(
    ("flags", "options"),
    [
        (["--bins", "6x6x6", "--theta-deg", "0:180", "--levels", 3],
         {"bins": (6, 6, 6), "theta_deg": (0, 180), "levels": 3}),
        (["--unposed", "--layer", "log_odds", "--max-maps", 1, "--threshold", 2],
         {"unposed": True, "layer": "log_odds", "max_maps": 1, "threshold": 2}),
    ],
)  # fmt: skip
def test_a_calibration_is_that_of_the_command(
    presses: list[pathlib.Path], tmp_path: pathlib.Path, flags: list[Any], options: dict[str, Any]
) -> None:
    said = command("calibrate", *presses, "-o", tmp_path / "command.yaml", *flags)
    fractions: list[float] = []
    given = palpate.calibrate(
        [presses[0], palpate.read_recording(presses[1])], progress=fractions.append, **options
    )
    given.sensor.save(tmp_path / "module.yaml")
    assert (tmp_path / "module.yaml").read_bytes() == (tmp_path / "command.yaml").read_bytes()
    scores = (given.before, given.table, given.after)
    for name, text in [
        ("touches", "{0.records}"), ("log-loss, nats", "{0.log_loss:.3f}"),
        ("calibration error", "{0.calibration_error:.3f}"),
    ]:  # fmt: skip
        [row] = re.findall(rf"cross-validation[^$]*?^{name} +(.*)$", said, re.MULTILINE)
        assert row.split() == [text.format(one) for one in scores]
    assert given.objects == 2 and fractions == sorted(fractions) and fractions[-1] == 1
    sensor = given.sensor
    assert sensor.layer == ("log_odds" if "layer" in options else "mean_level")
    levels = len(sensor.level_edges) + 2
    assert sensor.log_likelihood.shape == (levels, 49)
    assert numpy.allclose(numpy.exp(sensor.log_likelihood).sum(axis=0), 1)
    lines = sensor.plot(Figure().add_subplot()).lines
    assert numpy.allclose(sum(line.get_ydata() for line in lines), 1)
    assert [*lines[0].get_xdata()[[0, -1]]] == [-8, 8] and len(lines) == levels
    assert (sensor.classifier.threshold == 2) == ("threshold" in options)
    assert sensor.stranger_sd is None
    assert ("goes by a figure of Palpate's own for how badly strangers fit" in said) == ("bins" in options)


@pytest.mark.parametrize(
    ("flags", "options", "spelled"),
    [
        (["--ratio", 1], {"ratio": 1}, {"--ratio 1": "ratio=1"}),
        (["--levels", 1], {"levels": 1}, {"--levels 1": "levels=1"}),
        (["--layer", "both"], {"layer": "both"}, {"--layer both": "layer='both'"}),
        (["--max-maps", 0], {"max_maps": 0}, {"--max-maps 0": "max_maps=0"}),
        (["--group", "day"], {"group": "day"}, {"--group day": "group='day'"}),
        (["--group", "label"], {"group": "label"}, {"--group recording": "group='recording'"}),
        (["--unposed", "--x-mm=-1:1"], {"unposed": True, "x_mm": (-1, 1)},
         {"--bins, --x-mm, --y-mm, --theta-deg and --pivot-mm":
          "bins=, x_mm=, y_mm=, theta_deg= and pivot_mm="}),
        (["--frames", "0:99"], {"frames": (0, 99)}, {}),
    ],
)  # fmt: skip
def test_calibrations_are_refused_in_the_words_of_the_command(
    presses: list[pathlib.Path], flags: list[Any], options: dict[str, Any], spelled: dict[str, str]
) -> None:
    expect_refused(
        lambda: palpate.calibrate(presses, **options),
        "calibrate", *presses, "-o", presses[0].with_name("s.yaml"), *flags, spelled=spelled,
    )  # fmt: skip


def test_calibrations_that_cannot_be_are_refused(
    presses: list[pathlib.Path], files: Files
) -> None:
    expect_refused(
        lambda: palpate.calibrate(presses, maps=files.maps),
        "calibrate", *presses, "-o", presses[0].with_name("s.yaml"), "--maps", files.maps,
        spelled={"--unposed or --sensor-model": "unposed= or sensor_model=",
                 "--layer log_odds": "layer='log_odds'"},
    )  # fmt: skip
    with pytest.raises(TypeError, match="bins: 'auto'; give counts"):
        palpate.calibrate(presses, bins="auto")  # type: ignore[arg-type]
    with pytest.raises(palpate.Error, match=r"^recordings\[0\]: attribute 'object' is empty"):
        recording = palpate.read_recording(presses[0])
        palpate.calibrate(palpate.Recording(recording.pressure, recording.T_robot_sensor,
                                            recording.elements_mm))  # fmt: skip


def test_a_calibration_can_be_given_up(presses: list[pathlib.Path]) -> None:
    def give_up(_: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        palpate.calibrate(presses, progress=give_up)


def test_the_programs_of_the_guide_run(
    files: Files, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (pathlib.Path(__file__).parents[2] / "docs" / "python.md").read_text()
    [section] = re.findall(r"\n## From tables to the next touch\n(.*?)\n## ", page, re.DOTALL)
    programs = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    assert len(programs) == 6
    (tmp_path / "maps").symlink_to(files.maps)
    palpate.read_recording(files.unknown)[:3].save(tmp_path / "unknown.h5")
    readings = numpy.column_stack([numpy.linspace(0, 2, 3), numpy.ones((3, 36))])
    numpy.savetxt(tmp_path / "pressures.csv", readings, delimiter=",")
    (tmp_path / "poses.csv").write_text("time,x,y,theta\n0,1,2,0\n1,2,3,1\n2,4,5,2\n")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec("".join(programs), names)
    assert names["logged"].T_robot_sensor[0].tolist() == [1000, 2000, 0]
    assert (tmp_path / "sensor.yaml").exists()
    assert names["calibration"].objects == 2
    assert sorted(file.name for file in (tmp_path / "learned").iterdir()) == ["A.map.h5", "E.map.h5"]
    assert names["evaluation"].all.records == 1 and len(names["plan"].T_robot_sensor) > 10
