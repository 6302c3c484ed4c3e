"""`palpate import`, `check`, `calibrate`, `map`, `plan` and `evaluate` as functions.

They have the commands' rules, defaults and words.
"""

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from . import _palpate
from ._error import Error
from ._palpate import Device, LearnedSensor, OccupancyGrid, Truth
from ._recording import Recording
from .many import Recognized
from .recognition import (
    RecognitionOptions,
    _Maps,
    _Pair,
    _Path,
    _Recordings,
    import_request,
    recognition_request,
    request_of,
    requests_of,
    warn,
    without,
)
from .results import Evaluation, Plan, SensorCalibration, SetupCheck

# The build writes the stubs by importing the package, where there is no NumPy.
if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Unpack


def plan(
    recording: Recording | _Path,
    maps: _Maps = (),
    *,
    candidates: "Literal['grid'] | _Path | ArrayLike" = "grid",
    goal: Literal["identity", "pose", "both"] = "both",
    samples: int = 96,
    plan_seed: int = 0,
    budget_ms: float | None = None,
    device: Device | str | int | None = None,
    progress: Callable[[float], object] | None = None,
    **options: "Unpack[RecognitionOptions]",
) -> Plan:
    """Ranks poses for the next touch by what each is expected to tell, as `palpate plan` does.

    recording: the touches so far; maps, device, progress and options: as for recognize(); candidates:
    T_robot_sensor [n, 3] (x_mm, y_mm, theta_rad), a CSV file of such poses, a recording whose touches'
    poses are taken, or "grid": 100 to 300 poses about the places where the object may be; goal: what
    the touch shall tell; samples, 2 to 4096: objects and poses that stand for the belief; the time
    grows with its square; plan_seed: of the samples; budget_ms: as for recognize().

    Raises Error in the words of the command, also for particles, which have no belief of all poses.
    What the command would say on standard error becomes a UserWarning.
    """
    request = recognition_request("plan", options, maps, budget_ms=budget_ms, device=device)
    fields, sentences = _palpate.plan(
        [recording], request, goal, candidates, samples, plan_seed, progress
    )
    warn(sentences)
    return Plan(fields)


def calibrate(
    recordings: _Recordings,
    *,
    maps: _Maps = (),
    unposed: bool = False,
    threshold: float | None = None,
    ratio: float | None = None,
    layer: Literal["auto", "mean_level", "log_odds"] = "auto",
    levels: int | None = None,
    max_maps: int = 5,
    group: Literal["", "recording", "label"] = "",
    bins: tuple[int, int, int] | None = None,
    x_mm: _Pair | None = None,
    y_mm: _Pair | None = None,
    theta_deg: _Pair | None = None,
    pivot_mm: _Pair | Literal["auto"] | None = None,
    frames: tuple[int, int] | None = None,
    device: Device | str | int | None = None,
    progress: Callable[[float], object] | None = None,
) -> SensorCalibration:
    """Learns a sensor model from touches of known objects, as `palpate calibrate` does.

    recordings: of touches, each with its `object`; where all touches of a recording are at one pose,
    or with unposed, their poses count as unknown. Touches at known poses are at poses of the sensor in
    the object's frame, on given maps those that their truth says. maps: to compare touches with, drawn,
    which also tell where the array sits in the tool, or built from other touches; none: maps of the
    touches themselves, each compared with maps that were built without it. group: whose touches are
    alike, such as a person's or a day's, and are left out together, so that the pose scale and how sure
    to be hold for people and days to come: "recording", those of each recording; "label", those of each
    GROUP of objects that are named LABEL@GROUP. Other options are the flags
    of `palpate calibrate`, with its defaults: threshold, in the recordings' pressure unit, and ratio
    are learned where they are not given; bins, x_mm, y_mm, theta_deg and pivot_mm are those that
    recognize() will be given, for touches at known poses; device: an open Device, or a name or index
    as for Device.open(); touches at unknown poses use none.

    Raises Error in the words of the command. What could not be learned is in the result's `warnings`.
    """
    options = without(locals(), "recordings", "maps", "progress")
    if isinstance(bins, str):
        raise TypeError(f"bins: {bins!r}; give counts, such as (25, 25, 16), or leave it out")
    request, own = requests_of(_palpate.CalibrationRequest(), calibrate, options, maps)
    fields, sensor = _palpate.calibrate(recordings, request, own, progress)
    return SensorCalibration(fields, sensor)


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
    options = without(locals(), "recordings", "folder", "progress")
    if folder is not None:
        options["output"] = os.path.join(os.fsdecode(folder), "")
    if prior is not None:
        options["prior"] = str(prior)
    if origin is not None and not isinstance(origin, str):
        options["origin"] = ",".join(map(str, origin))
    if isinstance(symmetry, Mapping):
        options["symmetry"] = ",".join(f"{name}={n}" for name, n in symmetry.items())
    elif symmetry is not None:
        options["symmetry"] = str(symmetry)
    request, own = requests_of(_palpate.MapRequest(), learn_maps, options)
    maps, sensor, words, sentences = _palpate.learn_maps(recordings, request, own, progress)
    warn(sentences)
    return LearnedMaps(maps, sensor, words)


