"""The programs over real arrays, on small data of the same layout from the simulated sensor."""

import math
import pathlib

import numpy
import pytest
from conftest import Program, expect_refused, run

import palpate
from bench import contact_learning
from bench.contact_array import AS_BUILT, COLUMNS, PITCH_MM, PIXEL_MM, ROWS, WINDOW
from bench.contact_array import Press, Registration, Shifts, read_presses, touched
from bench.contact_learning import Learned, Learning, PoseErrors, Settings
from bench.presses import region_of, scores, together

SHIFT_MM = numpy.array([1.5, -1.0])  # of the readings beside the contact


def write_presses(path: pathlib.Path, people: int, each: int) -> None:
    """Presses of three ellipses on the sheet, each somewhere else and as large as a finger's contact."""
    random = numpy.random.default_rng(1)
    count = people * each
    turns = numpy.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
    sheet_mm = numpy.stack(numpy.meshgrid(numpy.arange(COLUMNS), numpy.arange(ROWS)), axis=-1)
    places_mm = PITCH_MM * sheet_mm.reshape(-1, 2) + 3.5 * PIXEL_MM
    pixels = numpy.meshgrid(numpy.arange(8 * COLUMNS), numpy.arange(8 * ROWS))
    pixels_mm = PIXEL_MM * numpy.stack(pixels, axis=-1)
    readings = numpy.zeros((count, ROWS * COLUMNS))
    contact = numpy.zeros((count, 8 * ROWS, 8 * COLUMNS), bool)
    for finger, axes_mm in enumerate(((7.0, 4.0), (5.0, 5.0), (9.0, 4.0))):
        shape = path.parent / f"finger{finger}.txt"
        outline = axes_mm * numpy.column_stack([numpy.cos(turns), numpy.sin(turns)])
        shape.write_text("".join(f"{x} {y}\n" for x, y in outline))
        fingers = random.uniform((110.0, 40.0, 0.0), (230.0, 150.0, math.pi), (count, 3))
        shifted = fingers + (*SHIFT_MM, 0.0)
        touches = palpate.simulate(
            shape, [palpate.inverse(pose) for pose in shifted], elements_mm=places_mm, seed=finger + 1,
            sensor=palpate.SensorModel(psf_mm=3.0, element_mm=4.7),
        )  # fmt: skip
        readings += 45.0 * touches.pressure
        for press, pose in enumerate(fingers):
            inside = palpate.transform(palpate.inverse(pose), pixels_mm.reshape(-1, 2)) / axes_mm
            contact[press] |= (numpy.hypot(*inside.T) < 1.0).reshape(contact[press].shape)
    numpy.savez(
        path,
        capacitance=readings.reshape(count, ROWS, COLUMNS).astype(numpy.int16),
        mask_bits=numpy.packbits(contact.reshape(count, -1), axis=1),
        participant=numpy.repeat(numpy.arange(people), each).astype(numpy.int8),
    )


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    folder = tmp_path_factory.mktemp("capcontact")
    write_presses(folder / "presses.npz", people=4, each=6)
    presses = dict(numpy.load(folder / "presses.npz"))
    for name, kept in (("held_out.npz", slice(18, None)), ("presses.npz", slice(18))):
        numpy.savez(folder / name, **{key: of[kept] for key, of in presses.items()})
    return folder


def test_windows_become_touches_of_the_press(data: pathlib.Path) -> None:
    press = read_presses(data / "presses.npz")[0]
    windows = press.windows(numpy.random.default_rng(2), 20)
    T_robot_object = [3.0, -4.0, 0.5]
    touches = touched(press, windows, AS_BUILT, T_robot_object, "press")
    at_rest = touched(press, windows, AS_BUILT)
    j, i = windows[0]
    assert touches.pressure[0].reshape(WINDOW, WINDOW)[2, 5] == press.readings[j + 2, i + 5]
    element = palpate.transform(at_rest.T_robot_sensor[0], at_rest.elements_mm)[2 * WINDOW + 5]
    in_sheet = PITCH_MM * numpy.array([i + 5, j + 2]) + 3.5 * PIXEL_MM
    assert element + press.centroid_mm == pytest.approx(in_sheet)
    for moved, pose in zip(touches.T_robot_sensor, at_rest.T_robot_sensor, strict=True):
        assert moved == pytest.approx(palpate.compose(T_robot_object, pose))


