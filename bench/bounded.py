"""The posterior by bounds: its certificates against all bins, everyday objects, and its charts.

Times are measured in C++, by `palpate-bench bounded`.
"""

import argparse
import json
import math
import pathlib
import time
from statistics import median_low
from typing import Any

import numpy
from matplotlib.artist import Artist
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

import palpate
from palpate._sweep_runs import counts_of
from palpate._tables import count_text, seconds_text

from . import charts
from .certificates import CertificateCheck, check_certificate, dense_posterior
from .report import Json, Report, Run, main, parser, share_of, write, write_json
from .trials import VOWELS, lattice_of, letter_maps, make_trials, size_of

SEED = 1_404_000_000
TOLERANCE = 1e-6  # BoundedPosterior's
CHART, PICTURE = "bounded_growth", "bounded_search.png"
#: How large blocks, smaller ones that a search goes into, and evaluated bins are drawn: the colour, and
#: its opacity at the fewest and at all thetas.
LEVELS = (("#a8ccf0", 0.05, 0.26), ("#1a66b8", 0.05, 0.26), ("#e65c0d", 0.4, 0.95))


def measure_accuracy(run: Run, quick: bool, report: Report) -> list[Json]:
    """Certificates beside the distances from the posterior over all bins, after 3 and 9 touches."""
    sizes = [(5, 5, 4), (10, 10, 10)]
    if not quick:
        sizes += [(25, 25, 16), (44, 44, 52), (100, 100, 100)]
    maps = letter_maps(run.device)
    trials = make_trials(VOWELS, 1 if quick else 10, 9, SEED)
    records = []
    for lattice in (lattice_of(*size) for size in sizes):
        bounded = palpate.BoundedPosterior(run.device, maps, lattice)
        histogram = palpate.PoseHistogram(run.device, maps, lattice)
        checks: dict[int, list[CertificateCheck]] = {3: [], 9: []}
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
            add_checks(report, f"accuracy {size_of(lattice)}, touch {after}", of_touch)
            record: Json = {"bins": size_of(lattice), "touches": after}
            for name in ("promised", "mass_outside", "total_variation", "identity_error", "same_mode",
                         "holds"):  # fmt: skip
                record[name] = [getattr(check, name) for check in of_touch]
            records.append(record)
    return records


def add_checks(report: Report, name: str, checks: list[CertificateCheck]) -> None:
    """What certificates promised and what was measured, over posteriors."""
    broken = sum(not check.holds for check in checks)
    promised, outside, variation, identity = (
        max(getattr(check, field) for check in checks)
        for field in ("promised", "mass_outside", "total_variation", "identity_error")
    )
    same = sum(check.same_mode for check in checks)
    rows: list[tuple[Any, ...]] = [
        ("certificates broken", broken, "posteriors", 0.0),
        ("certificate, largest", promised, "mass", TOLERANCE),
        ("mass not counted, largest", outside, "mass"),
        ("total variation of marginals, largest", variation, "mass"),
        ("identity error, largest", identity, "probability", TOLERANCE),
        share_of("the dense posterior's mode", same, len(checks), at_least=100.0),
    ]
    report.add(name, {"posteriors": len(checks)}, rows)


# Everyday objects: raw pressure, and a map from one press.
CLASSIFIER = palpate.ContactClassifier(threshold=15.0, ratio=0.15)
CONTACT = palpate.ContactModel(CLASSIFIER, gamma=0.2, prior=0.1)
MOST_MS = 500.0
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


