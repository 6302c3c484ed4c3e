"""Streams of frames, and what other programs may make of them."""

import csv
import dataclasses
import json

from command import CommandTest, Ended

#: At full speed, so that a test of seconds of touching takes none; of one press, 261 frames.
ONE_TOUCH = "simulate:A,touches=1,speed=max"


def numbers(text: str) -> list[list[float]]:
    """The rows of a table below its heading."""
    return [[float(cell or "nan") for cell in row] for row in [*csv.reader(text.splitlines())][1:]]


@dataclasses.dataclass
class Frames:
    time: list[float]
    lost: list[float]  #: before each
    pressure: list[list[float]]
    pose: list[list[float]]
    array: list[list[float]]  #: x, y and, where it is known, baseline of each element

    def lines(self) -> str:
        """As a program writes them for --sensor -, a line of JSON each."""
        return "".join(
            json.dumps({"time": time, "pressure": pressure, **posed(pose)}) + "\n"
            for time, pressure, pose in zip(self.time, self.pressure, self.pose, strict=True)
        )


def posed(pose: list[float]) -> dict[str, float]:
    return dict(zip(("x_mm", "y_mm", "theta_rad"), pose, strict=True))


class StreamTest(CommandTest):
    def recorded(self, file: str, sensor: str = ONE_TOUCH, *flags: str) -> Frames:
        """The frames that `record` writes, by `export`, which also writes array.csv."""
        self.assertIn(f"{file}: ", self.palpate("record", "--sensor", sensor, "-o", file, *flags).stdout)
        return self.frames_of(file)

    def frames_of(self, file: str) -> Frames:
        self.back = self.palpate("export", file, "-o", ".").stdout
        tables = [self.folder / f"{table}.csv" for table in ("pressures", "poses", "array")]
        pressures, poses, array = (numbers(table.read_text()) for table in tables)
        time, lost, *columns = zip(*pressures, strict=True)
        return Frames([*time], [*lost], [[*row] for row in zip(*columns, strict=True)], poses, array)

    def forget_baseline(self) -> None:
        """Of array.csv."""
        lines = (self.folder / "array.csv").read_text().splitlines()
        rows = [",".join(line.split(",")[:2]) for line in lines]
        (self.folder / "array.csv").write_text("\n".join(rows) + "\n")

    def record_lines(self, file: str, frames: Frames, *flags: str, status: int = 0) -> Ended:
        """What `record` makes of the frames that another program writes for array.csv."""
        arguments = ("record", "--sensor", "-", "--array", "array.csv", "-o", file, *flags)
        return self.palpate(*arguments, status=status, input=frames.lines())
