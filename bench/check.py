"""How well `check` finds what is wrong with a set-up, and that it finds nothing where it is sound."""

import math
import pathlib
import tempfile
from typing import Any

import numpy
from numpy.typing import NDArray

import palpate
from palpate._palpate import Random, Stream
from palpate._tables import Column, Table, column, number, plain

from .program import Json, begin, main, parser, write

SEED = 400_000_000
TOUCHES = 60
OBJECTS = 3  # in a set
LETTERS = ("A", "E", "U", "I", "O", "B", "K", "4", "7", "S", "ring", "bar")
#: Shapes of one's own, mm.
POLYGONS = {
    "bracket": "-12 -12\n12 -12\n12 -5\n-5 -5\n-5 12\n-12 12\n",
    "wedge": "-13 -8\n13 -8\n13 -3\n-13 9\n",
    "cross": "-4 -12\n4 -12\n4 -2\n11 -2\n11 5\n4 5\n4 12\n-4 12\n-4 5\n-9 5\n-9 -2\n-4 -2\n",
}
ARRAYS = {36: palpate.digitacts_array(), 64: palpate.grid_array(8, 8, 1.9)}
#: How the readings of a grid [row, column] come, by the first_element and order that put them right.
ORDERS = {
    (f"{row}-{side}", order): (row == "top", side == "right", order == "columns")
    for row in ("bottom", "top")
    for side in ("left", "right")
    for order in ("rows", "columns")
}
OFFSET_MM, OFFSET_RAD = 3.0, 0.09
NEAR_MM, NEAR_RAD = 0.2, 0.02
FAR_MM = 60.0
FAR_NEAR_MM, FAR_NEAR_RAD = 0.3, math.radians(1)
LATE = 2  # presses
GAIN = 10.0

COLUMNS: list[Column] = [
    ("elements", "elements", plain),
    ("sets", "sets", plain),
    ("sound, without a finding", "sound", plain),
    ("orders right", "order", plain),
    ("least nats of an order", "least_order_nats", number(".0f")),
    ("offsets within 0.2 mm, 0.02 rad", "offset", plain),
    ("offsets: median error, mm", "median_mm", number(".3f")),
    ("rad", "median_rad", number(".4f")),
    ("90 % within, mm", "most_mm", number(".3f")),
    ("rad", "most_rad", number(".4f")),
    ("at one angle, said", "one_angle", plain),
    ("mounts to 60 mm within 0.3 mm, 1 degree", "mount", plain),
    ("faults beyond", "beyond", plain),
    ("of these named precisely", "precise", plain),
]

Floats = NDArray[numpy.float64]
Touches = list[palpate.Recording]


def misread(pressure: Floats, options: tuple[str, str]) -> Floats:
    """Readings in the order in which an array gives them that the options' import puts right."""
    top, right, columns = ORDERS[options]
    side = math.isqrt(pressure.shape[1])
    grid: Floats = pressure.reshape(-1, side, side)
    grid = grid[:, ::-1] if top else grid
    grid = grid[:, :, ::-1] if right else grid
    return (grid.transpose(0, 2, 1) if columns else grid).reshape(pressure.shape)


