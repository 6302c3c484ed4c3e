"""From frames of an array to records of the object that it touches, without ROS."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy
import palpate
from numpy.typing import NDArray


@dataclass
class Session:
    """Finds touches in a stream of frames and recognises the object that they are of."""

    array: palpate.Recording  #: a recording of the array: its elements, dead elements and unit count
    maps: Sequence[palpate.OccupancyGrid]
    onset: float = 2.0  #: a press begins above it, in the array's unit above the baseline
    tare_s: float = 0.5  #: nothing may touch the array for so long at the start
    options: dict[str, Any] = field(default_factory=dict)  #: of palpate.recognize()

    def __post_init__(self) -> None:
        given = self.array.valid
        #: [e]; an element that is alive in some row is alive
        self._valid = None if given is None else numpy.atleast_2d(given).any(axis=0).astype(numpy.uint8)
        self._tare: list[palpate.Frame] = []
        self._detector: palpate.TouchDetector | None = None
        self.next_unknown()

    def next_unknown(self) -> None:
        """The touches to come are of another object."""
        self._touches: list[tuple[palpate.DetectedTouch, NDArray[numpy.float64]]] = []

    @property
    def touches(self) -> int:
        """Touches of this object so far."""
        return len(self._touches)

    def add(self, time_s: float, readings: Sequence[float]) -> palpate.DetectedTouch | None:
        """Takes a frame; the touch that ends with it, if any. Raises palpate.Error."""
        elements = self.array.elements_mm.shape[0]
        if len(readings) != elements:
            raise palpate.Error(
                f"{len(readings)} readings for an array of {elements} elements; give the recording of "
                "this array, and the field that holds its readings"
            )
        frame = palpate.Frame(time_s, readings)
        if self._detector is None:
            self._tare.append(frame)
            if time_s - self._tare[0].host_time_s >= self.tare_s:
                self._end_tare()
            return None
        return self._detector.add(frame)

    def _end_tare(self) -> None:
        values = numpy.array([frame.values for frame in self._tare])
        if self._valid is not None:
            values[:, self._valid == 0] = 0.0
        self._tare = []
        quarters = [numpy.nanmedian(part, axis=0) for part in numpy.array_split(values, 4)]
        change = float(numpy.nanmax(numpy.ptp(quarters, axis=0)))
        if change > self.onset:
            raise palpate.Error(
                f"the array is touched while its baseline is taken: an element changes by {change:.3g}; "
                "let go of it"
            )
        self._detector = palpate.TouchDetector(
            onset=self.onset,
            release=self.onset / 2,
            baseline=numpy.nan_to_num(numpy.nanmedian(values, axis=0)),
            valid=self._valid,
        )

    def recognise(self, touch: palpate.DetectedTouch, T_robot_sensor: Sequence[float]) -> palpate.Record:
        """What is known of the object after one more touch. Raises palpate.Error."""
        self._touches.append((touch, numpy.asarray(T_robot_sensor, dtype=numpy.float64)))
        alive = numpy.ones(self.array.elements_mm.shape[0], dtype=numpy.uint8)
        recording = palpate.Recording(
            numpy.array([touch.pressure for touch, _ in self._touches]),
            numpy.array([pose for _, pose in self._touches]),
            self.array.elements_mm,
            valid=numpy.array([t.valid if len(t.valid) else alive for t, _ in self._touches]),
            pressure_unit=self.array.pressure_unit,
        )
        [record] = palpate.recognize(recording, self.maps, **self.options)
        return record

    def map_of(self, label: str) -> palpate.OccupancyGrid | None:
        """The map of this label; None of "(none)"."""
        return next((grid for grid in self.maps if grid.label == label), None)


def planar_pose(transform: Any) -> tuple[tuple[float, float, float], float]:
    """The pose (x_mm, y_mm, theta_rad) in the target frame's xy plane, and the height z in m, of a
    geometry_msgs/Transform: where the array's origin lies, and where its x axis points."""
    p, q = transform.translation, transform.rotation
    theta = math.atan2(2 * (q.x * q.y + q.w * q.z), 1 - 2 * (q.y * q.y + q.z * q.z))
    return (1e3 * p.x, 1e3 * p.y, theta), p.z


def covariance_of(record: palpate.Record) -> NDArray[numpy.float64]:
    """[3, 3] of record.refined.T_robot_object, in mm and rad, from that of T_object_robot."""
    x, y, _ = record.refined.T_robot_object
    c, s = math.cos(record.refined.theta_rad), math.sin(record.refined.theta_rad)
    jacobian = numpy.array([[-c, -s, y], [s, -c, -x], [0.0, 0.0, -1.0]])
    carried: NDArray[numpy.float64] = jacobian @ numpy.asarray(record.refined.covariance) @ jacobian.T
    return carried
