"""Maps of objects of which there is a drawing."""

import numpy
import pytest
from numpy.typing import NDArray

import palpate

LETTERS = "AEU"
PIXEL_MM = 0.1


def drawing(letter: str) -> NDArray[numpy.bool_]:
    """[280, 280] the pixels of 0.1 mm on the letter, about its origin."""
    along = (numpy.arange(280) - 139.5) * PIXEL_MM
    places = numpy.stack(numpy.meshgrid(along, along), axis=-1).reshape(-1, 2)
    exact = palpate.SensorModel(
        psf_mm=0, element_mm=0.01, pressure_kpa=20, force_spread=0, gain_spread=0, noise_kpa=0
    )
    touch = palpate.simulate(letter, [[0.0, 0.0, 0.0]], elements_mm=places, sensor=exact)
    return numpy.reshape(touch.pressure, (280, 280)) > 10


def drawn_letter(letter: str) -> palpate.OccupancyGrid:
    return palpate.OccupancyGrid.from_mask(
        letter, drawing(letter), pixel_mm=PIXEL_MM, origin_mm=(-13.95, -13.95)
    )


@pytest.fixture(scope="module")
def drawn() -> list[palpate.OccupancyGrid]:
    return [drawn_letter(letter) for letter in LETTERS]


@pytest.fixture(scope="module")
def touched(device: palpate.Device) -> list[palpate.OccupancyGrid]:
    maps = []
    for letter in LETTERS:
        builder = palpate.MapBuilder(device)
        builder.add(palpate.simulate(letter, seed=1))
        maps.append(builder.build(letter))
    return maps


def overlap(grid: palpate.OccupancyGrid, half_mm: float = 15.0) -> NDArray[numpy.float32]:
    """The cells within 15 mm of the origin along x and y."""
    first = numpy.round((-half_mm - numpy.asarray(grid.origin_mm)) / grid.cell_mm).astype(int)
    count = round(2 * half_mm / grid.cell_mm) + 1
    return grid.log_odds[first[1] : first[1] + count, first[0] : first[0] + count]


def test_a_drawn_letter_is_the_touched_one(
    drawn: list[palpate.OccupancyGrid], touched: list[palpate.OccupancyGrid]
) -> None:
    for a, b in zip(map(overlap, drawn), map(overlap, touched)):
        sure = (abs(a) > 3) & (abs(b) > 3)  # more than 20 to 1
        assert sure.mean() > 0.6
        assert ((a > 0) == (b > 0))[sure].mean() > 0.999
        assert ((a > 0) == (b > 0)).mean() > 0.94


def test_touches_are_placed_on_drawn_letters_as_well_as_on_touched_ones(
    device: palpate.Device, drawn: list[palpate.OccupancyGrid], touched: list[palpate.OccupancyGrid]
) -> None:
    # Two recognitions of 20 unknowns take some seconds: fewer would not tell errors apart.
    unknowns = [
        palpate.simulate(
            LETTERS[k % 3],
            palpate.random_poses(4, seed=300 + k),
            T_object_robot=palpate.random_object_pose(seed=100 + k),
            seed=900 + k,
        )
        for k in range(20)
    ]
    errors = []
    for maps in (drawn, touched):
        records = palpate.recognize(unknowns, maps, device=device)
        assert all(record.right for record in records)
        errors.append(numpy.mean([record.refined_error_mm for record in records]))
    assert errors[0] < 1.25 * errors[1], errors
    assert errors[0] < 0.4


def test_an_outline_with_a_hole_is_its_mask() -> None:
    outer = numpy.array([(-10, -6), (10, -6), (10, 6), (-10, 6)])
    mask = numpy.zeros((140, 220), bool)
    mask[10:130, 10:210] = True
    mask[40:100, 60:160] = False
    by_mask = palpate.OccupancyGrid.from_mask("a", mask, pixel_mm=0.1, origin_mm=(-10.95, -6.95))
    outline = palpate.OccupancyGrid.from_polygon("a", [outer, outer / 2])
    assert numpy.array_equal(outline.origin_mm, by_mask.origin_mm)
    assert numpy.allclose(outline.log_odds, by_mask.log_odds, atol=1e-3)
    assert outline.drawn and outline.suggested_symmetry == 2
    whole = palpate.OccupancyGrid.from_polygon("a", outer)
    assert (whole.log_odds > 0).sum() > (outline.log_odds > 0).sum()