def test_tiles_lie_side_by_side_where_a_finger_is_felt(data: pathlib.Path) -> None:
    for press in read_presses(data / "presses.npz"):
        covered = numpy.zeros((ROWS, COLUMNS), int)
        for j, i in press.tiles():
            covered[j : j + WINDOW, i : i + WINDOW] += 1
        assert covered.max() == 1 and press.seen(press.tiles()) == 1.0
    readings = numpy.zeros((ROWS, COLUMNS))
    readings[12, 20] = 400.0
    assert press._replace(readings=readings).tiles().tolist() == [[11, 18]]


def test_a_registration_is_fitted_without_a_person_and_what_lies_far_off() -> None:
    random = numpy.random.default_rng(3)
    true = Registration(random.normal(0.0, 1.0, (6, 2)))
    places_mm = random.uniform((0.0, 0.0), (345.0, 197.0), (4000, 2))
    shifts_mm = true.shift_mm(places_mm) + random.normal(0.0, 0.01, (4000, 2))
    people = numpy.repeat([1, 2], 2000)
    shifts_mm[people == 2] += 3.0
    shifts_mm[:50] -= 4.0
    fitted = Shifts(people, places_mm, shifts_mm).registration(without={2})
    assert fitted.coefficients == pytest.approx(true.coefficients, abs=0.05)
    windows = numpy.array([[10, 20]])
    pose = fitted.poses(windows)[0]
    element_mm = AS_BUILT.poses(windows)[0, :2] + (0.0, 0.1)
    seen = element_mm - fitted.shift_mm(element_mm[None])[0]
    stretched = seen - pose[:2]
    assert math.hypot(*stretched) == pytest.approx(0.1, rel=0.1)


def test_the_scale_of_poses_is_what_errors_have() -> None:
    random = numpy.random.default_rng(4)
    covariance = 0.04 * numpy.eye(3)
    errors = random.normal(0.0, math.sqrt(4.0 * 0.04), (400, 3))
    errors[0] = (30.0, 0.0, 0.0)  # another mode
    factor, sd_mm = PoseErrors(errors, numpy.repeat(covariance[None], 400, axis=0)).scale()
    assert factor * 0.04 + sd_mm**2 == pytest.approx(0.16, rel=0.1)


class Asked(Learning):
    """Learns nothing: the errors are those that are given by settings, and what is asked for is noted."""

    def __init__(self, data: pathlib.Path, folder: pathlib.Path, errors_mm: dict[Settings, float]) -> None:
        super().__init__(palpate.Device.open(), read_presses(data / "presses.npz"), folder, quick=True)
        self._choices = list(errors_mm)
        self.errors_mm = errors_mm
        self.asked: list[tuple[frozenset[int], int]] = []

    def _learn(self, settings: Settings, without: frozenset[int]) -> Learned:
        sensor = self._folder / "sensor.yaml"
        sensor.write_text("version: 1\ntable:\n")
        return Learned(settings, AS_BUILT, sensor)

    def _errors_of(self, settings: Settings, without: frozenset[int], person: int) -> PoseErrors:
        self.asked.append((without, person))
        moved = numpy.random.default_rng(person).normal(0.0, self.errors_mm[settings], (100, 3))
        return PoseErrors(moved, numpy.repeat(1e-6 * numpy.eye(3)[None], 100, axis=0))


