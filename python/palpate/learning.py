"""`palpate map` as a function, with the command's rules, defaults and words."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from . import _palpate
from ._palpate import Device, LearnedSensor, OccupancyGrid
from .recognition import _Path, _Recordings, filled, request_of, warn


@dataclass(frozen=True)
class LearnedMaps:
    """Maps that learn_maps() learned, with the sensor that their touches tell.

    maps: by label, of several maps of a label those of more presses first; sensor: None where the touches
    do not tell that it is better than Eq. 7; words: what the command prints of them, line by line.
    """

    maps: list[OccupancyGrid]
    sensor: LearnedSensor | None
    words: list[str]


def learn_maps(
    recordings: _Recordings,
    folder: _Path | None = None,
    *,
    cell_mm: float | None = None,
    spread_mm: float | None = None,
    peak: float | None = None,
    prior: float | Literal["auto"] | None = None,
    origin: tuple[float, float, float] | Literal["auto", "centroid", "robot"] | None = None,
    symmetry: int | Mapping[str, int] | None = None,
    mirror: bool = False,
    label: str = "",
    group: Literal["", "recording", "label"] = "",
    unposed: bool = False,
    max_maps: int | None = None,
    threshold: float | None = None,
    ratio: float | None = None,
    sensor_model: _Path | Literal["none"] | None = None,
    touch_sd_mm: float | None = None,
    touch_sd_deg: float | None = None,
    frames: tuple[int, int] | None = None,
    device: Device | str | int | None = None,
    progress: Callable[[float], object] | None = None,
) -> LearnedMaps:
    """Learns maps of objects from touches, and the sensor with them, as `palpate map` does.

    Options are the flags of `palpate map`, with its defaults; `palpate map --help` explains them.

    recordings: of touches, each with its `object`; folder: where to write the maps, LABEL.map.h5, and
    the sensor, sensor.yaml, as `palpate map -o FOLDER/` does, so that recognize() with the folder takes
    both, and the sensor is learned from the touches of all maps in it; None writes nothing. origin:
    (x_mm, y_mm, degrees) of the object's frame in the robot frame, or a word; symmetry: n-fold, of all
    objects or by label; frames (a, b): the touches a to b - 1; device: an open Device, or a name or index
    as for Device.open(); touches at unknown poses use none.

    Raises Error in the words of the command. What the command would say on standard error becomes a
    UserWarning.
    """
    given = locals()
    shared = ("threshold", "ratio", "sensor_model", "touch_sd_mm", "touch_sd_deg", "frames", "device")
    own = ("cell_mm", "spread_mm", "peak", "mirror", "label", "group", "unposed", "max_maps")
    options = {name: given[name] for name in own}
    if folder is not None:
        options["output"] = os.path.join(os.fsdecode(folder), "")
    if prior is not None:
        options["prior"] = str(prior)
    if origin is not None:
        options["origin"] = origin if isinstance(origin, str) else ",".join(map(str, origin))
    if isinstance(symmetry, Mapping):
        options["symmetry"] = ",".join(f"{name}={n}" for name, n in symmetry.items())
    elif symmetry is not None:
        options["symmetry"] = str(symmetry)
    maps, sensor, words, sentences = _palpate.learn_maps(
        recordings,
        request_of({name: given[name] for name in shared}),
        filled(_palpate.MapRequest(), learn_maps, options),
        progress,
    )
    warn(sentences)
    return LearnedMaps(maps, sensor, words)
