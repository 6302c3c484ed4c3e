"""What is Python's own of the functions that have the numbers of commands: arguments and results."""

import json
import pathlib
import re
from typing import Any

import numpy
import pytest
from conftest import Files, error_of, printed, warned
from matplotlib.figure import Figure

import palpate
from palpate import _palpate


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


def test_an_evaluation_of_records_and_files_is_that_of_the_command(tmp_path: pathlib.Path) -> None:
    finite = json.loads(json.dumps(RECORDS), parse_constant=lambda _: None)
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "r.json").write_text(json.dumps(finite[:-1]))
    (tmp_path / "failed.json").write_text('{"recording": "f.h5", "touches": 0, "error": "is not there"}')
    both = [tmp_path / "results", tmp_path / "failed.json"]
    expected = printed("evaluate", *both)
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
    for records, words in (
        (RECORDS[6], "records: none of 1 record"),
        ([RECORDS[0], {"truth": {"object": "A"}}], "records: record 1: field 'best' is missing"),
        ([3], "records: record 0 is no JSON object"),
    ):
        assert error_of(palpate.evaluate, records).startswith(words)


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


def test_a_plan_takes_arrays_and_maps_in_memory(files: Files, device: palpate.Device) -> None:
    maps = [palpate.read_map(path) for path in sorted(files.maps.iterdir())]
    unknown = palpate.read_recording(files.unknown)
    poses = unknown.T_robot_sensor[3:]
    plan = palpate.plan(
        unknown, maps, candidates=poses, device=device, bins=(10, 10, 8), frames=(0, 3)
    )
    assert plan.believed.mode["map"] == "map 'E'"
    assert numpy.array_equal(plan.T_robot_sensor, poses[[one.index for one in plan.candidates]])
    hurried = palpate.plan(files.unknown, files.maps, bins="fine", touches=1, budget_ms=1e-6)
    assert hurried.believed.dropped_mass > 1e-5 and hurried.device == "none"


@pytest.mark.parametrize(
    ("candidates", "words"),
    [
        (numpy.zeros((2, 2)), r"candidates: shape \(2, 2\); give \(n, 3\)"),
        (numpy.zeros((0, 3)), "^candidates: holds no pose"),
        ([[numpy.nan, 0, 0]], "^candidates: pose 0 .* is unknown or out of reach"),
    ],
)
def test_candidates_that_are_no_poses_are_refused(files: Files, candidates: Any, words: str) -> None:
    assert re.search(words, error_of(palpate.plan, files.unknown, files.maps, candidates=candidates))


def test_arguments_of_another_type_are_refused(files: Files, presses: list[pathlib.Path]) -> None:
    calls: list[tuple[Any, list[Any], dict[str, Any], str]] = [
        (palpate.plan, [[files.unknown], files.maps], {}, "recordings: holds a list"),  # a plan is of one
        (palpate.plan, [files.unknown], {"each_frame": True}, "unexpected keyword argument 'each_frame'"),
        (palpate.calibrate, [presses], {"bins": "auto"}, "bins: 'auto'; give counts"),
        (palpate.learn_maps, [presses], {"cell_mm": "wide"}, r"^cell_mm: 'wide'; give float \| None"),
        (palpate.import_tables, [files.folder / "p.csv"], {"array": (2, 2, 1), "rate": "fast"},
         "rate: 'fast'; give float"),
    ]  # fmt: skip
    for call, arguments, options, words in calls:
        with pytest.raises(TypeError, match=words):
            call(*arguments, **options)


def test_calibrations_that_cannot_be_are_refused(presses: list[pathlib.Path]) -> None:
    for option, value in {"layer": "both", "levels": 1, "max_maps": 0, "group": "day", "ratio": 1}.items():
        assert error_of(palpate.calibrate, presses, **{option: value}).startswith(f"{option}={value!r}")
    touches = palpate.read_recording(presses[0])
    unnamed = palpate.Recording(touches.pressure, touches.T_robot_sensor, touches.elements_mm)
    assert error_of(palpate.calibrate, unnamed).startswith("recordings[0]: attribute 'object' is empty")


def test_a_calibration_can_be_given_up(presses: list[pathlib.Path]) -> None:
    def give_up(_: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        palpate.calibrate(presses, progress=give_up)


def test_a_learned_sensor_is_drawn(presses: list[pathlib.Path]) -> None:
    calibration = palpate.calibrate(presses, bins=(6, 6, 6), theta_deg=(0, 180), levels=3)
    sensor = calibration.sensor
    levels = len(sensor.level_edges) + 2
    assert sensor.layer == "mean_level" and sensor.log_likelihood.shape == (levels, 49)
    assert numpy.allclose(numpy.exp(sensor.log_likelihood).sum(axis=0), 1)
    lines = calibration.plot(Figure().add_subplot()).lines
    assert numpy.allclose(sum(line.get_ydata() for line in lines), 1)
    assert [*lines[0].get_xdata()[[0, -1]]] == [-8, 8] and len(lines) == levels
    assert sensor.stranger_sd is None


def test_options_that_learn_maps_shares_with_recognition_are_those_of_its_table() -> None:
    shared = {"threshold", "ratio", "sensor_model", "touch_sd_mm", "touch_sd_deg", "frames", "device"}
    assert set(_palpate.Request.options()) >= shared
    assert palpate.learn_maps.__kwdefaults__.keys() >= shared


def test_what_the_command_warns_of_is_a_warning() -> None:
    recording = palpate.simulate("A", numpy.zeros((5, 3)), seed=1)
    _, said = warned(palpate.learn_maps, recording, sensor_model="none")
    assert re.search("all 5 touches are at one pose.*give unposed=", said)


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
