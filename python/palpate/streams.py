"""Touches of a stream, one by one."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ._palpate import DetectedTouch, Frame, Sensor, TouchDetector, baseline_of
from ._recording import Touch

# The build writes the stubs by importing the package, where there is no NumPy.
if TYPE_CHECKING:
    import numpy


def touches(
    sensor: Sensor,
    *,
    onset: float = 2.0,
    release: float = 1.0,
    tare_s: float = 0.5,
) -> Iterator[Touch]:
    """Yields every touch of a started sensor whose pose is known, as soon as it ends.

    A touch begins where the largest pressure exceeds `onset` and ends where it falls below `release`,
    both above the baseline, in the sensor's pressure unit. The baseline is the sensor's own or, where
    it has none, the median of the first `tare_s` seconds, in which nothing may touch the array.

    Raises Error where the array is touched while it is tared.
    """
    elements_mm = sensor.elements_mm
    baseline = sensor.baseline
    if baseline is None:
        baseline = baseline_of(_frames_of(sensor, tare_s), sensor, onset)
    detector = TouchDetector(onset=onset, release=release, baseline=baseline, valid=sensor.valid)
    for frame in sensor:
        if (found := _posed(detector.add(frame), elements_mm)) is not None:
            yield found
    if (found := _posed(detector.finish(), elements_mm)) is not None:
        yield found


def _frames_of(sensor: Sensor, seconds: float) -> list[Frame]:
    frames: list[Frame] = []
    for frame in sensor:
        frames.append(frame)
        if frame.host_time_s - frames[0].host_time_s >= seconds:
            break
    return frames


def _posed(
    found: DetectedTouch | None, elements_mm: "numpy.typing.NDArray[numpy.float64]"
) -> Touch | None:
    if found is None or found.T_robot_sensor is None:
        return None
    valid = found.valid if len(found.valid) else None
    return Touch(found.T_robot_sensor, elements_mm, found.pressure, valid)
