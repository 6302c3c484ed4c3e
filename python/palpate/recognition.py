"""`palpate recognize` as a function, with the command's rules, defaults and words."""

import inspect
import os
import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, TypedDict, TypeVar

from . import _palpate
from ._palpate import Device, Hypothesis, OccupancyGrid, Recording
from .results import Record

_Path = str | bytes | os.PathLike[str] | os.PathLike[bytes]
_Pair = tuple[float, float]
_Recordings = Recording | _Path | Iterable[Recording | _Path]
_Maps = OccupancyGrid | Hypothesis | _Path | Iterable[OccupancyGrid | Hypothesis | _Path]
_Request = TypeVar("_Request")


class RecognitionOptions(TypedDict, total=False):
    """Options of recognize(), by their names, that plan() and Task have, too."""

    bins: tuple[int, int, int] | Literal["auto", "fine"]
    x_mm: _Pair
    y_mm: _Pair
    theta_deg: _Pair
    pivot_mm: _Pair | Literal["auto"]
    scene: _Path
    sensor_model: _Path | Literal["none"]
    prior: float
    gamma: float
    threshold: float
    ratio: float
    touch_sd_mm: float
    touch_sd_deg: float
    slip_sd_mm: float
    slip_sd_deg: float
    none: float | Literal["auto"]
    filter: Literal["auto", "histogram", "bounded", "particles"]
    tolerance: float
    evidence_nats: float
    act_below_mm: float
    act_above: float
    frames: tuple[int, int]
    touches: int


def recognize(
    recordings: _Recordings,
    maps: _Maps = (),
    *,
    bins: tuple[int, int, int] | Literal["auto", "fine"] | None = None,
    x_mm: _Pair | None = None,
    y_mm: _Pair | None = None,
    theta_deg: _Pair | None = None,
    pivot_mm: _Pair | Literal["auto"] | None = None,
    scene: _Path | None = None,
    sensor_model: _Path | Literal["none"] | None = None,
    prior: float | None = None,
    gamma: float | None = None,
    threshold: float | None = None,
    ratio: float | None = None,
    touch_sd_mm: float | None = None,
    touch_sd_deg: float | None = None,
    slip_sd_mm: float | None = None,
    slip_sd_deg: float | None = None,
    none: float | Literal["auto"] | None = None,
    filter: Literal["auto", "histogram", "bounded", "particles"] | None = None,
    tolerance: float | None = None,
    budget_ms: float | None = None,
    evidence_nats: float | None = None,
    act_below_mm: float | None = None,
    act_above: float | None = None,
    particles: int | None = None,
    resampling: Literal["multinomial", "systematic"] | None = None,
    augmented: bool = False,
    seed: int | None = None,
    frames: tuple[int, int] | None = None,
    touches: int | None = None,
    each_frame: bool = False,
    trace: bool = False,
    device: Device | str | int | None = None,
    progress: Callable[[float], object] | None = None,
) -> list[Record]:
    """Recognises the object of each recording among known maps and finds its pose.

    Options are the flags of `palpate recognize`, with its defaults; `palpate recognize --help`
    explains them. Records are those of its JSON, number for number.

    recordings: Recording objects or files; maps: OccupancyGrid or Hypothesis objects, files, or
    folders of maps; none where the scene has them. sensor_model: a file; "none" is Eq. 7; by default
    the sensor.yaml that `palpate map` wrote beside the files of the maps. bins: counts of x, y and theta
    of T_object_robot; x_mm, y_mm, theta_deg: their ranges (lower, upper); pivot_mm (x, y) in the robot
    frame; frames (a, b): the touches a to b - 1; device: an open Device, or a name or index as for
    Device.open(). progress(fraction) is called up to 20 times a second.

    Raises Error in the words of the command, with options as keyword arguments. What the command
    would say on standard error becomes a UserWarning; what looks wrong with the touches is in the
    records' `warnings`.
    """
    options = {
        name: value
        for name, value in locals().items()
        if name not in ("recordings", "maps", "progress")
    }
    records, sentences = _palpate.recognize(recordings, request_of(options, maps), progress)
    warn(sentences)
    return [Record(record) for record in records]


def request_of(options: Mapping[str, object], maps: object = ()) -> _palpate.Request:
    """The options and maps of recognize() as a request; None leaves the default."""
    if options.get("none") is True:  # as --none without a number
        options = {**options, "none": "auto"}
    return filled(_palpate.Request(maps), recognize, options)


def filled(request: _Request, function: Callable[..., Any], options: Mapping[str, Any]) -> _Request:
    """The request with the options of a function; None leaves the default."""
    for name, value in options.items():
        if value is not None:
            path = isinstance(value, (bytes, os.PathLike))
            try:
                setattr(request, name, os.fsdecode(value) if path else value)
            except TypeError:
                wanted = inspect.formatannotation(function.__annotations__[name])
                raise TypeError(f"{name}: {value!r}; give {wanted}") from None
    return request


def array_option(array: Any) -> tuple[str | None, Any]:
    """What the option `array` says as a text, or else the elements' centres."""
    if isinstance(array, tuple) and len(array) == 3 and isinstance(array[0], int):
        return ":".join(map(str, array)), None
    if isinstance(array, (str, bytes, os.PathLike)):
        return os.fsdecode(array), None
    return None, array


def warn(sentences: list[str]) -> None:
    """Warns the caller of the function that calls this one."""
    for sentence in sentences:
        warnings.warn(sentence, stacklevel=3)
