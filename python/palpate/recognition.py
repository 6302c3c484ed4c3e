"""`palpate recognize` as a function, with the command's rules, defaults and words."""

import inspect
import os
import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Literal, TypedDict, TypeVar

from . import _palpate
from ._palpate import Device, Hypothesis, OccupancyGrid
from ._recording import Recording
from .results import Record

if TYPE_CHECKING:
    from typing_extensions import Unpack

_Path = str | bytes | os.PathLike[str] | os.PathLike[bytes]
_Pair = tuple[float, float]
_Recordings = Recording | _Path | Iterable[Recording | _Path]
_Maps = OccupancyGrid | Hypothesis | _Path | Iterable[OccupancyGrid | Hypothesis | _Path]
_Request = TypeVar("_Request")


class RecognitionOptions(TypedDict, total=False):
    """Options of recognize(), plan() and Task, by their names; None is the default."""

    bins: tuple[int, int, int] | Literal["auto", "fine"] | None
    x_mm: _Pair | None
    y_mm: _Pair | None
    theta_deg: _Pair | None
    pivot_mm: _Pair | Literal["auto"] | None
    scene: _Path | None
    sensor_model: _Path | Literal["none"] | None
    prior: float | None
    gamma: float | None
    threshold: float | None
    ratio: float | None
    touch_sd_mm: float | None
    touch_sd_deg: float | None
    slip_sd_mm: float | None
    slip_sd_deg: float | None
    none: float | Literal["auto"] | None
    filter: Literal["auto", "histogram", "bounded", "particles"] | None
    tolerance: float | None
    evidence_nats: float | None
    act_below_mm: float | None
    act_above: float | None
    frames: tuple[int, int] | None
    touches: int | None


def recognize(
    recordings: _Recordings,
    maps: _Maps = (),
    *,
    budget_ms: float | None = None,
    particles: int | None = None,
    resampling: Literal["multinomial", "systematic"] | None = None,
    augmented: bool = False,
    seed: int | None = None,
    each_frame: bool = False,
    trace: bool = False,
    device: Device | str | int | None = None,
    progress: Callable[[float], object] | None = None,
    **options: "Unpack[RecognitionOptions]",
) -> list[Record]:
    """Recognises the object of each recording among known maps and finds its pose.

    Options are the flags of `palpate recognize`, with its defaults: those of the signature, and those
    that RecognitionOptions lists; `palpate recognize --help` explains them. Records are those of its
    JSON, number for number.

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
    own = without(locals(), "recordings", "maps", "progress", "options")
    records, sentences = _palpate.recognize(
        recordings, recognition_request("recognize", options, maps, **own), progress
    )
    warn(sentences)
    return [Record(record) for record in records]


def without(given: Mapping[str, Any], *names: str) -> dict[str, Any]:
    """The arguments that a function was given, but for these."""
    return {name: value for name, value in given.items() if name not in names}


def recognition_request(
    function: str, options: RecognitionOptions, maps: _Maps, **own: object
) -> _palpate.Request:
    """What a function is asked by these options, and those of its own."""
    for name in options:
        if name not in RecognitionOptions.__annotations__:
            raise TypeError(f"{function}() got an unexpected keyword argument '{name}'")
    return request_of({**options, **own}, maps)


def request_of(options: Mapping[str, object], maps: object = ()) -> _palpate.Request:
    """The options and maps of recognize() as a request; None leaves the default."""
    if options.get("none") is True:  # as --none without a number
        options = {**options, "none": "auto"}
    return filled(_palpate.Request(maps), recognize, options)


def requests_of(
    own: _Request, function: Callable[..., Any], options: Mapping[str, Any], maps: object = ()
) -> tuple[_palpate.Request, _Request]:
    """The options of a function as a request of recognize()'s, and as one of its own, which has its others."""
    mine = {name: value for name, value in options.items() if hasattr(own, name)}
    return request_of(without(options, *mine), maps), filled(own, function, mine)


def filled(request: _Request, function: Callable[..., Any], options: Mapping[str, Any]) -> _Request:
    """The request with the options of a function; None leaves the default."""
    for name, value in options.items():
        if value is not None:
            path = isinstance(value, (bytes, os.PathLike))
            try:
                setattr(request, name, os.fsdecode(value) if path else value)
            except TypeError:
                types = RecognitionOptions.__annotations__ | function.__annotations__
                wanted = inspect.formatannotation(types[name])
                raise TypeError(f"{name}: {value!r}; give {wanted}") from None
    return request


def import_request(
    function: Callable[..., Any], options: Mapping[str, Any]
) -> _palpate.ImportOptions:
    """What an import is asked; an array that is no text, path or grid is the elements' centres."""
    texts = dict(options)
    array = texts.pop("array")
    if isinstance(array, (tuple, list)) and len(array) == 3 and not isinstance(array[0], Iterable):
        texts["array"] = ":".join(map(str, array))
    elif isinstance(array, (str, bytes, os.PathLike)):
        texts["array"] = array
    else:
        texts["elements_mm"] = array
    for name in ("dead", "plane", "mount", "pose_unit", "pose_columns", "pressure_columns"):
        if isinstance(given := texts.get(name), Iterable) and not isinstance(given, str):
            texts[name] = ",".join(map(str, given))
    return filled(_palpate.ImportOptions(), function, texts)


def warn(sentences: list[str]) -> None:
    """Warns the caller of the function that calls this one."""
    for sentence in sentences:
        warnings.warn(sentence, stacklevel=3)
