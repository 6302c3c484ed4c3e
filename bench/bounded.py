"""The posterior by bounds: its certificates against all bins, everyday objects, and its picture.

Times are measured in C++, by `palpate-bench bounded`.
"""

import json
import math
import pathlib
from collections.abc import Sequence
from statistics import median_low
from typing import Any

import numpy
from matplotlib.artist import Artist
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

import palpate
from palpate import _charts as charts
from palpate._tables import Column, Table, column, count_text, number, plain, seconds_text

from .certificates import check_certificate, dense_posterior
from .measures import share_record, with_interval
from .program import Json, begin, main, parser, write
from .sweep_runs import asked_after
from .trials import TABLE_1, VOWELS, Bins, Floats, lattice_of, letter_maps, make_trials

SEED = 1_404_000_000
_MASS, _PERCENT = number(".1e"), with_interval(".1f", 100.0)
ACCURACY: list[Column] = [
    ("bins per object", "bins", plain),
    ("touches", "touches", plain),
    ("posteriors", "posteriors", plain),
    ("certificates broken", "broken", plain),
    ("largest certificate", "largest_promised", _MASS),
    ("mass not counted", "largest_mass_outside", _MASS),
    ("total variation of marginals", "largest_total_variation", _MASS),
    ("identity error", "largest_identity_error", _MASS),
    ("the dense posterior's mode", "same_modes", plain),
]
PRESSES: list[Column] = [
    ("frames", "frames", plain),
    ("objects", "objects", plain),
    ("bins in all", "bins_in_all", count_text),
    ("a frame, median", "median_s", seconds_text),
    ("least", "least_s", seconds_text),
    ("most", "most_s", seconds_text),
    ("bins evaluated, median", "median_bins", count_text),
    ("largest certificate", "largest_dropped", _MASS),
    ("mode certain, %", "mode_certain", _PERCENT),
    ("dense engine, array at rest, median", "dense_s", seconds_text),
    ("its best label, %", "same_best", _PERCENT),
    ("label right, %", "right", _PERCENT),
]
#: How large blocks, smaller ones that a search goes into, and evaluated bins are drawn: the colour, and
#: its opacity at the fewest and at all thetas.
LEVELS = (("#a8ccf0", 0.05, 0.26), ("#1a66b8", 0.05, 0.26), ("#e65c0d", 0.4, 0.95))


def measure_accuracy(device: palpate.Device, maps: list[palpate.OccupancyGrid], quick: bool) -> list[Json]:
    """Certificates beside the distances from the posterior over all bins, after 3 and 9 touches."""
    sizes: list[Bins] = [*TABLE_1[:2]] if quick else [*TABLE_1, (44, 44, 52), (100, 100, 100)]
    trials = make_trials(VOWELS, 1 if quick else 10, 9, SEED)
    records = Table(ACCURACY)
    for bins in sizes:
        bounded = palpate.BoundedPosterior(device, maps, lattice_of(bins))
        histogram = palpate.PoseHistogram(device, maps, lattice_of(bins))
        checks: dict[int, list[Json]] = {3: [], 9: []}
        for trial in trials:
            bounded.reset()
            histogram.reset()
            done = 0
            for until, of_touch in checks.items():
                for belief in (bounded, histogram):
                    belief.update(trial[done:until])
                done = until
                dense = dense_posterior(histogram, maps, trial[:until])
                of_touch.append(check_certificate(bounded, dense))
        for after, of_touch in checks.items():
            record: Json = {"bins": plain(bins), "touches": after, "posteriors": len(of_touch)}
            record |= {name: [check[name] for check in of_touch] for name in of_touch[0]}
            record |= {
                f"largest_{name}": max(record[name])
                for name in ("promised", "mass_outside", "total_variation", "identity_error")
            }
            record["broken"] = record["holds"].count(False)
            record["same_modes"] = record["same_mode"].count(True)
            records.append(record)
    return records


# Everyday objects: raw pressure, and a map from one press.
CLASSIFIER = palpate.ContactClassifier(threshold=15.0, ratio=0.15)
CONTACT = palpate.ContactModel(CLASSIFIER, gamma=0.2, prior=0.1)
DENSE_FRAMES = (1, 13)  # of every object that the dense engine answers, too, besides the map's


