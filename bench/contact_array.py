"""A real array and the contact under it, measured by light: its presses, maps, windows and registration.

The sheet's frame is that of the array: x along its rows, y along its columns, mm. An object is the
contact area of one press; its frame lies along the sheet's axes with its origin in the area's centroid.
A touch is a window of the array.
"""

import pathlib
import zipfile
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

import numpy
from numpy.typing import NDArray

import palpate

from .trials import Floats

ROWS, COLUMNS = 41, 72
PIXELS = 8  #: of the mask, along an element
PIXEL_MM = 345.0 / (COLUMNS * PIXELS)
PITCH_MM = PIXELS * PIXEL_MM
WINDOW = 9  #: elements along a side of a window
ELEMENTS_MM = palpate.grid_array(WINDOW, WINDOW, PITCH_MM)
#: A random point of the contact lies this many elements from a window's middle at most, along each axis.
OFF_MIDDLE = 2

# Eq. 7's: from 300 counts on an element's middle lies over the contact about as often as beside it.
THRESHOLD, RATIO = 300.0, 0.1
FELT = 50.0  #: counts, ten standard deviations of an element that nothing is near

#: Probability that a place beyond the map is touched: the contacts' share of what windows cover, about.
PRIOR = 0.02
#: Of maps: contact that is blurred by half a pitch has log odds that say how far an outline is within
#: 5 mm, as far as elements feel a finger, up to the 7.8 nats that a sensor model tells apart.
SPREAD_MM, PEAK = PITCH_MM / 4.0, 0.9996

Ints = NDArray[numpy.int64]