def test_settings_and_pose_scale_are_those_of_people_left_out(
    data: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    worse, better = Settings(1.0, 7), Settings(2.0, 5)
    learning = Asked(data, tmp_path, {worse: 0.9, better: 0.5})
    learned = learning.without(frozenset({1}))
    assert set(learning.asked) == {(frozenset({0, 1}), 0), (frozenset({1, 2}), 2)}
    assert learned.settings == better
    assert learned.pose_scale[1] == pytest.approx(0.5, abs=0.051)
    assert "map_sd_mm: 0.5" in learned.sensor.read_text()
    learning.asked.clear()
    learning.without(frozenset())
    assert set(learning.asked) == {(frozenset({person}), person) for person in (0, 1, 2)}
    with pytest.raises(palpate.Error, match="three people or more"):
        learning.without(frozenset({0, 2}))


def test_presses_are_recognised(
    data: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Takes some ten seconds of a processor: a sensor is learned without each two of the three people.
    monkeypatch.setattr(contact_learning, "CHOICES", contact_learning.CHOICES[:1])
    plots = tmp_path / "plots"
    program = Program(tmp_path, "bench.capcontact", "--quick", "--data", data, "--plots", plots)
    held_out, in_turn = program.document, program.document["in_turn"]
    assert set(held_out["settings"]) == {"3"} and set(in_turn["settings"]) == {"0", "1", "2"}
    for regime in (held_out, in_turn):
        eq7, learned = (regime[name]["windows"] for name in ("eq7", "learned"))
        assert set(eq7) == set(learned) == {"1", "2", "3", "5", "all"}
        assert learned["5"]["recognised"] > 0.7
        assert learned["5"]["median_mm"] < 1.0 and learned["5"]["median_deg"] < 1.5
        assert math.hypot(*learned["5"]["bias_mm"]) < 0.7
        assert math.hypot(*eq7["5"]["bias_mm"]) > 1.0, "the readings lie beside the contact"
        assert 0.0 <= learned["5"]["coverage_68"] <= learned["5"]["coverage_95"] <= 1.0
    program.expect_charts("capcontact")
    assert (plots / "capcontact_press.png").stat().st_size > 10_000


def test_what_is_no_data_is_refused_and_presses_without_contact_are_left_out(tmp_path: pathlib.Path) -> None:
    expect_refused(run("bench.capcontact", "--data", tmp_path), "presses.npz")
    file = tmp_path / "presses.npz"
    numpy.savez(file, capacitance=[1], mask_bits=[2], participant=[3])
    expect_refused(run("bench.capcontact", "--data", tmp_path), "capacitance has the shape (1,)")
    masks = numpy.zeros((2, 8 * ROWS * 8 * COLUMNS), bool)
    masks[1, 1000:1010] = True
    numpy.savez(
        file, capacitance=numpy.zeros((2, ROWS, COLUMNS), numpy.int16), mask_bits=numpy.packbits(masks, axis=1),
        participant=numpy.zeros(2, numpy.int8),
    )  # fmt: skip
    (press,) = read_presses(file)
    assert isinstance(press, Press) and press.contact.sum() == 10


def test_presses_of_one_object_add_up() -> None:
    weak, strong = ({"identity": {"A": p, "B": 1.0 - p}, "truth": {"object": "A"}} for p in (0.6, 0.9))
    both = together([weak, strong])
    assert both["A"] == pytest.approx(0.54 / 0.58) and sum(both.values()) == pytest.approx(1.0)
    wrong = {"identity": {"A": 0.3, "B": 0.7}, "truth": {"object": "A"}}
    random = numpy.random.default_rng(5)
    assert scores([weak, strong, wrong], 1, random)["recognised"]["mean"] == pytest.approx(2 / 3)
    assert scores([weak, strong, wrong], 3, random)["recognised"]["mean"] == 1.0


def test_presses_are_told_apart_by_bins_of_a_pitch_and_ten_degrees() -> None:
    region = region_of(1.9)
    for (lower, upper), bins in zip((region["x_mm"], region["y_mm"]), region["bins"], strict=False):
        assert (upper - lower) / bins == pytest.approx(1.9) and -lower == upper > 14 * 1.9
    assert 360.0 / region["bins"][2] == 10.0


def test_objects_pressed_anywhere_are_recognised(tmp_path: pathlib.Path) -> None:
    for seed, letter in enumerate("BEP", start=1):
        palpate.simulate(
            letter, palpate.random_poses(20, seed), elements_mm=palpate.grid_array(12, 12, 2.5), seed=seed
        ).save(tmp_path / f"{letter}.h5")
    # Takes some seconds of a processor, to learn a sensor from presses at unknown poses.
    document = Program(tmp_path, "bench.presses", "--quick", "--data", tmp_path).document
    for sensor in ("eq7", "learned"):
        of_sensor = document[sensor]["presses"]
        assert {one["unknowns"] for one in of_sensor.values()} == {30}
        assert of_sensor["3"]["recognised"]["mean"] > 0.7, "chance is a third"
        assert of_sensor["5"]["recognised"]["mean"] > 0.9, "in a region that holds the presses"
