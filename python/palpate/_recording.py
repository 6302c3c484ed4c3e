"""Touches and recordings over arrays of NumPy, which C++ reads in place."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, ClassVar, Literal, overload

from . import _palpate
from ._palpate import Truth
from .results import Drawn

# The build writes the stubs by importing the package, where there is no NumPy.
if TYPE_CHECKING:
    import os

    import numpy
    from numpy.typing import ArrayLike, NDArray


def _checked(name: str, value: object) -> Any:
    """The value of an attribute that is no array. Raises TypeError on one of another type."""
    wanted, kinds = ("Truth | None", (Truth, type(None))) if name == "truth" else ("str", (str,))
    if not isinstance(value, kinds):
        raise TypeError(f"{name}: {value!r}; give {wanted}")
    return value


class _OverArrays:
    """What C++ reads in place: its arrays stay the ones that it has checked."""

    _free: ClassVar[tuple[str, ...]] = ()  #: attributes that may be set

    def __setattr__(self, name: str, value: object) -> None:
        if name not in self._free:
            raise AttributeError(f"{name} of a {type(self).__name__} cannot be set; make another one")
        super().__setattr__(name, _checked(name, value))

    @classmethod
    def _of(cls, fields: dict[str, Any]) -> Any:
        """One that has these attributes, which are sound."""
        made = cls.__new__(cls)
        made.__dict__.update(fields)
        return made


class Touch(_OverArrays):
    """One reading of the tactile array at a known pose.

    Its arrays are those that were given, where these are float64 with C layout: a change of them changes the
    touch.
    """

    T_robot_sensor: NDArray[numpy.float64]
    """[3] (x_mm, y_mm, theta_rad)."""
    elements_mm: NDArray[numpy.float64]
    """[e, 2], element centres in the sensor frame."""
    pressure: NDArray[numpy.float64]
    """[e] in the recording's unit."""
    valid: NDArray[numpy.uint8] | None
    """[e], 0 for a dead element; None: all are alive."""

    def __init__(
        self,
        T_robot_sensor: ArrayLike,
        elements_mm: ArrayLike,
        pressure: ArrayLike,
        valid: ArrayLike | None = None,
    ) -> None:
        """T_robot_sensor [3] (x_mm, y_mm, theta_rad); elements_mm [e, 2], element centres in the sensor
        frame; pressure [e] in the recording's unit; valid [e], False for a dead element.

        Raises Error on other shapes.
        """
        from ._arrays import Reader

        reader = Reader()
        self.__dict__.update(
            T_robot_sensor=reader.floats(T_robot_sensor, "T_robot_sensor", ("3",)),
            elements_mm=reader.floats(elements_mm, "elements_mm", ("e", "2")),
            pressure=reader.readings(pressure, "pressure", ("e",)),
            valid=reader.valid(pressure, valid, ("e",)),
        )

    def __repr__(self) -> str:
        x, y, theta = self.T_robot_sensor
        return f"Touch({len(self.pressure)} elements at x {x:.2f} mm, y {y:.2f} mm, theta {theta:.3f} rad)"


#: The axes that one touch has of the arrays that may have a row for each touch.
_AXES = {
    "T_robot_sensor": 1,
    "elements_mm": 2,
    "pressure": 1,
    "valid": 1,
    "time_s": 0,
    "device_time_s": 0,
    "lost_before": 0,
}