def measure_presses(run: Run, options: argparse.Namespace, report: Report) -> Json:
    """Everyday objects from one press each, in a folder of recordings."""
    recordings = read_presses(options.presses)
    elements_mm = recordings[0].elements_mm
    pitch_mm = float(numpy.hypot(*(elements_mm[1:] - elements_mm[0]).T).min())
    builder = palpate.MapBuilder(
        run.device,
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
    step_mm = pitch_mm / 2.0 * (10.0 if options.quick else 1.0)
    x, y = (
        palpate.Axis(-extent, extent, math.floor(2.0 * extent / step_mm + 0.5))
        for extent in (50.0, 31.0)
    )
    lattice = palpate.PoseLattice(x, y, (0.0, 2.0 * math.pi, 4 if options.quick else 144))
    bounded = palpate.BoundedPosterior(run.device, maps, lattice, contact=CONTACT)
    # All frames lie at one place: the dense engine evaluates what is in contact, and the rest once.
    histogram = palpate.PoseHistogram(run.device, maps, lattice, contact=CONTACT, still_array=True)
    answers: Json = {
        name: [] for name in ("best", "milliseconds", "bins_evaluated", "blocks_bounded",
                              "dropped_mass", "dense_ms")
    }  # fmt: skip
    right, certain, same = 0, 0, 0
    for i, recording in enumerate(recordings):
        for frame in range(1, min(len(recording), 2) if options.quick else len(recording)):
            estimate, ms = _answer(bounded, recording[frame : frame + 1])
            best = int(numpy.argmax(estimate.identity))
            right += best == i
            certificate = estimate.certificate
            certain += certificate.mode_certain
            answers["best"].append(maps[best].label)
            answers["milliseconds"].append(ms)
            for name in ("bins_evaluated", "blocks_bounded", "dropped_mass"):
                answers[name].append(getattr(certificate, name))
            if frame in DENSE_FRAMES:
                dense, ms = _answer(histogram, recording[frame : frame + 1])
                answers["dense_ms"].append(ms)
                same += int(numpy.argmax(dense.identity)) == best
    in_all = lattice.bins * len(maps)
    frames, all_ms = len(answers["best"]), answers["milliseconds"]
    evaluated, dense_ms = median_low(answers["bins_evaluated"]), answers["dense_ms"]
    facts = {"objects": len(maps), "elements": len(elements_mm), "bins in all": in_all}
    rows: list[tuple[Any, ...]] = [
        ("a frame, median", median_low(all_ms), "ms", MOST_MS),
        ("a frame, least", min(all_ms), "ms"),
        ("a frame, most", max(all_ms), "ms"),
        ("bins evaluated, median", evaluated, "bins"),
        ("of all bins", 100.0 * evaluated / in_all, "%"),
        ("certificate, largest", max(answers["dropped_mass"]), "mass"),
        share_of("mode certain", certain, frames),
        ("dense engine, array at rest, median", median_low(dense_ms), "ms"),
        share_of("the dense engine's best label", same, len(dense_ms), at_least=100.0),
        share_of("label right", right, frames),
    ]
    report.add(f"presses {size_of(lattice)}", facts | {"frames": frames}, rows)
    return {
        "bins": counts_of(lattice),
        "bins_in_all": in_all,
        "host_bytes": bounded.host_bytes,
    } | answers


def _answer(belief: Any, touches: palpate.Recording) -> tuple[Any, float]:
    """The belief in one unknown, and its milliseconds."""
    belief.reset()
    start = time.perf_counter()
    belief.update(touches)
    estimate = belief.estimate()
    return estimate, 1e3 * (time.perf_counter() - start)


def draw_growth(records: list[Json]) -> Figure:
    """Time against bins, by what `palpate-bench bounded` measured in its part "growth"."""
    figure, axes = charts.chart(
        "bins in all, five objects", "time of nine touches, to the posterior", log="xy"
    )
    for i, (name, label) in enumerate(
        (
            ("dense", "dense, every bin"),
            ("bounded", "by bounds, proven to 1e-6"),
            ("one_thread", "by bounds, on one thread"),
        )
    ):
        ends = (f"{name}/least", f"{name}/most")
        look = charts.like(i) | {"linestyle": "-"}
        charts.line(
            axes, records, "bins_in_all", f"{name}/median", interval=ends, label=label, **look
        )
    charts.log_ticks(axes, "x", count_text)
    charts.log_ticks(axes, "y", seconds_text)
    return charts.legend(figure)


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
        axes.plot(*search["place_mm"], "P", color="black", markersize=12, markeredgecolor="white")
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
    marks += axes.plot([], [], "P", color="black", label="where the first touch truly was")
    figure.legend(handles=marks, loc="outside lower left", ncols=4)
    return figure


def read_times(path: str) -> Json:
    """What `palpate-bench bounded` measured. Raises palpate.Error where the charts' parts are missing."""
    try:
        times: Json = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise palpate.Error(f"--times {path}: {error}") from error
    for part in ("growth", "search"):
        if part not in times:
            raise palpate.Error(f"--times {path}: holds no {part}; measure without --part")
    return times


def measure(run: Run, options: argparse.Namespace) -> None:
    """Measures the parts, and draws the charts of times where they are given."""
    times = read_times(options.times) if options.times else None
    report = Report(run.facts)
    records: Json = {}
    if options.part in (None, "accuracy"):
        records["accuracy"] = measure_accuracy(run, options.quick, report)
    if options.presses:
        records["presses"] = measure_presses(run, options, report)
    write_json(options.json, report.document() | records)
    if times:
        charts.save({CHART: draw_growth(times["growth"])}, options.plots)
        picture = draw_search(times["search"], letter_maps(run.device)[0])
        write(pathlib.Path(options.plots, PICTURE), charts.image(picture, "png", dpi=100))


def program() -> None:
    """Reads the flags and measures."""
    flags = parser(
        "bounded",
        "Holds the certificates of the posterior by bounds against all bins in float64, in some "
        "minutes on two CPU cores, and recognises everyday objects from one press each. Times are "
        "measured by build/palpate-bench bounded.",
        plots="draw the charts of --times in this folder",
    )
    flags.add_argument("--part", choices=("accuracy", "presses"), help="measure only this part")
    flags.add_argument("--presses", metavar="FOLDER", help="recordings of everyday objects")
    flags.add_argument(
        "--times", metavar="FILE", help="results of build/palpate-bench bounded --json FILE"
    )
    options = flags.parse_args()
    if options.part == "presses" and not options.presses:
        flags.error("--part presses: give the folder of recordings by --presses FOLDER")
    if bool(options.plots) != bool(options.times):
        flags.error("--plots and --times: give both, or neither")
    measure(Run(options, {"plots": [*charts.files([CHART]), PICTURE]}), options)


if __name__ == "__main__":
    main(program)
