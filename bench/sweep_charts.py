"""The sweep's charts."""

import numpy
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from palpate import _charts as charts
from palpate._tables import count_text, mean_text, seconds_text

from .program import Json
from .trials import Floats

EDGED: Json = {"markeredgecolor": "auto"}  # marks have their own colour around them


def front_of(costs: Floats, errors: Floats) -> NDArray[numpy.intp]:
    """Which are on the Pareto front of costs and errors, by rising cost; of equals the first."""
    rising = numpy.lexsort((errors, costs))
    least = numpy.minimum.accumulate(errors[rising])
    return numpy.compress(numpy.diff(least, prepend=numpy.inf) < 0.0, rising)


def pose_chart(document: Json) -> Axes:
    """The front is over runs that recognise and locate all trials, as errors over some would flatter."""
    x = f"time per unknown of {document['touches']} touches, an estimate after each"
    axes = charts.chart(x, "mean pose error (mm)", xscale="log", yscale="log")
    charts.ticks(axes.xaxis, seconds_text)
    fills: dict[float, Json] = {0.25: {"alpha": 0.4}, 0.5: {}, 1.0: charts.HOLLOW}
    best = []
    for colour, (kind, of, name, mark, counted) in zip(
        charts.COLOURS,
        (
            # The refined pose stands right below its mode, and particles by their like.
            ("histogram", "error_mm", "histogram, mode", "o", False),
            ("histogram", "refined_error_mm", "histogram, refined", "s", True),
            ("particles", "error_mm", "particles", "^", True),
            ("augmented", "error_mm", "Augmented MCL", "D", False),
            ("systematic", "error_mm", "systematic resampling", "^", False),
        ),
        strict=False,
    ):
        for cell_mm, fill in fills.items():
            points = [
                point | {"seconds": point["seconds_per_unknown"] + refine_s}
                for point in document["points"]
                if (point["filter"], point["cell_mm"]) == (kind, cell_mm) and point[of]
                for refine_s in [point["seconds_refine"] if of == "refined_error_mm" else 0.0]
            ]
            look: Json = {"linestyle": "", "marker": mark, "color": colour} | EDGED | fill
            if points:
                label = name if cell_mm == 0.5 else ""
                charts.series(axes, points, "seconds", f"{of}/mean", label, **look)
            for point in points:
                place = point["seconds"], point[of]["mean"]
                if counted and cell_mm == 0.5:
                    text: Json = {"textcoords": "offset points", "fontsize": 8, "color": colour}
                    axes.annotate(count_text(point["count"]), place, (6, 3), **text)
                if point["accuracy"] == 1.0 and point[of]["trials"] == document["trials"]:
                    best.append(place)
    if best:
        costs, errors = numpy.transpose(best)
        front = front_of(costs, errors)
        look = {"color": charts.GREY, "linestyle": "-", "marker": "", "zorder": 1}
        axes.plot(costs[front], errors[front], label="Pareto front", **look)
    return axes


def knee_chart(document: Json) -> Axes:
    """Errors over balanced bins, by colours for map cells."""
    axes = charts.chart("bins per object", "mean pose error (mm)", xscale="log", yscale="log")
    charts.ticks(axes.xaxis, count_text)
    balanced = [point for point in document["points"] if point["balanced"]]
    finest = max(point["count"] for point in balanced)
    for colour, knee in zip(charts.COLOURS, document["knees"], strict=False):
        cell_mm = knee["cell_mm"]
        own = [point for point in balanced if point["cell_mm"] == cell_mm]
        for path, label, look in (
            ("error_mm/mean", f"{cell_mm:g} mm cells, mode", charts.SOLID),
            ("refined_error_mm/mean", f"{cell_mm:g} mm, refined", charts.DASHED | {"linestyle": "-"}),
        ):
            charts.series(axes, own, "count", path, label, color=colour, **EDGED | look)
        if knee["balanced_count"] <= 2.0 * finest:
            charts.rule(axes, knee["balanced_count"], f"fine, {cell_mm:g} mm", vertical=True, colour=colour)
        if cell_mm == 0.5:
            look = {"color": charts.GREY, "linestyle": "--", "marker": ""}
            charts.series(axes, own, "count", "nearest_bin_mm", "nearest bin", **look)
    floors = [knee["floor_mm"] for knee in document["knees"] if knee["floor_mm"]]
    for least in sorted(floors, key=lambda floor: float(floor["mean"]))[:1]:
        charts.rule(axes, least["mean"], f"least error {mean_text(least)} mm, {least['trials']} trials")
    return axes


def bounds_chart(document: Json) -> Axes:
    """Times of histogram and bounds over bins."""
    y = f"time per unknown of {document['touches']} touches"
    axes = charts.chart("bins in all", y, xscale="log", yscale="log")
    charts.ticks(axes.xaxis, count_text)
    charts.ticks(axes.yaxis, seconds_text)
    for colour, kind, name in (
        (charts.COLOURS[0], "histogram", "histogram"),
        (charts.COLOURS[1], "bounded", "by bounds"),
    ):
        for asked, words, look in (
            ("once", "asked once", charts.SOLID),
            ("each_touch", "asked after each touch", charts.DASHED),
        ):
            look = EDGED | {"color": colour} | look
            label = f"{name}, {words}"
            charts.series(axes, document["bounds"], "bins_in_all", f"{kind}/{asked}", label, **look)
    return axes


def charts_of(document: Json) -> dict[str, Figure]:
    """All charts, by the names of their files."""
    drawn = {
        "sweep_front": pose_chart(document),
        "sweep_bins": knee_chart(document),
        "sweep_bounds": bounds_chart(document),
    }
    return {name: charts.finished(axes) for name, axes in drawn.items()}
