"""Recordings from logs of ROS 1 and ROS 2: rosbag, sqlite3 and MCAP, read by the package rosbags.

`python -m palpate.bag LOG --list` shows what a log holds; docs/files.md describes the rest.
"""

import argparse
import os
import pathlib
import re
import sys
import warnings
from typing import Any

import numpy

from ._bag import read_bag, topics
from ._bag_fields import _at, _flat
from ._bag_messages import _PRESSURES, place
from ._bag_transforms import stamp_s as stamp_s
from ._error import Error


def readings(message: Any, msgtype: str, field: str = "") -> list[float]:
    """The readings of the array in a message of ROS: in a dotted field such as "sensors.taxels.z", by
    default the one that is known for the message's type, as "tactile_msgs/msg/TactileState", else `data`.

    Raises Error where the message has no such field, or the field holds no numbers.
    """
    path = field or _PRESSURES.get(msgtype, "data")
    try:
        return _flat(_at(message, path))
    except (AttributeError, TypeError, ValueError):
        raise Error(f"{msgtype}: has no list of numbers {path}; give the field of the readings") from None


def _flag_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        "python -m palpate.bag",
        description="Makes a recording (HDF5) from a log of ROS 1 or ROS 2.",
    )
    add = parser.add_argument
    add("log", metavar="LOG", help="bag of ROS 1 (.bag), or of ROS 2: its folder, .db3, .mcap or .mcap.zstd")
    add("--list", action="store_true", help="show the topics, their types, rates and what they may be")
    add("--pressure-topic", metavar="TOPIC", help="topic of the readings; several, of pads on one hand, as "
        "/left,/right")  # fmt: skip
    add("--pressure-field", metavar="FIELD", help="field of its messages, as sensors.taxels.z, or "
        "matrices[1].data of one item, by its index, name or frame [the only list of numbers]")  # fmt: skip
    add("--pose-topic", metavar="TOPIC", help="topic of the array's poses in the robot frame")
    add("--pose-field", metavar="FIELD", help="field of its messages: a pose, or a list of a position and a "
        "quaternion x, y, z, w, of a matrix, of x, y and an angle, or of the six numbers of --euler; or several "
        "fields, as linear,angular [the pose of known types]")  # fmt: skip
    add("--pose-unit", metavar="UNITS", help="mm,rad or mm,deg or m,rad or m,deg [m,rad]")
    add("--euler", metavar="AXES", help="of six numbers: axes about which the last three turn, in their order: xyz, "
        "zyx and so on about fixed axes, ZYX and so on about moving ones; or vector, a rotation vector")  # fmt: skip
    add("--matrix", metavar="ORDER", help="columns or rows [the one by which they are rotations]")
    add("--tf", metavar="TARGET:SOURCE", help="frames of the robot's base and of the array, from /tf")
    add("--truth-tf", metavar="TARGET:SOURCE", help="frames of the robot's base and of the object")
    add("--mount", metavar="X,Y,Z,ROLL,PITCH,YAW", help="the array's pose in the frame whose poses are "
        "given, mm and degrees [it is the array's]")  # fmt: skip
    add("--array", metavar="ARRAY", help="COLUMNS:ROWS:PITCH in mm, or a CSV file of the elements")
    add("--first-element", default="bottom-left", metavar="CORNER",
        help="corner that is read first: bottom-left, bottom-right, top-left, top-right [bottom-left]")  # fmt: skip
    add("--order", default="rows", help="rows or columns [rows]")
    add("--dead", default="", metavar="I,J", help="elements that do not read, from 0")
    add("--pressure-unit", default="kPa", help="kPa or raw [kPa]")
    add("--sign", type=int, default=1, metavar="S", help="-1 where readings fall in presses [1]")
    add("--plane", default="auto", metavar="NX,NY,NZ", help="normal of the touches' plane [auto]")
    add("--largest-gap-s", type=float, metavar="S", help="poses further apart are not interpolated")
    add("--pose-delay", type=float, default=0.0, metavar="S",
        help="by how much later the poses' clock reads than the readings' [0]")  # fmt: skip
    add("--object", default="", metavar="LABEL", help="what was touched")
    add("-o", "--output", metavar="FILE", help="recording to write (HDF5)")
    return parser