def check_setup(
    recordings: _Recordings,
    *,
    threshold: float | None = None,
    ratio: float | None = None,
    cell_mm: float = 0.5,
    spread_mm: float | None = None,
    device: Device | str | int | None = None,
    progress: Callable[[float], object] | None = None,
) -> SetupCheck:
    """Asks touches which set-up explains them best, as `palpate check` does.

    recordings: of touches at known poses, of one array and of objects that stay in place: some 60 of
    each, at several angles of the sensor. Tried are the order of the elements, where the array sits in
    the tool, its pitch and units of the poses; elements that are dead and touches that contradict the
    others are found. threshold, in the recordings' pressure unit, ratio, cell_mm and spread_mm are those
    of the maps; the spread is by default a quarter of the distance of neighbouring elements, 0.5 mm for
    one element and DigiTacts.

    Raises Error where an object has fewer than four touches in contact, or the arrays differ.
    """
    request = request_of({"threshold": threshold, "ratio": ratio, "device": device})
    return SetupCheck(_palpate.check_setup(recordings, request, cell_mm, spread_mm, progress))


def evaluate(
    results: Mapping[str, Any]
    | Recognized
    | _Path
    | Iterable[Mapping[str, Any] | Recognized | _Path],
) -> Evaluation:
    """Compares what was recognised with the truth, as `palpate evaluate` does, number for number.

    results: records of recognize(), results of recognize_many(), and files and folders as `palpate
    evaluate` takes them. Records without a true label, and those with an error, are left out and
    counted.

    Raises Error where no record has a true label, and on what is no record.
    """
    if isinstance(results, (Mapping, Recognized, str, bytes, os.PathLike)):
        results = [results]
    items: list[Any] = list(results)
    paths = [os.fsdecode(item) for item in items if isinstance(item, (str, bytes, os.PathLike))]
    records = [item.record if isinstance(item, Recognized) else item
               for item in items if not isinstance(item, (str, bytes, os.PathLike))]  # fmt: skip
    # As in the command's JSON, numbers that are not finite are null, and names need not be UTF-8.
    finite = json.loads(json.dumps(records), parse_constant=lambda _: None)
    text = json.dumps(finite, ensure_ascii=False).encode(errors="replace")
    return Evaluation(_palpate.evaluate_results(paths, text))


