"""Turns letters that an XELA array touched on a grid of positions into recordings of Palpate.

The arrays are those of the raw data of github.com/wmtlab/tactileSR-iros2022 (Wu, Liu, Zhang, IROS
2022), as its utility/RegTactileData.py reads them: [positions along x, along y, frames of a press, 48],
16 taxels of 4 x 4, row by row from the top, with x, y and z each; z is along the normal. Between two
positions the robot moved by the taxels' spacing over the number of positions.
"""

import argparse
import pathlib
from typing import Any

import numpy
from numpy.typing import NDArray

import palpate

from .program import main

SIDE = 4  # taxels
#: Frames of a press that count: those whose mean normal reading is at least this share of the largest.
HELD = 0.95


def recording_of(
    readings: NDArray[Any], pitch_mm: float, *, reverse: bool = False, object: str = ""
) -> palpate.Recording:
    """The touches of one array of readings, a touch for each position, with raw normal readings.

    readings [nx, ny, frames, 48]; pitch_mm: from taxel to taxel. A touch is the mean of the frames in
    which the press was held. The robot frame, which is the object's, has its origin in the middle of
    the positions, x to the right and y up. reverse: the positions run against x and y, as in the files
    whose names begin with "2_".
    """
    shape = readings.shape
    if len(shape) != 4 or 0 in shape or shape[3] != 3 * SIDE**2 or readings.dtype.kind not in "fiu":
        raise ValueError(
            f"shape {shape} of {readings.dtype}; give numbers [nx, ny, frames, {3 * SIDE**2}]"
        )
    normal = readings.astype(float).reshape(*shape[:3], SIDE**2, 3)[..., 2]
    force = normal.mean(axis=-1)
    held = force >= HELD * numpy.maximum(force.max(axis=-1, keepdims=True), 0.0)
    frames = numpy.maximum(held.sum(axis=-1), 1)  # where nothing pressed, the readings stay 0
    pressure = (normal * held[..., None]).sum(axis=2) / frames[..., None]

    columns, rows = numpy.meshgrid(*map(numpy.arange, shape[:2]), indexing="ij")
    towards = -1.0 if reverse else 1.0
    poses = numpy.zeros((*shape[:2], 3))
    poses[..., 0] = towards * (columns - (shape[0] - 1) / 2) * pitch_mm / shape[0]
    poses[..., 1] = -towards * (rows - (shape[1] - 1) / 2) * pitch_mm / shape[1]
    elements = palpate.grid_array(SIDE, SIDE, pitch_mm).reshape(SIDE, SIDE, 2)[::-1]
    return palpate.Recording(
        pressure.reshape(-1, SIDE**2),
        poses.reshape(-1, 3),
        elements.reshape(-1, 2),
        object=object,
        pressure_unit="raw",
    )


def run() -> None:
    flags = argparse.ArgumentParser("python -m bench.xela", description=__doc__)
    flags.add_argument("readings", metavar="FILE.npy", type=pathlib.Path)
    flags.add_argument("--pitch-mm", type=float, required=True,
                       help="from taxel to taxel, by the sensor's data sheet, mm")  # fmt: skip
    flags.add_argument("--object", default="", help="what was touched")
    flags.add_argument("--reverse", action="store_true",
                       help="the positions run against x and y, as where the file's name begins with 2_")  # fmt: skip
    flags.add_argument("-o", "--output", required=True, help="recording to write (HDF5)")
    options = flags.parse_args()
    try:
        readings = numpy.load(options.readings)
        recording = recording_of(
            readings, options.pitch_mm, reverse=options.reverse, object=options.object
        )
    except (OSError, ValueError) as error:
        raise palpate.Error(f"{options.readings}: {error}") from error
    recording.save(options.output)
    print(f"{options.output}: {recording}")


if __name__ == "__main__":
    main(run)