def read_presses(folder: str) -> list[palpate.Recording]:
    """All recordings of a folder, which are of one array."""
    paths = sorted(pathlib.Path(folder).glob("*.h5"))
    if not paths:
        raise palpate.Error(f"--presses {folder}: holds no recording; give a folder of them (*.h5)")
    recordings = [palpate.read_recording(path) for path in paths]
    for recording in recordings:
        if not numpy.array_equal(recording.elements_mm, recordings[0].elements_mm):
            raise palpate.Error(
                f"{recording.path}: elements: not the array of {recordings[0].path}; give a folder "
                "of recordings by one array"
            )
    return recordings


def pitch_of(elements_mm: Floats) -> float:
    """Distance in mm from the first element [e, 2] to its nearest neighbour."""
    return float(numpy.hypot(*(elements_mm[1:] - elements_mm[0]).T).min())


def measure_presses(device: palpate.Device, folder: str, quick: bool) -> Json:
    """Everyday objects from one press each, in a folder of recordings."""
    recordings = read_presses(folder)
    elements_mm = recordings[0].elements_mm
    pitch_mm = pitch_of(elements_mm)
    builder = palpate.MapBuilder(
        device,
        cell_mm=0.5 * pitch_mm,
        sensor=palpate.InverseSensorModel(spread_mm=0.6 * pitch_mm, prior=0.1),
        classifier=CLASSIFIER,
    )
    maps = []
    for recording in recordings:
        builder.clear()
        builder.add(recording[:1])
        maps.append(builder.build(recording.object))
    # Steps of half a pitch and 2.5 degrees.
    step_mm = pitch_mm / 2.0 * (10.0 if quick else 1.0)
    x, y = (
        palpate.Axis(-extent, extent, math.floor(2.0 * extent / step_mm + 0.5)) for extent in (50.0, 31.0)
    )
    lattice = palpate.PoseLattice(x, y, (0.0, 2.0 * math.pi, 4 if quick else 144))
    bounded = palpate.BoundedPosterior(device, maps, lattice, contact=CONTACT)
    histogram = palpate.PoseHistogram(device, maps, lattice, contact=CONTACT)
    answers: list[Json] = []
    dense: list[Json] = []
    for i, recording in enumerate(recordings):
        for frame in range(1, min(len(recording), 2) if quick else len(recording)):
            answers.append(_answer(bounded, recording[frame : frame + 1]) | {"label": i})
            if frame in DENSE_FRAMES:
                dense.append(_answer(histogram, recording[frame : frame + 1]))
                dense[-1]["same"] = dense[-1]["best"] == answers[-1]["best"]
    seconds, evaluated = (column(answers, of) for of in ("seconds", "bins_evaluated"))

    def share_of(those: Sequence[bool]) -> Json:
        return share_record(sum(those), len(those))

    record: Json = {
        "bins_in_all": lattice.bins * len(maps),
        "objects": len(maps),
        "frames": len(answers),
        "median_s": median_low(seconds),
        "least_s": min(seconds),
        "most_s": max(seconds),
        "median_bins": median_low(evaluated),
        "largest_dropped": max(column(answers, "dropped_mass")),
        "mode_certain": share_of([of["mode_certain"] for of in answers]),
        "dense_s": median_low(column(dense, "seconds")),
        "same_best": share_of([of["same"] for of in dense]),
        "right": share_of([of["best"] == of["label"] for of in answers]),
    }
    Table(PRESSES, [record])
    return record | {"answers": answers, "dense": dense}


def _answer(belief: Any, touches: palpate.Recording) -> Json:
    """The belief in one unknown: its best object, what a certificate says, and the seconds."""
    belief.reset()
    seconds, estimate = asked_after(belief, touches)
    answer: Json = {"seconds": seconds, "best": int(numpy.argmax(estimate.identity))}
    if certificate := estimate.certificate:
        names = ("bins_evaluated", "dropped_mass", "mode_certain")
        answer |= {name: getattr(certificate, name) for name in names}
    return answer


