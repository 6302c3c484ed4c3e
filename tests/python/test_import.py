"""import_tables() makes the recordings of `palpate import`, and refuses in its words."""

import math
import pathlib
import re
import warnings
from typing import Any

import numpy
import pytest
from conftest import command, refusal

import palpate


@pytest.fixture
def tables(tmp_path: pathlib.Path) -> pathlib.Path:
    """Pressures of 2 x 2 elements and poses, each by time; pressures without a time; elements."""
    (tmp_path / "pressures.csv").write_text("time_ms,a,b,c,d\n0,1,2,3,4\n50,5,,7,8\n1900,9,10,11,12\n")
    (tmp_path / "poses.csv").write_text("time,px,py,yaw\n0,1,2,0\n0.1,2,3,10\n2,4,5,20\n")
    numpy.savetxt(tmp_path / "plain.csv", numpy.arange(12.0).reshape(3, 4), delimiter=",")
    (tmp_path / "array.csv").write_text("x,y\n0,0\n1,0\n0,1\n1,1\n")
    return tmp_path


def test_an_import_has_the_rows_of_the_command(tables: pathlib.Path) -> None:
    pressures, poses = tables / "pressures.csv", tables / "poses.csv"
    command(
        "import", pressures, "--poses", poses, "--array", "2:2:1.5", "-o", tables / "f.h5",
        "--pose-columns", "px,py,yaw", "--pose-unit", "m,deg", "--largest-gap-s", 1,
        "--object", "mug",
    )  # fmt: skip
    with pytest.warns(UserWarning, match="1 of its frames have no pose"):
        given = palpate.import_tables(
            pressures, poses=poses, array=(2, 2, 1.5), pose_columns=("px", "py", "yaw"),
            pose_unit=("m", "deg"), largest_gap_s=1, object="mug",
        )  # fmt: skip
    expected = palpate.read_recording(tables / "f.h5")
    assert (given.rows, given.object, len(given)) == ("frames", "mug", 3)
    for name in ("pressure", "T_robot_sensor", "elements_mm", "time_s"):
        assert numpy.array_equal(getattr(given, name), getattr(expected, name), equal_nan=True), name
    assert given.T_robot_sensor[1].tolist() == [1500, 2500, math.radians(5)]
    assert numpy.isnan(given.pressure[1, 1]) and numpy.isnan(given.T_robot_sensor[2]).all()


def test_a_table_without_times_is_imported(tables: pathlib.Path) -> None:
    elements = numpy.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    truth = palpate.Truth("mug", (1, 2, 0.5))
    for array in (elements, tables / "array.csv"):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            given = palpate.import_tables(
                tables / "plain.csv", array=array, unposed=True, pressure_unit="raw", truth=truth
            )
        assert given.pressure.tolist() == numpy.arange(12.0).reshape(3, 4).tolist()
        assert (given.rows, given.pressure_unit) == ("touches", "raw")
        assert numpy.array_equal(given.elements_mm, elements)
        assert given.truth is not None and given.truth.object == "mug"
    given.save(tables / "r.h5")
    assert palpate.import_tables(tables / "plain.csv", array=(2, 2, 1), rate=10).rows == "frames"


@pytest.mark.parametrize(
    ("flags", "options", "said"),
    [
        (["--pose-unit", "m,turn"], {"pose_unit": ("m", "turn")}, "pose_unit='m,turn': "),
        (["--poses", "none.csv"], {"poses": pathlib.Path("none.csv")}, "none.csv: "),
    ],
)
def test_tables_are_refused_in_the_words_of_the_command(
    tables: pathlib.Path, flags: list[Any], options: dict[str, Any], said: str
) -> None:
    path = tables / "pressures.csv"
    refused = refusal("import", path, "--array", "2:2:1", "-o", tables / "o.h5", *flags)
    named, problem = refused.split(": ", 1)
    assert named in (" ".join(map(str, flags)), "none.csv")
    # Each face names the option in its own words.
    with pytest.raises(palpate.Error, match=f"^{re.escape(said + problem)}$"):
        palpate.import_tables(path, array=(2, 2, 1), **options)