def test_what_is_no_drawing_is_refused() -> None:
    def words(mask: object, **options: object) -> str:
        given = {"pixel_mm": 1.0, "origin_mm": (0.0, 0.0), **options}
        with pytest.raises(palpate.Error) as refused:
            palpate.OccupancyGrid.from_mask("a", mask, **given)  # type: ignore[arg-type]
        return str(refused.value)

    mask = numpy.ones((4, 5), bool)
    assert words(mask * 1.0) == "mask: dtype float64; give booleans, True where occupied"
    assert words(mask * numpy.uint8(255)) == "mask: dtype uint8; give booleans, True where occupied"
    assert words(mask[0]) == "mask: shape (5,); give (rows, columns)"
    assert words(~mask) == "mask of 'a': no pixel is occupied; mark those of the object"
    assert words(mask, pixel_mm=0.0).startswith("mask of 'a': a pixel = 0 mm: give")
    assert words(mask, felt_share=0.0) == "felt_share=0: must lie between 0 and 1"

    def polygon(vertices: object) -> str:
        with pytest.raises(palpate.Error) as refused:
            palpate.OccupancyGrid.from_polygon("a", vertices)  # type: ignore[arg-type]
        return str(refused.value)

    assert polygon([(0, 0), (1, 1)]) == "polygon 0 of 2 vertices: give at least 3"
    assert polygon(3) == "polygon: shape (); give (n, 2)"
    assert polygon([(0, 0), (1, 1), (2, 2)]).startswith("shape 'a': covers no area")


def test_a_sensor_and_its_place_in_the_tool_are_learned_on_drawn_maps(
    device: palpate.Device, drawn: list[palpate.OccupancyGrid]
) -> None:
    elements = numpy.asarray(palpate.digitacts_array())
    dx, dy, turn = 2.0, -1.0, 0.07
    c, s = numpy.cos(turn), numpy.sin(turn)
    made = palpate.simulate(
        "E",
        palpate.random_poses(30, seed=1),
        T_object_robot=(40.0, -30.0, 0.5),
        elements_mm=elements @ [[c, s], [-s, c]] + [dx, dy],
    )
    touches = palpate.Recording(made.pressure, made.T_robot_sensor, elements, truth=made.truth)
    calibration = palpate.calibrate(touches, maps=drawn[1], device=device)
    assert "array_offset" in calibration
    offset = numpy.asarray(calibration.array_offset.array_offset)
    assert (abs(offset - (dx, dy, turn)) < (0.15, 0.15, 0.03)).all(), offset
    assert calibration.sensor.layer == "log_odds"
    assert calibration.sensor.log_likelihood.shape[0] == 7, "levels of pressure"


def test_where_the_array_sits_counts_once(device: palpate.Device) -> None:
    # A fifth of the touches tells how far touches are misplaced: at least five touches of each of five
    # objects. This takes some seconds.
    elements = numpy.asarray(palpate.digitacts_array())
    recordings = []
    for seed, letter in enumerate("AEIOU"):
        poses = palpate.random_poses(30, seed=seed)
        made = palpate.simulate(letter, poses, elements_mm=elements + (2.0, -1.0), seed=seed)
        recordings.append(
            palpate.Recording(
                made.pressure, made.T_robot_sensor, elements, object=letter, truth=made.truth
            )
        )
    maps = [drawn_letter(letter) for letter in "AEIOU"]
    calibration = palpate.calibrate(recordings, maps=maps, device=device)
    assert "array_offset" in calibration
    assert calibration.sensor.touch_sd.mm < 0.5, "2 mm off is the array, not the touches"


def test_an_array_that_sits_right_stays_there(
    device: palpate.Device, drawn: list[palpate.OccupancyGrid]
) -> None:
    there = palpate.simulate("E", palpate.random_poses(30, seed=1), seed=2)
    assert "array_offset" not in palpate.calibrate(there, maps=drawn[1], device=device)
