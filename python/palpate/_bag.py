"""Recordings from logs of ROS 1 and ROS 2: rosbag, sqlite3 and MCAP, read by the package rosbags."""

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

from . import _palpate
from ._bag_messages import Progress, Topic, opened
from ._bag_transforms import Row
from ._error import Error
from ._palpate import Recording
from .recognition import _Path, array_option, filled, warn

# The build writes the stubs by importing the package, where there is no NumPy.
if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray


def read_bag(
    log: _Path,
    *,
    pressure_topic: str,
    array: "tuple[int, int, float] | _Path | ArrayLike",
    pressure_field: str | None = None,
    pose_topic: str | None = None,
    tf: tuple[str, str] | None = None,
    truth_tf: tuple[str, str] | None = None,
    first_element: Literal["bottom-left", "bottom-right", "top-left", "top-right"] = "bottom-left",
    order: Literal["rows", "columns"] = "rows",
    dead: Sequence[int] = (),
    pressure_unit: Literal["kPa", "raw"] = "kPa",
    plane: tuple[float, float, float] | Literal["auto"] = "auto",
    largest_gap_s: float | None = None,
    object: str = "",
    progress: Progress | None = None,
) -> Recording:
    """Makes a recording of frames from a log of ROS, with the pose of the sensor at each frame's time.

    log: a bag of ROS 1 (.bag), or of ROS 2: its folder, or its .db3 or .mcap file; pressure_topic: of
    any message with a list of numbers, which pressure_field names where it is not the only one:
    "sensors.taxels.z", a list in each item of a list; pose_topic: of poses or transforms in metres; or
    tf: (target, source) frames of /tf and /tf_static, T_target_source, the robot's base and the array;
    truth_tf: (base, object), where the object truly lies, for the recording's truth; object: its label.
    Times are those of the messages' headers, or of their reception where a message has no header. Other
    options are those of import_tables(). progress(fraction) is called now and then.

    Raises Error naming log and topic. What import_tables() warns of, and messages without a header,
    become a UserWarning.
    """
    if pose_topic is not None and tf is not None:
        raise Error("pose_topic and tf: both say where the sensor is; leave one of them out")
    if truth_tf is not None and pose_topic is None and tf is None:
        raise Error("truth_tf: needs the sensor's poses in the same frame; give pose_topic or tf")
    name = os.fsdecode(log)
    with opened(name) as bag:
        frames = bag.pressures(pressure_topic, pressure_field)
        poses = bag.poses(pose_topic) if pose_topic is not None else None
        wanted = [chain for chain in (tf, truth_tf) if chain is not None]
        tree = bag.transforms(wanted) if wanted else None
        bag.read([part for part in (frames, poses, tree) if part is not None], progress)
    frames.require_some(name)
    pressure, time_s = frames.arrays(name)
    pose_time_s: ArrayLike = ()
    rows: ArrayLike | None = None
    truth: Row | None = None
    remarks = frames.remarks(name)
    if poses is not None:
        poses.require_some(name)
        pose_time_s, rows = poses.in_order()
        remarks += poses.remarks(name)
    if tf is not None and tree is not None:
        rows = tree.chain(name, *tf, time_s.tolist(), largest_gap_s)  # one for each frame
        remarks += tree.remarks(name, tf, rows)
    if truth_tf is not None and tree is not None:
        truth = tree.still(name, *truth_tf, time_s.tolist())
    text, elements_mm = array_option(array)
    options = {
        "array": text,
        "pressures": f"{name}: {pressure_topic}",
        "poses": f"{name}: {pose_topic or (':'.join(tf) if tf else '')}" if rows is not None else "",
        "first_element": first_element,
        "order": order,
        "dead": ",".join(map(str, dead)),
        "pressure_unit": pressure_unit,
        "plane": plane if isinstance(plane, str) else ",".join(map(str, plane)),
        "largest_gap_s": largest_gap_s,
        "object": object,
    }
    recording, sentences = _palpate.import_rows(
        filled(_palpate.ImportOptions(), read_bag, options),
        pressure,
        time_s,
        _array(pose_time_s, (-1,)),
        elements_mm,
        None if rows is None else _array(rows, (-1, 7)),
        None if truth is None else _array(truth, (7,)),
    )
    warn([*sentences, *remarks])
    return recording


def topics(log: _Path) -> "list[Topic]":
    """The topics of a log, by name. Raises Error where it cannot be read."""
    with opened(os.fsdecode(log)) as bag:
        return bag.topics()


def _array(values: "ArrayLike", shape: tuple[int, ...]) -> "NDArray[numpy.float64]":
    import numpy

    return numpy.asarray(values, dtype=numpy.float64).reshape(shape)