def _in_flags(message: str, parser: argparse.ArgumentParser) -> str:
    """The message with options as flags, where it has Python's keywords: "tf=", "pressure_field"."""
    for action in parser._actions:
        if not action.option_strings:
            continue
        name, flag = action.dest, action.option_strings[-1]
        # Some keywords are words of their own, too, and some a field's or a frame's name.
        ends = r"\b=?(?!:)" if "_" in name or name == "tf" else "="
        message = re.sub(rf"(?<![\w/:-]){name}=(?:'([^']*)'|(?=[\w(]))", rf"{flag} \1", message)
        message = re.sub(rf"^{name}(?=:)|(?<![\w/:-]){name}{ends}", flag, message)
    return message


_CLEAR = "\r" + " " * 16 + "\r"  #: the line of progress


def _show_progress(fraction: float) -> None:
    print(f"\rreading {100.0 * fraction:3.0f} %", end="", file=sys.stderr, flush=True)


def _run(arguments: argparse.Namespace) -> None:
    if arguments.list:
        rows = topics(arguments.log)
        width = max((len(row.name) for row in rows), default=0)
        for row in rows:
            print(f"{row.name:{width}}  {row.messages:8d}  {row.rate_hz:7.1f} Hz  {row.type}"
                  + (f"  ({row.guess})" if row.guess else ""))  # fmt: skip
        return
    for flag in ("pressure_topic", "array", "output"):
        if getattr(arguments, flag) is None:
            raise Error(f"--{flag.replace('_', '-')}: missing; --list shows the topics of the log")
    if arguments.mount == "":  # which to an import is none
        raise Error("--mount: give X,Y,Z,ROLL,PITCH,YAW, mm and degrees")
    folder = os.path.dirname(arguments.output) or "."
    if os.path.isdir(arguments.output) or not os.access(folder, os.W_OK):
        raise Error(f"-o {arguments.output}: cannot be written; give a file in a folder that exists")
    output, log = pathlib.Path(arguments.output), place(pathlib.Path(arguments.log))
    files = [(file, "LOG") for file in (log, *log.glob("*")) if file.suffix != ".h5"]  # recordings may lie there
    for file, reader in (*files, (pathlib.Path(arguments.array), "--array")):
        if output.exists() and file.exists() and output.samefile(file):
            raise Error(f"-o {output}: would overwrite {file}, which {reader} reads; choose another name")
    shown = sys.stderr.isatty()
    options = vars(arguments) | {"progress": _show_progress if shown else None}
    options["pressure_topic"] = arguments.pressure_topic.split(",")
    del options["list"], options["output"]
    recording = read_bag(**options)
    if shown:
        print(_CLEAR, end="", file=sys.stderr)
    recording.save(output)
    posed = f"{int(numpy.isfinite(recording.T_robot_sensor[:, 0]).sum())} with a pose"
    if arguments.tf is None and arguments.pose_topic is None:
        posed = "none with a pose, as neither --tf nor --pose-topic is given"
    print(f"{output}: {len(recording)} frames of {recording.pressure.shape[1]} elements, "
          f"{posed}; next: palpate touches {output} -o TOUCHES.h5")  # fmt: skip


def main() -> int:
    """The command; returns its exit status, 2 where the input is wrong."""
    parser = _flag_parser()

    def say(message: object) -> None:
        clear = _CLEAR if sys.stderr.isatty() else ""
        print(f"{clear}palpate.bag: {_in_flags(str(message), parser)}", file=sys.stderr)

    warnings.showwarning = lambda message, *_: say(message)
    try:
        _run(parser.parse_args())
    except (Error, OSError) as error:
        say(error)
        return 1 if getattr(error, "fault", "input") == "system" else 2
    except KeyboardInterrupt:
        say("interrupted")
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
