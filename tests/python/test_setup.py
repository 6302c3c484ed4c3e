"""What touches say about their set-up, and frames of objects."""

import json
import pathlib
from typing import Any

import numpy
from conftest import built, command, error_of

import palpate


def touches(letter: str, seed: int) -> palpate.Recording:
    return palpate.simulate(letter, palpate.random_poses(30, seed=seed), seed=seed)


def test_a_wrong_order_is_found_as_the_command_finds_it(
    device: palpate.Device, tmp_path: pathlib.Path
) -> None:
    files = [tmp_path / f"{letter}.h5" for letter in "AEU"]
    for seed, file in enumerate(files, start=1):
        sound = touches(file.stem, seed)
        turned = sound.pressure.reshape(-1, 6, 6)[:, ::-1, :].reshape(-1, 36)
        palpate.Recording(turned, sound.T_robot_sensor, sound.elements_mm, object=file.stem).save(file)
    check = palpate.check_setup(files, device=device)
    [finding] = check.findings
    assert finding.what == "element_order" and "array_offset" not in finding
    assert "first_element='top-left' and order='rows'" in finding.words, finding.words
    assert check.elements_mm.shape == (36, 2) and check.elements_mm[0, 1] > 0
    assert finding.flag == "first_element='top-left' order='rows'" and check.touches > 75
    [told] = json.loads(command("check", *files, "--json", "-", "--write-array", tmp_path / "array.csv"))
    assert told["nats"] == finding.nats and told.keys() == finding.keys()
    array = numpy.loadtxt(tmp_path / "array.csv", delimiter=",", skiprows=1)
    assert numpy.array_equal(array, check.elements_mm)
    assert "four or more of every object" in error_of(palpate.check_setup, sound[:3], device=device)


def test_frames_of_objects(device: palpate.Device) -> None:
    learned = palpate.simulate("E", palpate.random_poses(60, seed=5), seed=5)
    poses = [palpate.compose((600, 100, 0.3), pose) for pose in learned.T_robot_sensor]
    far = palpate.Recording(learned.pressure, poses, learned.elements_mm, object="E")
    grid = built(device, far)
    assert grid.T_learned_robot_object.tolist() == [0, 0, 0]
    origin = grid.origin_mm.copy()
    grid.centre_frame()
    assert numpy.allclose(grid.T_learned_robot_object[:2], [600, 100], atol=3)
    assert numpy.allclose(origin - grid.origin_mm, grid.T_learned_robot_object[:2])
    # A histogram about the robot's origin would answer nothing; recognize() finds the object.
    for filter in (palpate.ParticleFilter, palpate.PoseHistogram):
        belief: Any = filter(device, [grid])
        assert "lattice or region: missing or the default" in error_of(belief.update, far[:1])
    belief.move_pivot(far.T_robot_sensor[0, :2])
    belief.update(far[:1])
    [record] = palpate.recognize(far[:9], grid, device=device)
    assert numpy.allclose(record.refined.T_robot_object, grid.T_learned_robot_object, atol=0.5)