class Recording(_OverArrays, Drawn):
    """A sequence of readings of one array pressed against one object.

    Its arrays are those that were given, where dtype and layout allow; recording[i] is a Touch, and
    recording[a:b] a Recording over the same memory. plot(ax=None) draws every reading at its element's place in
    the robot frame, in mm, with Matplotlib, and returns the axes.
    """

    _free = ("object", "truth")

    pressure: NDArray[numpy.float64]
    """[n, e] in pressure_unit."""
    T_robot_sensor: NDArray[numpy.float64]
    """[n, 3] (x_mm, y_mm, theta_rad)."""
    elements_mm: NDArray[numpy.float64]
    """Element centres in the sensor frame, [e, 2], or [n, e, 2] where the array changes."""
    valid: NDArray[numpy.uint8] | None
    """[e] or [n, e], 0 for a dead element; None: all are alive."""
    time_s: NDArray[numpy.float64] | None
    """[n] since the Unix epoch, or None."""
    baseline: NDArray[numpy.float64] | None
    """[e] untouched readings, or None."""
    device_time_s: NDArray[numpy.float64] | None
    """[n] by the sensor's own clock, or None."""
    lost_before: NDArray[numpy.uint64] | None
    """[n] frames lost since the last row, or None."""
    path: str
    """The file that it was read from, or ""."""
    object: str
    """Label of the object; "" where it is unknown."""
    pressure_unit: str
    """"kPa" or "raw"."""
    rows: str
    """"touches", or "frames" of a raw stream."""
    truth: Truth | None
    """The true identity and pose of an unknown object, or None."""
    sensor: str
    """Name of the sensor, or ""."""
    serial: str
    """Serial number of the sensor, or ""."""
    closed: bool
    """False: cut off, or being recorded."""

    def __init__(
        self,
        pressure: ArrayLike,
        poses: ArrayLike,
        elements_mm: ArrayLike,
        *,
        valid: ArrayLike | None = None,
        time_s: ArrayLike | None = None,
        object: str = "",
        pressure_unit: Literal["kPa", "raw"] | str = "kPa",
        rows: Literal["touches", "frames"] | str = "touches",
        truth: Truth | None = None,
        sensor: str = "",
        serial: str = "",
        baseline: ArrayLike | None = None,
        device_time_s: ArrayLike | None = None,
        lost_before: ArrayLike | None = None,
    ) -> None:
        """pressure [n, e] in pressure_unit, "kPa" or "raw"; poses T_robot_sensor [n, 3] (x_mm, y_mm,
        theta_rad); elements_mm [e, 2] in the sensor frame, or [n, e, 2] where the array changes; valid [e] or
        [n, e], False for a dead element; time_s [n] since the Unix epoch; object: its label, "" where unknown;
        rows: "touches", or "frames" of a raw stream, in which poses and pressures may be NaN (unknown).

        Raises Error naming the argument whose shape does not fit; TypeError on another type.
        """
        from ._arrays import Reader

        reader = Reader()
        texts = {"object": object, "pressure_unit": pressure_unit, "rows": rows, "truth": truth, "sensor": sensor,
                 "serial": serial}  # fmt: skip
        self.__dict__.update(
            pressure=reader.readings(pressure, "pressure", ("n", "e")),
            T_robot_sensor=reader.floats(poses, "poses", ("n", "3")),
            elements_mm=reader.floats(elements_mm, "elements_mm", ("e", "2"), ("n", "e", "2")),
            valid=reader.valid(pressure, valid, ("n", "e")),
            **{
                name: None if given is None else read(given, name, (letter,))
                for name, given, read, letter in (
                    ("time_s", time_s, reader.floats, "n"),
                    ("baseline", baseline, reader.floats, "e"),
                    ("device_time_s", device_time_s, reader.floats, "n"),
                    ("lost_before", lost_before, reader.counts, "n"),
                )
            },
            **{name: _checked(name, given) for name, given in texts.items()},
            path="",
            closed=True,
            _findings=[],
        )

    def __len__(self) -> int:
        return len(self.pressure)

    def __iter__(self) -> Iterator[Touch]:
        return (self[i] for i in range(len(self)))

    @overload
    def __getitem__(self, index: int) -> Touch: ...
    @overload
    def __getitem__(self, index: slice) -> Recording: ...
    def __getitem__(self, index: int | slice) -> Touch | Recording:
        if isinstance(index, slice):
            part: Recording = self._of(vars(self) | self._at(index, _AXES))
            return part
        if not hasattr(index, "__index__"):
            raise TypeError(f"index: is a {type(index).__name__}; give a whole number or a slice")
        i, n = operator.index(index), len(self)
        if not -n <= i < n:
            raise IndexError(f"touch {i} of {n}")
        touch: Touch = Touch._of(self._at(i, Touch.__annotations__))
        return touch

    def _at(self, rows: int | slice, names: Iterable[str]) -> dict[str, Any]:
        """These arrays; of those that have a row for each touch, only the given rows."""
        import numpy

        def part(array: Any, axes: int) -> Any:
            if array is None or array.ndim == axes:
                return array
            return numpy.ascontiguousarray(array[rows])  # a step makes another layout, and so a copy

        return {name: part(vars(self)[name], _AXES[name]) for name in names}

    def save(self, path: str | bytes | os.PathLike[str] | os.PathLike[bytes]) -> None:
        """Writes a recording file (HDF5), whole or not at all. Raises Error where the content is not sound or
        the file cannot be written."""
        _palpate.write_recording(path, self)

    def __repr__(self) -> str:
        n, e = self.pressure.shape
        of = f", of '{self.object}'" if self.object else ""
        return f"Recording({n} {self.rows} of {e} elements in {self.pressure_unit}{of})"