class Set:
    """Touches of three objects, and what is done to them."""

    def __init__(self, shapes: list[str], elements_mm: Floats, seed: int) -> None:
        self.random = Random(seed, Stream.touch_order)
        left, self.seed, self.elements_mm = list(shapes), seed, elements_mm
        self.shapes = [left.pop(int(u * len(left))) for u in self.random.uniforms(OBJECTS)]
        self.touches = self.at([palpate.random_poses(TOUCHES, seed + k) for k in range(OBJECTS)])
        self.pressures = [one.pressure for one in self.touches]
        self.poses = [one.T_robot_sensor for one in self.touches]

    def at(self, poses: list[Floats]) -> Touches:
        return [
            palpate.simulate(shape, pose, elements_mm=self.elements_mm, seed=self.seed + k)
            for k, (shape, pose) in enumerate(zip(self.shapes, poses, strict=True))
        ]

    def changed(self, pressures: list[Floats], poses: list[Floats]) -> Touches:
        """The touches with other readings, or at other poses."""
        changes = zip(self.touches, pressures, poses, strict=True)
        return [palpate.Recording(p, pose, one.elements_mm, object=one.object) for one, p, pose in changes]

    def misread(self) -> tuple[tuple[str, str], Touches]:
        """Touches whose elements are read in another order, and the options that say so."""
        options = list(ORDERS)[1 + int(self.random.uniforms(1)[0] * (len(ORDERS) - 1))]
        return options, self.changed([misread(pressure, options) for pressure in self.pressures], self.poses)

    def misplaced(self) -> tuple[Floats, Touches]:
        """Touches whose array sits elsewhere in the tool than their poses say, and where."""
        return self.mounted((2 * self.random.uniforms(3) - 1) * (OFFSET_MM, OFFSET_MM, OFFSET_RAD))

    def far_off(self) -> tuple[Floats, Touches]:
        """The same anywhere within 60 mm and at any angle."""
        part, way, turn = self.random.uniforms(3)
        far, way = FAR_MM * math.sqrt(part), 2 * math.pi * way
        return self.mounted(numpy.array([far * math.cos(way), far * math.sin(way), math.pi * (2 * turn - 1)]))

    def mounted(self, offset: Floats) -> tuple[Floats, Touches]:
        back = palpate.inverse(offset)
        poses = [numpy.array([palpate.compose(pose, back) for pose in of]) for of in self.poses]
        return offset, self.changed(self.pressures, poses)

    def beyond(self) -> dict[str, Touches]:
        """Touches with faults that no set-up which is tried explains."""
        half, pressures, poses = TOUCHES // 2, self.pressures, self.poses
        shuffled = [pose[numpy.argsort(self.random.uniforms(TOUCHES))] for pose in poses]
        gains = numpy.where(numpy.arange(len(self.elements_mm)) < len(self.elements_mm) // 2, GAIN, 1.0)
        mixed = [
            [numpy.concatenate([a[:half], b[half:]]) for a, b in zip(of, of[1:] + of[:1], strict=True)]
            for of in (pressures, poses)
        ]
        return {
            "late": self.changed(pressures, [numpy.roll(pose, LATE, axis=0) for pose in poses]),
            "shuffled": self.changed(pressures, shuffled),
            "mirrored": self.changed(pressures, [pose * (-1, 1, 1) for pose in poses]),
            "two objects": self.changed(*mixed),
            "gain": self.changed([pressure * gains for pressure in pressures], poses),
        }

    def at_one_angle(self) -> Touches:
        angle = 2 * math.pi * self.random.uniforms(1)[0]
        return self.at([pose * (1, 1, 0) + (0, 0, angle) for pose in self.poses])


def checked(device: palpate.Device, one: Set) -> Json:
    """What is found in a set as it is, misread, misplaced near and far, beyond any set-up, and touched
    at one angle."""

    def found(touches: Touches) -> tuple[Any, list[str]]:
        """The findings, and their words."""
        findings = palpate.check_setup(touches, device=device).findings
        return findings, [finding.words for finding in findings]

    record: Json = {"objects": [pathlib.Path(shape).stem for shape in one.shapes]}
    record["sound"] = found(one.touches)[1]
    (first_element, order), touches = one.misread()
    findings, words = found(touches)
    record["order"] = {
        "right": len(words) == 1 and f"first_element='{first_element}' and order='{order}'" in words[0],
        "option": f"{first_element} --order {order}",
        "nats": findings[0].nats if findings else 0.0,
        "words": words,
    }
    for name, (offset, touches), near_mm, near_rad in (
        ("offset", one.misplaced(), NEAR_MM, NEAR_RAD),
        ("mount", one.far_off(), FAR_NEAR_MM, FAR_NEAR_RAD),
    ):
        findings, words = found(touches)
        pose = getattr(findings[0], "array_offset", None) if len(findings) == 1 else None
        off = offset if pose is None else palpate.compose(palpate.inverse(offset), pose)
        mm, rad = math.hypot(off[0], off[1]), abs(math.remainder(off[2], 2 * math.pi))
        record[name] = {"true": offset.tolist(), "words": words, "error_mm": mm, "error_rad": rad}
        record[name]["right"] = pose is not None and mm <= near_mm and rad <= near_rad
    record["beyond"] = {
        name: [finding.words for finding in found(touches)[0] if finding.what != "unexplained"]
        for name, touches in one.beyond().items()
    }
    at_one = palpate.check_setup(one.at_one_angle(), device=device)
    said = [remark for remark in at_one.remarks if "at nearly one angle" in remark]
    record["one_angle"] = bool(said) and not at_one.findings
    return record


def summary(elements: int, records: list[Json]) -> Json:
    mm, rad = (column(records, f"offset/error_{of}") for of in ("mm", "rad"))
    return {
        "elements": elements,
        "sets": len(records),
        "sound": sum(not record["sound"] for record in records),
        **{name: sum(record[name]["right"] for record in records) for name in ("order", "offset", "mount")},
        "least_order_nats": min(record["order"]["nats"] for record in records),
        "median_mm": float(numpy.median(mm)),
        "median_rad": float(numpy.median(rad)),
        "most_mm": float(numpy.quantile(mm, 0.9)),
        "most_rad": float(numpy.quantile(rad, 0.9)),
        "one_angle": sum(record["one_angle"] for record in records),
        "beyond": sum(len(record["beyond"]) for record in records),
        "precise": sum(bool(words) for record in records for words in record["beyond"].values()),
    }


def program() -> None:
    """Both arrays, set by set."""
    flags = parser(
        "check",
        "Checks set-ups by sixty touches of each of three objects, in an hour and a half on a CPU core: "
        "sound ones, with the elements in another order, with the array elsewhere in the tool, near or "
        "far, with faults that no set-up explains, and touched at one angle; with arrays of 36 and 64 "
        "elements, or of 36 with --quick.",
        trials="sets [100, or 2 with --quick]",
    )
    options = flags.parse_args()
    sets = options.trials or (2 if options.quick else 100)
    device, facts = begin(options)
    all_of: Json = {}
    with tempfile.TemporaryDirectory() as folder:
        shapes = list(LETTERS)
        for name, text in POLYGONS.items():
            shapes.append(f"{folder}/{name}.txt")
            pathlib.Path(shapes[-1]).write_text(text)
        table = Table(COLUMNS)
        for elements, elements_mm in list(ARRAYS.items())[: 1 if options.quick else None]:
            records = [checked(device, Set(shapes, elements_mm, SEED + 1000 * k)) for k in range(sets)]
            all_of[str(elements)] = records
            table.append(summary(elements, records))
    write(options.json, facts | {"check": table, "sets": all_of})


if __name__ == "__main__":
    main(program)
