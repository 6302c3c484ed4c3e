"""Recordings from logs of ROS 1 and ROS 2: rosbag, sqlite3 and MCAP, read by the package rosbags."""

import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

from . import _palpate
from ._error import Error
from ._recording import Recording
from .recognition import _Path, import_request, warn, without

# The build writes the stubs by importing the package, where there is no NumPy.
if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._bag_messages import Topic


def _frames(name: str, frames: tuple[str, str] | str | None) -> tuple[str, str] | None:
    given = frames.split(":", 1) if isinstance(frames, str) else list(frames or ())
    if frames is not None and (len(given) != 2 or not all(given)):
        raise Error(f"{name} {frames}: give two frames, TARGET:SOURCE")
    return (given[0], given[1]) if given else None


def read_bag(
    log: _Path,
    *,
    pressure_topic: str | Sequence[str],
    array: "tuple[int, int, float] | _Path | ArrayLike",
    pressure_field: str | None = None,
    pose_topic: str | None = None,
    pose_field: str | None = None,
    pose_unit: tuple[Literal["mm", "m"], Literal["rad", "deg"]] | None = None,
    euler: str | None = None,
    matrix: Literal["columns", "rows"] | None = None,
    tf: tuple[str, str] | str | None = None,
    truth_tf: tuple[str, str] | str | None = None,
    mount: tuple[float, float, float, float, float, float] | None = None,
    first_element: Literal["bottom-left", "bottom-right", "top-left", "top-right"] = "bottom-left",
    order: Literal["rows", "columns"] = "rows",
    dead: Sequence[int] = (),
    pressure_unit: Literal["kPa", "raw"] = "kPa",
    sign: Literal[1, -1] = 1,
    plane: tuple[float, float, float] | Literal["auto"] = "auto",
    largest_gap_s: float | None = None,
    pose_delay: float = 0.0,
    object: str = "",
    progress: Callable[[float], object] | None = None,
) -> Recording:
    """Makes a recording of frames from a log of ROS, with the pose of the sensor at each frame's time.

    log: a bag of ROS 1 (.bag), or of ROS 2: its folder, or its .db3 or .mcap file; pressure_topic: of
    any message with a list of numbers, which pressure_field names where it is not the only one:
    "sensors.taxels.z", a list in each item of a list, or "matrices[1].data", of one item by its index, name
    or frame; several topics, of pads on one hand, are one array, whose elements follow in their order, and a
    frame of the first takes the nearest of the others; flags beside them that are called valid, validity,
    is_valid or mask make readings unknown;
    pose_topic: of poses or transforms, or of messages whose pose_field is one, or a list of numbers as tables
    have them: a position and a quaternion x, y, z, w, a matrix, x, y and an angle, or x, y, z and what euler
    says; "linear,angular", whose numbers follow one another; in pose_unit, m and rad if None; or
    tf: (target, source), frames of /tf and /tf_static, T_target_source, the robot's base and the array;
    truth_tf: (base, object), where the object truly lies, for the recording's truth, which an object that
    moves by more than 1 mm or 1 degree does not have; object: its label. A frame of /tf_static that moves
    in /tf is taken from /tf. mount: x, y, z, roll, pitch, yaw, mm and degrees: where the array sits in the
    frame whose poses are given.
    Times are those of the messages' headers, or of their reception where a message has no header. Other
    options are those of import_tables(). progress(fraction) is called now and then.

    Raises Error naming log and topic. What import_tables() warns of, and messages without a header,
    become a UserWarning.
    """
    options = without(locals(), "log", "pressure_topic", "pressure_field", "pose_topic", "pose_field", "tf",
                      "truth_tf", "progress")  # fmt: skip
    from ._bag_fields import together
    from ._bag_messages import opened

    name = os.fsdecode(log)
    names = [pressure_topic] if isinstance(pressure_topic, str) else list(pressure_topic)
    tf, truth_tf = _frames("tf", tf), _frames("truth_tf", truth_tf)
    unposed = pose_topic is None and tf is None
    for wrong, words in (
        (not names, "pressure_topic: names no topic; give one"),
        (pose_topic is not None and tf, "pose_topic and tf both say where the sensor is; leave one of them out"),
        *((given is not None and pose_topic is None, f"{name}: is of the poses of a topic; give pose_topic")
          for name, given in (("pose_field", pose_field), ("pose_unit", pose_unit), ("euler", euler),
                              ("matrix", matrix))),
        (mount is not None and unposed, "mount: is for poses; give pose_topic or tf"),
        (truth_tf and unposed, "truth_tf: needs the sensor's poses in the same frame; give pose_topic or tf"),
        (truth_tf and not object, "truth_tf: needs the object's label; give object="),
    ):
        if wrong:
            raise Error(words)
    source = pose_topic or (":".join(tf) if tf else "")
    options["pressures"] = f"{name}: {', '.join(names)}"
    options["poses"] = f"{name}: {source}" if source else ""
    options["pose_unit"] = pose_unit or (None if pose_topic is None else "m,rad")
    request = import_request(read_bag, options)
    _palpate.require_sound(request)
    with opened(name) as bag:
        pads = [bag.pressures(topic, pressure_field) for topic in names]
        poses = [] if pose_topic is None else [bag.poses(pose_topic, pose_field, request)]
        tree = bag.transforms([chain for chain in (tf, truth_tf) if chain is not None])
        parts: list[Any] = [*pads, *poses, tree]
        bag.read(parts, progress)
    time_s, pressures = together(pads)
    at_s = time_s + pose_delay
    pose_time_s, rows = poses[0].in_order() if poses else ((), None)
    truth = None if truth_tf is None else tree.still(*truth_tf, at_s)
    if tf is not None:
        rows = tree.poses(*tf, at_s, largest_gap_s)
    remarks = [remark for part in parts for remark in part.remarks()]
    del pads, poses, tree, parts  # the memory of a long log
    recording, said = _palpate.import_frames(request, pressures, time_s, pose_time_s, rows, truth)
    warn(said + remarks)
    return recording


def topics(log: _Path) -> "list[Topic]":
    """The topics of a log, by name. Raises Error where it cannot be read."""
    from ._bag_messages import opened

    with opened(os.fsdecode(log)) as bag:
        return bag.topics()
