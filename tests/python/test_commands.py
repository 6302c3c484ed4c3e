"""The functions of palpate.commands give the numbers of the commands, and refuse in their words."""

import json
import pathlib
import re
from typing import Any

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


def test_an_evaluation_is_the_json_of_the_command(tmp_path: pathlib.Path) -> None:
    finite = json.loads(json.dumps(RECORDS), parse_constant=lambda _: None)
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "r.json").write_text(json.dumps(finite[:-1]))
    (tmp_path / "failed.json").write_text('{"recording": "f.h5", "touches": 0, "error": "is not there"}')
    both = [tmp_path / "results", tmp_path / "failed.json"]
    expected = json.loads(command("evaluate", *both, "--json", "-"))
    for results in (RECORDS, both, [both[0], palpate.Record(RECORDS[-1])]):
        given = palpate.evaluate(results)
        assert given == expected
    assert (given.without_truth, given.failed) == (1, 1)
    assert given.known_classes.accuracy_interval.tolist() == expected["known_classes"]["accuracy_interval"]
    counts = [int(text.get_text()) for text in given.plot(Figure().add_subplot()).texts]
    assert counts == [count for row in expected["confusion"]["counts"] for count in row if count]
    for scores in (given.all, given.known_classes):
        [*_, accuracy, _] = scores.plot(Figure().add_subplot()).lines
        assert [*zip(*accuracy.get_data(), strict=True)] == [
            (each.mean_confidence, each.accuracy) for each in scores.reliability if each.records
        ]


def test_what_is_recognised_can_be_evaluated(files: Files) -> None:
    task: palpate.Task = {"maps": files.maps, "bins": (10, 10, 8)}
    records = palpate.recognize(files.unknown, files.maps, bins=(10, 10, 8))
    given = palpate.evaluate(records[0])
    assert (given.all.records, given.all.right) == (1, int(records[0].right))
    assert "known_classes" not in given and "unknown_classes" not in given
    assert palpate.evaluate(palpate.recognize_many(files.unknown, task)) == given
    assert given.error_mm == {"records": 1, "median": records[0].error_mm}


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


def comparable_plan(plan: dict[str, Any]) -> dict[str, Any]:
    return {**comparable(plan), "believed": comparable(plan["believed"])}


def test_a_plan_is_the_json_of_the_command(files: Files, tmp_path: pathlib.Path) -> None:
    fractions: list[float] = []
    plan = palpate.plan(
        files.unknown, files.maps, bins=(10, 10, 8), touches=2, goal="identity", samples=40,
        plan_seed=3, progress=fractions.append,
    )  # fmt: skip
    flags = ["--touches", 2, "--goal", "identity", "--samples", 40, "--plan-seed", 3]
    assert comparable_plan(plan) == comparable_plan(planned(files, "--candidates", "grid", *flags))
    assert not any("--" in warning for warning in [*plan.get("warnings", ()), *plan.believed.get("warnings", ())])
    assert len(plan.candidates) > 50 and fractions[-1] == 1
    first = plan.candidates[0]
    assert plan.T_robot_sensor[0].tolist() == [first.x_mm, first.y_mm, first.theta_rad]
    assert repr(plan.believed).startswith("Record(")

    hurried = palpate.plan(files.unknown, files.maps, bins="fine", touches=1, budget_ms=1e-6)
    assert hurried.believed.dropped_mass > 1e-5 and hurried.device == "none"

    table = tmp_path / "poses.csv"
    table.write_text("x,y,theta\n0,0,0\n5,-3,1\n40,40,0\n")
    expected = planned(files, "--candidates", table, "--touches", 3)
    with pytest.warns(UserWarning, match="poses taken to be in mm and rad"):
        plan = palpate.plan(files.unknown, files.maps, candidates=table, bins=(10, 10, 8), touches=3)
    assert comparable_plan(plan) == comparable_plan(expected)


def test_a_plan_takes_arrays_and_maps_in_memory(files: Files, device: palpate.Device) -> None:
    maps = [palpate.read_map(path) for path in sorted(files.maps.iterdir())]
    unknown = palpate.read_recording(files.unknown)
    poses = unknown.T_robot_sensor[3:]
    plan = palpate.plan(
        unknown, maps, candidates=poses, device=device, bins=(10, 10, 8), frames=(0, 3)
    )
    assert plan.believed.mode["map"] == "map 'E'"
    assert numpy.array_equal(plan.T_robot_sensor, poses[[one.index for one in plan.candidates]])


def test_a_plan_is_refused_in_the_words_of_the_command(files: Files) -> None:
    expect_refused(
        lambda: palpate.plan(files.unknown, files.maps, samples=1),
        "plan", files.unknown, "--maps", files.maps, "--candidates", "grid", "--samples", 1,
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


def test_a_calibration_is_that_of_the_command(
    presses: list[pathlib.Path], tmp_path: pathlib.Path
) -> None:
    flags = ["--bins", "6x6x6", "--theta-deg", "0:180", "--levels", 3]
    said = command("calibrate", *presses, "-o", tmp_path / "command.yaml", *flags)
    fractions: list[float] = []
    given = palpate.calibrate(
        [presses[0], palpate.read_recording(presses[1])],
        bins=(6, 6, 6), theta_deg=(0, 180), levels=3, progress=fractions.append,
    )  # fmt: skip
    given.sensor.save(tmp_path / "module.yaml")
    assert (tmp_path / "module.yaml").read_bytes() == (tmp_path / "command.yaml").read_bytes()
    rows = re.findall(r"^log-loss, nats +(.*)$", said, re.MULTILINE)
    for row, scores in zip(rows, (given, given.groups), strict=True):
        told = (scores.before, scores.table, scores.after)
        assert row.split() == [f"{one.log_loss:.3f}" for one in told]
    assert given.objects == 2 and fractions == sorted(fractions) and fractions[-1] == 1
    assert repr(given) == f"SensorCalibration(2 objects, {given.after.right} of {given.after.records} touches right)"
    assert json.loads(json.dumps(given)) == given and given.tried[0].layer == "mean_level"
    sensor = given.sensor
    levels = len(sensor.level_edges) + 2
    assert sensor.layer == "mean_level" and sensor.log_likelihood.shape == (levels, 49)
    assert numpy.allclose(numpy.exp(sensor.log_likelihood).sum(axis=0), 1)
    lines = given.plot(Figure().add_subplot()).lines
    assert numpy.allclose(sum(line.get_ydata() for line in lines), 1)
    assert [*lines[0].get_xdata()[[0, -1]]] == [-8, 8] and len(lines) == levels
    assert sensor.stranger_sd is None


def test_calibrations_that_cannot_be_are_refused(presses: list[pathlib.Path]) -> None:
    expect_refused(
        lambda: palpate.calibrate(presses, unposed=True, x_mm=(-1, 1)),
        "calibrate", *presses, "-o", presses[0].with_name("s.yaml"), "--unposed", "--x-mm=-1:1",
        spelled={"--bins, --x-mm, --y-mm, --theta-deg and --pivot-mm":
                 "bins=, x_mm=, y_mm=, theta_deg= and pivot_mm="},
    )  # fmt: skip
    for options, message in [
        ({"layer": "both"}, "^layer='both'"), ({"levels": 1}, "^levels=1"), ({"max_maps": 0}, "^max_maps=0"),
        ({"group": "day"}, "^group='day'"), ({"ratio": 1}, "^ratio=1"),
    ]:  # fmt: skip
        with pytest.raises(palpate.Error, match=message):
            palpate.calibrate(presses, **options)  # type: ignore[arg-type]
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