def draw_search(search: Json, grid: palpate.OccupancyGrid) -> Figure:
    """The blocks of poses that a search goes into, after some touches each, over the object's map.

    By what `palpate-bench bounded` measured in its part "search". A block is drawn where the search
    went into it at any theta, in the colour of its level, and the fuller the more thetas.
    """
    (nx, ny, thetas), extent_mm, stages = search["bins"], search["extent_mm"], search["stages"]
    step_mm = 2.0 * extent_mm / numpy.array([nx, ny])
    left, bottom = grid.origin_mm - grid.cell_mm / 2.0
    cells = (left, left + grid.nx * grid.cell_mm, bottom, bottom + grid.ny * grid.cell_mm)
    last = max(block[0] for stage in stages for block in stage["blocks"])
    figure = Figure(figsize=(17.9, 7.5))
    for axes, stage in zip(figure.subplots(1, len(stages)), stages, strict=True):
        occupied = 1.0 / (1.0 + numpy.exp(-grid.log_odds))
        axes.imshow(occupied, extent=cells, origin="lower", cmap="Greys", vmin=0.0, vmax=3.0)
        for level in range(last + 1):
            blocks = numpy.array([block for block in stage["blocks"] if block[0] == level])
            colour, least, most = LEVELS[-1 if level == last else min(level, 1)]
            boxes = [
                Rectangle(step_mm * (x, y) - extent_mm, *step_mm * (width, height))
                for _, x, width, y, height, _ in blocks
            ]
            # Few thetas of hundreds are to be seen, too.
            full = (blocks[:, 5] / thetas) ** 0.25 if boxes else numpy.zeros(0)
            faces = [(colour, alpha) for alpha in least + (most - least) * full]
            edges = "none" if level == last else colour
            axes.add_collection(PatchCollection(boxes, facecolors=faces, edgecolors=edges))
        axes.plot(*search["place_mm"], "P", linestyle="", color="black", markersize=12)
        touches, count, in_all = stage["touches"], stage["bins_evaluated"], search["bins_in_all"]
        share = f"{count_text(count)} of {count_text(in_all)} bins: {100.0 * count / in_all:.2g} %"
        axes.set_title(f"After {touches} touch{'es' if touches > 1 else ''}\n{share}", fontsize=14)
        axes.set(xlim=(-extent_mm, extent_mm), ylim=(-extent_mm, extent_mm))
        axes.set(xlabel="x on the letter, mm", ylabel="y, mm")
        axes.grid(visible=False)
    names = ("large block, looked into", "smaller block, looked into", "bins evaluated")
    marks: list[Artist] = [
        Patch(facecolor=(colour, most), edgecolor=colour, label=name)
        for (colour, _, most), name in zip(LEVELS, names, strict=True)
    ]
    marks += axes.plot([], [], "P", linestyle="", color="black", label="where the first touch truly was")
    figure.legend(handles=marks, loc="outside lower left", ncols=4)
    return figure


def read_times(path: str) -> Json:
    """What `palpate-bench bounded` measured. Raises palpate.Error where the picture's part is missing."""
    try:
        times: Json = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise palpate.Error(f"--times {path}: {error}") from error
    if "search" not in times:
        raise palpate.Error(f"--times {path}: holds no search; measure without --part")
    return times


def program() -> None:
    """Measures the parts, and draws the search where times are given."""
    flags = parser(
        "bounded",
        "Holds the certificates of the posterior by bounds against all bins in float64, in some "
        "minutes on two CPU cores, and recognises everyday objects from one press each. Times are "
        "measured by build/palpate-bench bounded.",
        plots="draw the search of --times in this folder",
    )
    flags.add_argument("--part", choices=("accuracy", "presses"), help="measure only this part")
    flags.add_argument("--presses", metavar="FOLDER", help="recordings of everyday objects")
    flags.add_argument("--times", metavar="FILE", help="results of build/palpate-bench bounded --json FILE")
    options = flags.parse_args()
    if options.part == "presses" and not options.presses:
        flags.error("--part presses: give the folder of recordings by --presses FOLDER")
    if bool(options.plots) != bool(options.times):
        flags.error("--plots and --times: give both, or neither")
    times = read_times(options.times) if options.times else None
    device, document = begin(options)
    accuracy = options.part in (None, "accuracy")
    maps = letter_maps(device) if accuracy or times else []
    if accuracy:
        document["accuracy"] = measure_accuracy(device, maps, options.quick)
    if options.presses:
        document["presses"] = measure_presses(device, options.presses, options.quick)
    write(options.json, document)
    if times:
        picture = draw_search(times["search"], maps[0])
        path = pathlib.Path(options.plots, "bounded_search.png")
        write(path, charts.image(picture, "png", dpi=100))


if __name__ == "__main__":
    main(program)
