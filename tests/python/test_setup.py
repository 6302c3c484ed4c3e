"""What touches say about their set-up, frames of objects, and records as attributes."""

import json
import pathlib

import numpy
import pytest

import palpate

from conftest import command


def touches(letter: str, seed: int) -> palpate.Recording:
    return palpate.simulate(letter, palpate.random_poses(60, seed=seed), seed=seed)


def test_a_wrong_order_is_found_as_the_command_finds_it(
    device: palpate.Device, tmp_path: pathlib.Path
) -> None:
    files = []
    for k, letter in enumerate("AEU"):
        sound = touches(letter, k + 1)
        turned = sound.pressure.reshape(60, 6, 6)[:, ::-1, :].reshape(60, 36)
        wrong = palpate.Recording(turned, sound.T_robot_sensor, sound.elements_mm, object=letter)
        files.append(tmp_path / f"{letter}.h5")
        wrong.save(files[-1])
    check = palpate.check_setup(files, device=device)
    [finding] = check.findings
    assert finding.what == "element_order" and "array_offset" not in finding
    assert "first_element='top-left' and order='rows'" in finding.words, finding.words
    assert check.elements_mm.shape == (36, 2) and check.elements_mm[0, 1] > 0
    assert finding.flag == "first_element='top-left' order='rows'" and check.touches > 150
    [told] = json.loads(command("check", *files, "--json", "-", "--write-array", tmp_path / "array.csv"))
    assert told["nats"] == finding.nats and told.keys() == finding.keys()
    array = numpy.loadtxt(tmp_path / "array.csv", delimiter=",", skiprows=1)
    assert numpy.array_equal(array, check.elements_mm)
    with pytest.raises(palpate.Error, match="four or more of every object"):
        palpate.check_setup(sound[:3], device=device)
    with pytest.raises(TypeError, match="'psf_mm'; give spread_mm, half of it"):
        palpate.check_setup(files, psf_mm=1.0)


def test_frames_of_objects(device: palpate.Device) -> None:
    learned = touches("E", 5)
    far = palpate.Recording(
        learned.pressure,
        [palpate.compose((600, 100, 0.3), pose) for pose in learned.T_robot_sensor],
        learned.elements_mm,
        object="E",
    )
    builder = palpate.MapBuilder(device)
    builder.add(far)
    grid = builder.build("E")
    assert grid.T_learned_robot_object.tolist() == [0, 0, 0]
    origin = grid.origin_mm.copy()
    grid.centre_frame()
    assert numpy.allclose(grid.T_learned_robot_object[:2], [600, 100], atol=3)
    assert numpy.allclose(origin - grid.origin_mm, grid.T_learned_robot_object[:2])
    # A histogram about the robot's origin would answer nothing; recognize() finds the object.
    belief = palpate.PoseHistogram(device, [grid])
    with pytest.raises(palpate.Error, match="lattice: missing or the default"):
        belief.update(far[:1])
    belief.move_pivot(far.T_robot_sensor[0, :2])
    belief.update(far[:1])
    [record] = palpate.recognize(far[:9], grid, device=device)
    assert numpy.allclose(record.refined.T_robot_object, grid.T_learned_robot_object, atol=0.5)


def test_records_complete_and_hold_arrays(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    [record] = palpate.recognize(unknown, maps, device=device)
    assert {"best", "refined", "mode"} <= set(dir(record))
    assert {"sd", "covariance", "keys"} <= set(dir(record.refined))
    assert record.refined.covariance.shape == (3, 3)
    assert record.refined.sd.tolist() == record["refined"]["sd"]
    assert record.mode.object == "E" and json.loads(json.dumps(record)) == record
    with pytest.raises(AttributeError, match="the record has no 'colour'; it has recording, "):
        record.colour  # noqa: B018
