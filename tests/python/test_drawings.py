"""Maps of objects of which there is a drawing."""

from typing import Any

import numpy
import pytest
from conftest import Maps, error_of, learned

import palpate

PIXEL_MM = 0.1


def drawn_letter(letter: str) -> palpate.OccupancyGrid:
    """By a mask of pixels on the letter, about its origin."""
    along = (numpy.arange(280) - 139.5) * PIXEL_MM
    places = numpy.stack(numpy.meshgrid(along, along), axis=-1).reshape(-1, 2)
    exact = palpate.SensorModel(
        psf_mm=0, element_mm=0.01, pressure_kpa=20, force_spread=0, gain_spread=0, noise_kpa=0
    )
    touch = palpate.simulate(letter, [[0.0, 0.0, 0.0]], elements_mm=places, sensor=exact)
    mask = numpy.reshape(touch.pressure, (280, 280)) > 10
    return palpate.OccupancyGrid.from_mask(letter, mask, pixel_mm=PIXEL_MM, origin_mm=(-13.95, -13.95))


@pytest.fixture(scope="module")
def drawn() -> dict[str, palpate.OccupancyGrid]:
    return {letter: drawn_letter(letter) for letter in "AEIOU"}


def test_drawn_letters_place_touches_as_well_as_touched_ones(
    device: palpate.Device, drawn: dict[str, palpate.OccupancyGrid]
) -> None:
    unknowns = [
        palpate.simulate(
            "AEU"[k % 3], palpate.random_poses(4, seed=300 + k), seed=900 + k,
            T_object_robot=palpate.random_object_pose(seed=100 + k),
        )
        for k in range(20)  # fewer would not tell errors apart
    ]  # fmt: skip
    errors = []
    for maps in ([drawn[letter] for letter in "AEU"], [learned(device, letter) for letter in "AEU"]):
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
    mask = numpy.ones((4, 5), bool)
    pixels = {"pixel_mm": 1.0, "origin_mm": (0.0, 0.0)}
    from_mask, from_polygon = palpate.OccupancyGrid.from_mask, palpate.OccupancyGrid.from_polygon
    cases: list[tuple[Any, Any, dict[str, Any], str]] = [
        (from_mask, mask * 1.0, pixels, "mask: dtype float64; give booleans, True where occupied"),
        (from_mask, mask * numpy.uint8(255), pixels, "mask: dtype uint8; give booleans, True where occupied"),
        (from_mask, mask[0], pixels, "mask: shape (5,); give (rows, columns)"),
        (from_polygon, [(0, 0), (1, 1)], {}, "polygon 0 of 2 vertices: give at least 3"),
        (from_polygon, 3, {}, "polygon: shape (); give (n, 2)"),
    ]
    for made, drawing, options, words in cases:
        assert error_of(made, "a", drawing, **options).startswith(words)


def pressed(letter: str, seed: int, offset: tuple[float, float, float]) -> palpate.Recording:
    """Thirty touches of a letter whose array sits there in the tool, which nobody says."""
    elements = palpate.digitacts_array()
    made = palpate.simulate(
        letter, palpate.random_poses(30, seed), elements_mm=palpate.transform(offset, elements), seed=seed
    )
    return palpate.Recording(made.pressure, made.T_robot_sensor, elements, object=letter, truth=made.truth)


def test_a_sensor_and_its_place_in_the_tool_are_learned_on_drawn_maps(
    device: palpate.Device, drawn: dict[str, palpate.OccupancyGrid]
) -> None:
    # A fifth of the touches tells how far touches are misplaced: at least five touches of each of five
    # objects.
    offset = (2.0, -1.0, 0.07)
    touches = [pressed(letter, seed, offset) for seed, letter in enumerate("AEIOU")]
    calibration = palpate.calibrate(touches, maps=list(drawn.values()), device=device)
    found = numpy.asarray(calibration.array_offset.array_offset)
    assert (abs(found - offset) < (0.15, 0.15, 0.03)).all(), found
    assert calibration.sensor.touch_sd.mm < 0.5, "2 mm off is the array, not the touches"
    assert calibration.sensor.layer == "log_odds"
    assert calibration.sensor.log_likelihood.shape[0] == 7, "levels of pressure"
    there = palpate.calibrate(pressed("E", 1, (0.0, 0.0, 0.0)), maps=drawn["E"], device=device)
    assert "array_offset" not in there