class Press(NamedTuple):
    """One moment of several fingers on the sheet."""

    readings: Floats  #: [41, 72] raw counts
    contact: NDArray[numpy.bool_]  #: [328, 576] pixels
    person: int

    @property
    def centroid_mm(self) -> Floats:
        """The middle of the contact area, in the sheet."""
        y, x = numpy.nonzero(self.contact)
        return PIXEL_MM * numpy.array([x.mean(), y.mean()])

    def grid(self, label: str, spread_mm: float = SPREAD_MM) -> palpate.OccupancyGrid:
        """The map of the contact area: cells of half a pitch, outlines as soft as spread_mm says."""
        return palpate.OccupancyGrid.from_mask(
            label,
            self.contact,
            pixel_mm=PIXEL_MM,
            origin_mm=-self.centroid_mm,
            cell_mm=PITCH_MM / 2.0,
            spread_mm=spread_mm,
            peak=PEAK,
            prior=PRIOR,
            felt_share=0.5,
            reach_mm=float(numpy.hypot(*ELEMENTS_MM.T).max()),
        )

    def windows(self, random: numpy.random.Generator, count: int) -> Ints:
        """The first elements (row, column) [count, 2] of windows over the contact, in the sheet."""
        points = numpy.argwhere(self.contact)
        middles = points // PIXELS - WINDOW // 2
        fits = (middles >= -OFF_MIDDLE) & (middles <= numpy.array([ROWS, COLUMNS]) - WINDOW + OFF_MIDDLE)
        points = points[fits.all(axis=1)]
        if not len(points):
            raise palpate.Error("a press: no window fits over its contact; leave it out")
        drawn: list[Ints] = []
        while len(drawn) < count:
            element = random.choice(points) // PIXELS
            first = element - WINDOW // 2 + random.integers(-OFF_MIDDLE, OFF_MIDDLE + 1, 2)
            if (first >= 0).all() and (first <= (ROWS - WINDOW, COLUMNS - WINDOW)).all():
                drawn.append(first)
        return numpy.array(drawn)

    def tiles(self) -> Ints:
        """Windows side by side over the sheet, as `windows`: those that feel a finger."""
        rows = range((ROWS % WINDOW) // 2, ROWS - WINDOW + 1, WINDOW)
        tiles = numpy.array([(j, i) for j in rows for i in range(0, COLUMNS - WINDOW + 1, WINDOW)])
        felt = [self.readings[j : j + WINDOW, i : i + WINDOW].max() > FELT for j, i in tiles]
        return tiles[felt]

    def seen(self, windows: Ints) -> float:
        """The share of the contact that lies under the windows."""
        under = numpy.zeros_like(self.contact)
        for j, i in PIXELS * windows:
            under[j : j + PIXELS * WINDOW, i : i + PIXELS * WINDOW] = True
        return float((self.contact & under).sum() / self.contact.sum())


def read_presses(path: pathlib.Path) -> list[Press]:
    """The presses of a file of numpy.savez: `capacitance`, `mask_bits` and `participant`."""
    shapes: dict[str, tuple[int, ...]] = {
        "capacitance": (ROWS, COLUMNS),
        "mask_bits": (ROWS * COLUMNS * PIXELS**2 // 8,),
        "participant": (),
    }
    try:
        with numpy.load(path) as file:
            arrays = {name: file[name] for name in shapes}
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise palpate.Error(
            f"{path}: {error}; give a folder with presses.npz, which holds {', '.join(shapes)}"
        ) from error
    for name, shape in shapes.items():
        if arrays[name].shape != (len(arrays["participant"]), *shape):
            raise palpate.Error(f"{path}: {name} has the shape {arrays[name].shape}; give {('n', *shape)}")
    contact = numpy.unpackbits(arrays["mask_bits"], axis=1).astype(bool)
    masks = contact.reshape(-1, ROWS * PIXELS, COLUMNS * PIXELS)
    return [
        Press(readings.astype(float), mask, int(person))
        for readings, mask, person in zip(arrays["capacitance"], masks, arrays["participant"], strict=True)
        if mask.any()
    ]


class Registration(NamedTuple):
    """Where elements truly lie in the sheet's picture: places, less a shift that is quadratic in x and y."""

    coefficients: Floats  #: [6, 2] of `terms`, mm

    @staticmethod
    def terms(places_mm: Floats) -> Floats:
        """1, x, y, x^2, x y and y^2, [n, 6], in tenths of a metre from the sheet's middle."""
        x, y = (places_mm - PITCH_MM * numpy.array([COLUMNS, ROWS]) / 2.0).T / 100.0
        return numpy.column_stack([numpy.ones_like(x), x, y, x * x, x * y, y * y])

    def shift_mm(self, places_mm: Floats) -> Floats:
        """By how much readings seem to lie beside the contact that they are of, [n, 2]."""
        return self.terms(places_mm) @ self.coefficients

    def poses(self, windows: Ints) -> Floats:
        """Poses of windows in the sheet [n, 3]: the middle's, turned as the shift turns about it."""
        middles = windows[:, ::-1] + (WINDOW - 1) / 2.0
        places_mm = numpy.asarray(PITCH_MM * middles + (PIXELS - 1) / 2.0 * PIXEL_MM, float)
        x, y = (
            self.shift_mm(numpy.add(places_mm, step)) - self.shift_mm(numpy.subtract(places_mm, step))
            for step in ((0.5, 0.0), (0.0, 0.5))
        )
        return numpy.column_stack([places_mm - self.shift_mm(places_mm), (y[:, 0] - x[:, 1]) / 2.0])


AS_BUILT = Registration(numpy.zeros((6, 2)))


def touched(
    press: Press,
    windows: Ints,
    registration: Registration,
    T_robot_object: Sequence[float] = (0.0, 0.0, 0.0),
    label: str = "",
) -> palpate.Recording:
    """Windows of a press as touches of an object at a pose, of which the recording carries the truth."""
    in_object = registration.poses(windows) - (*press.centroid_mm, 0.0)
    return palpate.Recording(
        [press.readings[j : j + WINDOW, i : i + WINDOW].ravel() for j, i in windows],
        numpy.array([palpate.compose(T_robot_object, pose) for pose in in_object]),
        ELEMENTS_MM,
        pressure_unit="raw",
        object=label,
        truth=palpate.Truth(label, palpate.inverse(T_robot_object)),
    )


def placed(
    device: palpate.Device,
    touches: palpate.Recording,
    grid: palpate.OccupancyGrid,
    sensor: pathlib.Path | None,
) -> palpate.Record:
    """Where touches of an object that is at the robot's origin are found, within 8 mm and 8 degrees."""
    model: Any = {"threshold": THRESHOLD, "ratio": RATIO} if sensor is None else {"sensor_model": sensor}
    (record,) = palpate.recognize(
        touches, grid, bins=(25, 25, 13), x_mm=(-8.0, 8.0), y_mm=(-8.0, 8.0), theta_deg=(-8.0, 8.0),
        none=0.0, device=device, **model,
    )  # fmt: skip
    return record


class Shifts(NamedTuple):
    """Where single windows of presses seem to lie beside where they are."""

    people: Ints  #: [n]
    places_mm: Floats  #: [n, 2] of the windows' middles in the sheet
    shifts_mm: Floats  #: [n, 2]

    def registration(self, without: Collection[int] = ()) -> Registration:
        """The least squares fit of all people but some, and twice more without what lies far off it."""
        terms = Registration.terms(self.places_mm)
        # All but the constant are held near 0, as four windows' places would: few windows tell no more.
        held = numpy.diag([0.0, 4.0, 4.0, 4.0, 4.0, 4.0])
        others = ~numpy.isin(self.people, list(without))
        kept = others
        for _ in range(3):
            coefficients = numpy.linalg.solve(
                terms[kept].T @ terms[kept] + held, terms[kept].T @ self.shifts_mm[kept]
            )
            off_mm = numpy.hypot(*(self.shifts_mm - terms @ coefficients).T)
            kept = others & (off_mm < 2.5 * numpy.median(off_mm[kept]))
        return Registration(coefficients)


def find_shifts(
    device: palpate.Device,
    presses: Sequence[Press],
    random: numpy.random.Generator,
    sensor: pathlib.Path | None,
    spread_mm: float = SPREAD_MM,
) -> Shifts:
    """Places six windows of every press on its map, each alone, by a sensor or by Eq. 7."""
    found = []
    for press in presses:
        grid = press.grid("press", spread_mm)
        for window in press.windows(random, 6):
            record = placed(device, touched(press, window[None], AS_BUILT), grid, sensor)
            for mode in record["modes"][:1]:
                place = AS_BUILT.poses(window[None])[0, :2]
                # The object is found where its readings are. Its angle is hardly known, and moves the
                # centroid of fingers that the window does not show, but not what it shows.
                middle = place - press.centroid_mm
                shift = palpate.transform(mode["T_robot_object"], middle[None])[0] - middle
                found.append((press.person, place, shift))
    return Shifts(*map(numpy.array, zip(*found, strict=True)))
