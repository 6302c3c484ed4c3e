"""Touches of a stream of frames."""

from typing import Any

import numpy
import pytest

import palpate


def frames(pressed: float, begin_s: float, end_s: float) -> list[palpate.Frame]:
    """At 100 Hz; an element is not known from the touch's begin on."""
    values = [0.0, pressed, numpy.nan if pressed else 0.0]
    return [palpate.Frame(t, values, (1, 2, 3)) for t in numpy.arange(begin_s, end_s, 0.01)]


class Stream:
    """A sensor of three elements, as far as touches() asks it."""

    elements_mm = palpate.grid_array(3, 1, 2.0)
    baseline = numpy.zeros(3)
    valid = None

    def __iter__(self) -> Any:
        return iter(frames(0, 0, 1) + frames(20, 1, 2) + frames(0, 2, 3) + frames(20, 3, 4))


def test_touches_come_with_their_unknown_elements_also_at_the_end() -> None:
    found = list(palpate.touches(Stream()))  # type: ignore[arg-type]
    assert len(found) == 2  # the second is under way when the stream ends
    for touch in found:
        assert touch.T_robot_sensor.tolist() == [1, 2, 3]
        assert touch.pressure[:2] == pytest.approx([0, 20])
        assert touch.valid is not None
        assert touch.valid.tolist() == [1, 1, 0]


@pytest.mark.parametrize(
    "option", ["onset", "release", "min_steady_s", "steady", "smooth_s", "drift_s"]
)
def test_a_detector_takes_each_option(option: str) -> None:
    with pytest.raises(palpate.Error, match=rf"\b{option}\b"):
        palpate.TouchDetector(**{option: -1.0})  # type: ignore[arg-type]
