"""Arrays that a call is given: taken as they are where dtype and layout allow, and refused by name."""

from typing import Any

import numpy
from numpy.typing import NDArray

from ._error import Error

_MA: Any = numpy.ma  #: which has no types
Shape = tuple[str, ...]  #: numbers, or letters that stand for one number throughout a call


class Reader:
    """Takes the arrays of one call, whose extents have to agree.

    Methods return the array of the argument itself where dtype and layout allow it, or else a copy. name:
    of the argument; shapes: the one that the array has to have, and one of more axes where it may have
    more. They raise Error naming the argument, its shape and the shape that it needs.
    """

    def __init__(self) -> None:
        self._extents: dict[str, tuple[int, str]] = {}  #: by letter, with the argument that gave it

    def floats(self, given: Any, name: str, *shapes: Shape) -> NDArray[numpy.float64]:
        _refuse_masked(given, name)
        return self.readings(given, name, *shapes)

    def readings(self, given: Any, name: str, *shapes: Shape) -> NDArray[numpy.float64]:
        """Readings, the only arrays that may have masked values (numpy.ma)."""
        array = _array(given, name, "fiu", "numbers (float64)")
        return self._checked(numpy.asarray(array, numpy.float64, order="C"), name, shapes)

    def valid(self, readings: Any, valid: Any, shape: Shape) -> NDArray[numpy.uint8] | None:
        """The flags `valid` of elements or of all readings, 0 also where a reading is masked; None where all
        are valid. shape: of the readings."""
        given = None if valid is None else self.flags(valid, "valid", ("e",), shape)
        masked = _masked(readings)
        if masked is None:
            return given
        known = ~_MA.getmaskarray(masked)
        return self.flags(known if given is None else numpy.logical_and(given, known), "valid", shape)

    def known(self, readings: Any, name: str, shape: Shape) -> NDArray[numpy.float64]:
        """Readings, NaN where they are masked."""
        values, valid = self.readings(readings, name, shape), self.valid(readings, None, shape)
        return values if valid is None else numpy.where(valid, values, numpy.nan)

    def flags(self, given: Any, name: str, *shapes: Shape) -> NDArray[numpy.uint8]:
        """Booleans, or integers that are 0 or not."""
        _refuse_masked(given, name)
        array = _array(given, name, "biu", "booleans, False for a dead element")
        dtype = "uint8" if array.dtype == numpy.uint8 else "bool"
        return self._checked(numpy.asarray(array, dtype, order="C").view(numpy.uint8), name, shapes)

    def pixels(self, given: Any, name: str, shape: Shape) -> NDArray[numpy.uint8]:
        """Booleans of a picture, whose 0 and 255 would be taken for False and True."""
        _array(given, name, "b", "booleans, True where occupied")
        return self.flags(given, name, shape)

    def counts(self, given: Any, name: str, *shapes: Shape) -> NDArray[numpy.uint64]:
        _refuse_masked(given, name)
        array = _array(given, name, "iu", "whole numbers (uint64)")
        if array.size and array.min() < 0:
            raise Error(f"{name}: has a count below 0; give whole numbers from 0")
        return self._checked(numpy.asarray(array, numpy.uint64, order="C"), name, shapes)

    def _checked(self, array: NDArray[Any], name: str, shapes: tuple[Shape, ...]) -> NDArray[Any]:
        shape = shapes[-1] if array.ndim > len(shapes[0]) else shapes[0]
        known = ["{} = {} of {}".format(extent, *self._extents[extent]) for extent in shape
                 if extent in self._extents]  # fmt: skip
        extents = dict(self._extents)
        fits = array.ndim == len(shape) and all(
            size == (int(extent) if extent.isdigit() else extents.setdefault(extent, (size, name))[0])
            for extent, size in zip(shape, array.shape, strict=True)
        )
        if not fits:
            wanted = f"({', '.join(shape)}{',' if len(shape) == 1 else ''})"
            given_by = f" with {' and '.join(known)}" if known else ""
            raise Error(f"{name}: shape {array.shape}; give {wanted}{given_by}")
        self._extents = extents
        return array


def _array(given: Any, name: str, kinds: str, wanted: str) -> NDArray[Any]:
    """The array of numbers of these kinds."""
    try:
        array: NDArray[Any] = numpy.asarray(given)
    except (TypeError, ValueError):
        raise Error(f"{name}: is no array of numbers; give {wanted}") from None
    if array.size and array.dtype.kind not in kinds:
        raise Error(f"{name}: dtype {array.dtype}; give {wanted}")
    return array


def _masked(given: Any) -> Any:
    """The array with its mask where some of its values are masked. A list may hold masked rows or values."""
    if isinstance(given, (list, tuple)):
        if not any(isinstance(item, _MA.MaskedArray) for item in given):
            return None
        given = _MA.asarray(given)
    return given if _MA.is_masked(given) else None


def _refuse_masked(given: Any, name: str) -> None:
    if _masked(given) is not None:
        raise Error(f"{name}: has masked values, which only readings may have; give all of them")
