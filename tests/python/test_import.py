"""import_tables() takes tables and arrays, with Python's own spelling of the options of `palpate import`."""

import pathlib

import numpy
import pytest
from conftest import error_of, warned

import palpate

READINGS = numpy.arange(12.0).reshape(3, 4)


@pytest.fixture
def plain(tmp_path: pathlib.Path) -> pathlib.Path:
    """Three rows of 2 x 2 pressures without a time."""
    numpy.savetxt(tmp_path / "plain.csv", READINGS, delimiter=",")
    return tmp_path / "plain.csv"


def test_a_table_without_times_is_imported(plain: pathlib.Path, tmp_path: pathlib.Path) -> None:
    elements = numpy.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    truth = palpate.Truth("mug", (1, 2, 0.5))
    numpy.savetxt(tmp_path / "array.csv", elements, delimiter=",", header="x,y", comments="")
    for array in (elements, tmp_path / "array.csv"):
        options = {"array": array, "unposed": True, "pressure_unit": "raw", "truth": truth}
        given, said = warned(palpate.import_tables, plain, **options)
        assert said == ""
        assert given.pressure.tolist() == READINGS.tolist()
        assert (given.rows, given.pressure_unit) == ("touches", "raw")
        assert numpy.array_equal(given.elements_mm, elements)
        assert given.truth.object == "mug"
    given.save(tmp_path / "r.h5")
    for grid in ((2, 2, 1), [2, 2, 1]):
        assert palpate.import_tables(plain, array=grid, rate=10).rows == "frames"


def test_a_grid_is_read_in_any_order(plain: pathlib.Path) -> None:
    given = palpate.import_tables(
        plain, array="2x2x1", first_element="top-right", order="columns", dead=(0, 2), unposed=True, rate=10
    )
    assert given.elements_mm.tolist() == [[0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], [-0.5, -0.5]]
    assert given.valid is not None and given.valid.tolist() == [False, True, False, True]


def test_whole_numbers_that_are_no_pressures_are_noticed(tmp_path: pathlib.Path) -> None:
    (tmp_path / "raw.csv").write_text("0,4095,7,8\n")
    for unit, words in (("kPa", "whole numbers up to 4095: give pressure_unit='raw'"), ("raw", "")):
        _, said = warned(
            palpate.import_tables, tmp_path / "raw.csv", array=(2, 2, 1), rate=10, pressure_unit=unit
        )
        assert words in said and bool(words) == bool(said)


def test_poses_in_space_are_taken_into_the_plane(plain: pathlib.Path, tmp_path: pathlib.Path) -> None:
    (tmp_path / "space.csv").write_text("time,x_m,y_m,z_m,qx,qy,qz,qw\n0,0.001,0.002,0.1,1,0,0,0\n")
    table = {"array": (2, 2, 1), "rate": 1, "poses": tmp_path / "space.csv"}
    columns = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")
    for options in ({}, {"pose_columns": columns, "pose_unit": ("m", "deg")}, {"plane": (0, 0, 1)}):
        given, said = warned(palpate.import_tables, plain, **table, **options)
        assert "its y is turned over" in said
        assert given.T_robot_sensor[0].tolist() == [1, 2, 0]
        assert given.elements_mm[0].tolist() == [-0.5, 0.5], "seen from above"
    assert error_of(palpate.import_tables, plain, **table, plane=(0, 0, 0)).startswith("plane=(0, 0, 0): give auto")


def test_arrays_take_their_times_and_poses() -> None:
    """As tables of the same numbers do."""
    poses = numpy.array([[1.0, 2, 0.1], [3, 4, 0.2]])
    given = palpate.import_tables(
        READINGS.reshape(3, 2, 2), time_s=[0.0, 0.05, 0.1], poses=poses, pose_time_s=[0, 0.1], array=(2, 2, 1),
        object="mug",
    )  # fmt: skip
    assert (given.rows, given.object) == ("frames", "mug")
    assert given.pressure.tolist() == READINGS.tolist()
    numpy.testing.assert_allclose(given.T_robot_sensor, [[1, 2, 0.1], [2, 3, 0.15], [3, 4, 0.2]], atol=1e-9)
    gap, said = warned(
        palpate.import_tables, READINGS, time_s=[0.0, 0.05, 0.1], poses=poses, pose_time_s=[0, 0.1], array=(2, 2, 1),
        largest_gap_s=0.06,
    )  # fmt: skip
    assert "1 of its frames have no pose" in said
    assert numpy.isnan(gap.T_robot_sensor[:, 0]).tolist() == [False, True, False]
    quaternion, vector = [1, 2, 0, 0, 0, 0, 1], [0.001, 0.002, 0, 0, 0, 0]
    for pose, options in ((quaternion, {}), (vector, {"euler": "vector", "pose_unit": ("m", "rad")})):
        mounted, _ = warned(palpate.import_tables, READINGS, poses=[pose] * 3, array=(2, 2, 1), rows="touches",
                            mount=(1, 0, 0, 0, 0, 0), **options)  # fmt: skip
        numpy.testing.assert_allclose(mounted.T_robot_sensor, [[2, 2, 0]] * 3, atol=1e-9)


def test_what_neither_a_table_nor_arrays_can_have_is_refused(plain: pathlib.Path) -> None:
    square = {"array": (2, 2, 1)}
    for pressures, options, words in (
        (plain, {"array": (2, 0, 1)}, "array=(2, 0, 1)"),
        (plain, {"array": numpy.zeros((4, 3))}, "array: shape (4, 3)"),
        (plain, {"array": numpy.zeros((0, 2))}, "array: has no element"),
        (plain, {"array": "2:2:1", "order": "x"}, "order='x': give rows or columns"),
        (plain, {**square, "time_s": [0, 1, 2]}, "time_s and pose_time_s: are for arrays"),
        (plain, {**square, "pose_time_s": [0, 1, 2]}, "time_s and pose_time_s: are for arrays"),
        (READINGS, {**square, "poses": plain}, f"poses: '{plain}' is a file beside an array"),
        (READINGS, {**square, "time_s": [0, 1]}, "time_s"),
        (READINGS, {**square, "time_s": [0, 1, numpy.nan]}, "time_s[2]: nan is no time"),
        (READINGS, {**square, "header_line": 1}, "header_line: is for tables"),
        (READINGS, {**square, "poses": numpy.zeros((3, 3)), "pose_time_s": range(9)},
         "pose_time_s: shape (9,); give (m,) with m = 3 of poses"),
        (READINGS, {**square, "poses": [[0, 0, 0, 0, 0, 0, 3]] * 3}, "poses[0]: the quaternion's length is 3"),
        (numpy.zeros((1, 3, 2)), {"array": (3, 2, 1)}, "pressures: shape (1, 3, 2); give (n, 2, 3)"),
    ):
        assert error_of(palpate.import_tables, pressures, **options).startswith(words)