def import_tables(
    pressures: "_Path | ArrayLike",
    *,
    array: "tuple[int, int, float] | _Path | ArrayLike",
    first_element: Literal["bottom-left", "bottom-right", "top-left", "top-right"] = "bottom-left",
    order: Literal["rows", "columns"] = "rows",
    dead: Sequence[int] = (),
    poses: "_Path | ArrayLike | None" = None,
    time_s: "ArrayLike | None" = None,
    pose_time_s: "ArrayLike | None" = None,
    unposed: bool = False,
    rows: Literal["frames", "touches"] | None = None,
    pressure_unit: Literal["kPa", "raw"] = "kPa",
    sign: Literal[1, -1] = 1,
    pose_unit: tuple[Literal["mm", "m"], Literal["rad", "deg"]] | None = None,
    time_unit: Literal["s", "ms", "us", "ns"] | None = None,
    time_column: str | None = None,
    header_line: int | None = None,
    where: Mapping[str, str | float] | None = None,
    pressure_columns: str | Sequence[str] | None = None,
    pressure_component: Literal["z", "norm"] | None = None,
    pose_columns: str | Sequence[str] | None = None,
    euler: str | None = None,
    matrix: Literal["columns", "rows"] | None = None,
    mount: tuple[float, float, float, float, float, float] | None = None,
    plane: tuple[float, float, float] | Literal["auto"] = "auto",
    largest_gap_s: float | None = None,
    pose_delay: float = 0.0,
    rate: float | None = None,
    object: str = "",
    truth: Truth | None = None,
) -> Recording:
    """Makes a recording from tables, as `palpate import` does; docs/files.md describes them.

    pressures: a CSV file, or readings [n, e] or [n, rows, columns] (order="columns": [n, columns, rows]) with
    their times time_s [n] in s, where NaN is unknown; array: (columns, rows, pitch_mm), a CSV file, or the
    elements' centres [e, 2] in mm in the sensor frame, in the order of their readings; first_element and order: where the first element of a grid lies, seen with x to
    the right and y upwards, and which follow it; dead: elements that do not read, from 0; sign: -1
    where readings fall under load, which are taken times -1; poses: a CSV
    file of T_robot_sensor, in mm and rad where neither its columns' names nor pose_unit say otherwise, or,
    beside readings, poses [m, 3] of x, y, theta, [m, 7] of a position and a quaternion x, y, z, w, [m, 6] of
    x, y, z and what euler says, or [m, 12] or [m, 16] of matrices, at pose_time_s [m], or one for each frame;
    mount: x, y, z, roll, pitch, yaw, mm and degrees, the array's pose in the frame whose poses are given;
    where: columns, and what their cells must be;
    plane: of the touches, where poses are in space: found from them, or its normal in the robot frame;
    pose_delay: by how much later the poses' clock reads than the readings', s; rate: frames per second
    of pressures without times, Hz; object: label of what was touched; truth:
    its true identity and pose. Other options are the flags of the command, with its defaults.

    Raises Error in the words of the command, naming file and line or row. Frames without a pose
    between two poses, columns of poses that were left out, units that nothing gives, and clocks that
    differ become a UserWarning.
    """
    options = without(locals(), "truth", "time_s", "pose_time_s")
    options["where"] = [f"{name}={value}" for name, value in (where or {}).items()]
    if isinstance(pressures, (str, bytes, os.PathLike)):
        if time_s is not None or pose_time_s is not None:
            raise Error("time_s and pose_time_s: are for arrays; a table has a column of times")
        recording, sentences = _palpate.import_tables(import_request(import_tables, options))
    elif isinstance(poses, (str, bytes, os.PathLike)):
        raise Error(f"poses: {os.fsdecode(poses)!r} is a file beside an array of pressures; give an array")
    else:
        for name in ("time_unit", "time_column", "header_line", "where", "pressure_columns",
                     "pressure_component", "pose_columns"):  # fmt: skip
            if options[name] not in (None, []):
                raise Error(f"{name}: is for tables; leave it out beside arrays")
        if pose_time_s is not None and poses is None:
            raise Error("pose_time_s: is of poses; give poses")
        options |= {"pressures": "pressures", "poses": None if poses is None else "poses"}
        recording, sentences = _palpate.import_frames(
            import_request(import_tables, options),
            pressures,
            time_s,
            () if pose_time_s is None else pose_time_s,
            poses,
        )
    recording.truth = truth
    warn(sentences)
    return recording