def test_arrays_that_no_table_can_have_are_refused(tables: pathlib.Path) -> None:
    path = tables / "pressures.csv"
    with pytest.raises(palpate.Error, match=re.escape("array=(2, 0, 1)")):
        palpate.import_tables(path, array=(2, 0, 1))
    with pytest.raises(palpate.Error, match=re.escape("array: shape (4, 3)")):
        palpate.import_tables(path, array=numpy.zeros((4, 3)))
    with pytest.raises(palpate.Error, match="^array: has no element"):
        palpate.import_tables(path, array=numpy.zeros((0, 2)))
    with pytest.raises(TypeError, match="rate: 'fast'; give float"):
        palpate.import_tables(path, array=(2, 2, 1), rate="fast")  # type: ignore[arg-type]


def test_a_grid_is_read_in_any_order(tables: pathlib.Path) -> None:
    given = palpate.import_tables(
        tables / "plain.csv", array="2x2x1", first_element="top-right", order="columns",
        dead=(0, 2), unposed=True, rate=10,
    )  # fmt: skip
    assert given.elements_mm.tolist() == [[0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], [-0.5, -0.5]]
    assert given.valid is not None and given.valid.tolist() == [False, True, False, True]
    with pytest.raises(palpate.Error, match="^order='x': give rows or columns"):
        palpate.import_tables(tables / "plain.csv", array="2:2:1", order="x")  # type: ignore[arg-type]


def test_whole_numbers_that_are_no_pressures_are_noticed(tables: pathlib.Path) -> None:
    (tables / "raw.csv").write_text("0,4095,7,8\n")
    with pytest.warns(UserWarning, match="whole numbers up to 4095: give pressure_unit='raw'"):
        palpate.import_tables(tables / "raw.csv", array=(2, 2, 1), rate=10)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        palpate.import_tables(tables / "raw.csv", array=(2, 2, 1), rate=10, pressure_unit="raw")


def test_poses_in_space_are_taken_into_the_plane(tables: pathlib.Path) -> None:
    (tables / "space.csv").write_text("time,x_m,y_m,z_m,qx,qy,qz,qw\n0,0.001,0.002,0.1,1,0,0,0\n")
    names = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")
    for options in ({}, {"pose_columns": names}, {"plane": (0, 0, 1)}):
        with pytest.warns(UserWarning, match="its y is turned over"):
            given = palpate.import_tables(
                tables / "plain.csv", array=(2, 2, 1), rate=1, poses=tables / "space.csv", **options
            )  # type: ignore[arg-type]
        assert given.T_robot_sensor[0].tolist() == [1, 2, 0]
        assert given.elements_mm[0].tolist() == [-0.5, 0.5], "seen from above"
    with pytest.raises(palpate.Error, match=r"^plane=\(0, 0, 0\): give auto"):
        palpate.import_tables(
            tables / "plain.csv", array=(2, 2, 1), rate=1, poses=tables / "space.csv",
            plane=(0, 0, 0),
        )  # fmt: skip


def test_arrays_take_their_times_and_poses(tables: pathlib.Path) -> None:
    """As tables of the same numbers do."""
    time_s = numpy.array([0.0, 0.05, 0.1])
    readings = numpy.arange(12.0).reshape(3, 2, 2)
    poses = numpy.array([[1.0, 2, 0.1], [3, 4, 0.2]])
    given = palpate.import_tables(
        readings, time_s=time_s, poses=poses, pose_time_s=[0, 0.1], array=(2, 2, 1), object="mug"
    )
    assert (given.rows, given.object) == ("frames", "mug")
    assert given.pressure.tolist() == readings.reshape(3, 4).tolist()
    numpy.testing.assert_allclose(given.T_robot_sensor, [[1, 2, 0.1], [2, 3, 0.15], [3, 4, 0.2]], atol=1e-9)
    quaternions = [[1, 2, 0, 0, 0, 0, 1]] * 3
    mounted = palpate.import_tables(
        readings, poses=quaternions, array=(2, 2, 1), rows="touches", mount=(1, 0, 0, 0, 0, 0)
    )
    numpy.testing.assert_allclose(mounted.T_robot_sensor, [[2, 2, 0]] * 3, atol=1e-9)
    with pytest.raises(palpate.Error, match="time_s and pose_time_s: are for arrays"):
        palpate.import_tables(tables / "plain.csv", array=(2, 2, 1), time_s=time_s)
    with pytest.raises(palpate.Error, match="poses: .*poses.csv' is a file beside an array"):
        palpate.import_tables(readings, array=(2, 2, 1), poses=tables / "poses.csv")
    with pytest.raises(palpate.Error, match="time_s"):
        palpate.import_tables(readings, array=(2, 2, 1), time_s=time_s[:2])
