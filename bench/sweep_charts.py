"""The sweep's charts."""

from collections.abc import Sequence
from typing import Any

import numpy
from matplotlib.figure import Figure
from numpy.typing import NDArray

from palpate import _charts as charts
from palpate._tables import column, count_text, mean_text, seconds_text, value_of

from .program import Json
from .trials import Floats


def front_of(costs: Floats, errors: Floats) -> NDArray[numpy.intp]:
    """Which are on the Pareto front of costs and errors, by rising cost; of equals the first."""
    rising = numpy.lexsort((errors, costs))
    least = numpy.minimum.accumulate(errors[rising])
    return numpy.compress(numpy.diff(least, prepend=numpy.inf) < 0.0, rising)


class Chart:
    """A chart with logarithmic axes."""

    def __init__(self, x: str, y: str) -> None:
        self.axes = charts.chart(x, y, xscale="log", yscale="log")

    def add(
        self,
        records: Sequence[Json],
        x: str,
        y: str,
        label: str,
        counted: bool = False,
        **look: Any,
    ) -> None:
        """A series of what paths find in records, if any has it.

        counted: whether marks have their counts beside them.
        """
        records = [record for record in records if value_of(record, y) is not None]
        if not records:
            return
        places = column(records, x), column(records, y)
        self.axes.plot(*places, label=label, **({"markeredgecolor": "auto"} | look))
        for record, place in zip(records, numpy.transpose(places).tolist(), strict=True):
            if counted:
                look_of_text: Json = {"fontsize": 8, "color": look["color"]}
                self.axes.annotate(
                    count_text(record["count"]), place, (6, 3), textcoords="offset points", **look_of_text
                )

    def add_front(self, costs: Floats, errors: Floats) -> None:
        """The Pareto front of what costs and errs so much."""
        front = front_of(costs, errors)
        look: Json = {"color": charts.GREY, "linestyle": "-", "marker": "", "zorder": 1}
        self.axes.plot(costs[front], errors[front], label="Pareto front", **look)

    def finish(self) -> Figure:
        """Adds the legend and lays the chart out."""
        return charts.finished(self.axes)


def pose_chart(document: Json) -> Figure:
    """The front is over runs that recognise and locate all trials, as errors over some would flatter."""
    chart = Chart(
        f"time per unknown of {document['touches']} touches, an estimate after each",
        "mean pose error (mm)",
    )
    charts.ticks(chart.axes.xaxis, seconds_text)
    fills: dict[float, Json] = {0.25: {"alpha": 0.4}, 0.5: {}, 1.0: charts.HOLLOW}
    best = []
    for i, (kind, of, name, mark, counted) in enumerate(
        (
            # The refined pose stands right below its mode, and particles by their like.
            ("histogram", "error_mm", "histogram, mode", "o", False),
            ("histogram", "refined_error_mm", "histogram, refined", "s", True),
            ("particles", "error_mm", "particles", "^", True),
            ("augmented", "error_mm", "Augmented MCL", "D", False),
            ("systematic", "error_mm", "systematic resampling", "^", False),
        )
    ):
        points = [
            point | {"seconds": point["seconds_per_unknown"] + refine_s}
            for point in document["points"]
            if point["filter"] == kind
            for refine_s in [point["seconds_refine"] if of == "refined_error_mm" else 0.0]
        ]
        for cell_mm, fill in fills.items():
            usual = cell_mm == 0.5
            chart.add(
                [point for point in points if point["cell_mm"] == cell_mm],
                "seconds",
                f"{of}/mean",
                name if usual else "",
                counted and usual,
                linestyle="",
                marker=mark,
                color=charts.COLOURS[i],
                **fill,
            )
        best += [
            (point["seconds"], point[of]["mean"])
            for point in points
            if point["accuracy"] == 1.0 and point[of] and point[of]["trials"] == document["trials"]
        ]
    if best:
        chart.add_front(*numpy.transpose(best))
    return chart.finish()


def knee_chart(document: Json) -> Figure:
    """Errors over balanced bins, by colours for map cells."""
    chart = Chart("bins per object", "mean pose error (mm)")
    charts.ticks(chart.axes.xaxis, count_text)
    balanced = [point for point in document["points"] if point["balanced"]]
    finest = max(point["count"] for point in balanced)
    for colour, knee in zip(charts.COLOURS, document["knees"], strict=False):
        cell_mm = knee["cell_mm"]
        own = [point for point in balanced if point["cell_mm"] == cell_mm]
        for path, label, look in (
            ("error_mm/mean", f"{cell_mm:g} mm cells, mode", charts.SOLID),
            ("refined_error_mm/mean", f"{cell_mm:g} mm, refined", charts.DASHED | {"linestyle": "-"}),
        ):
            chart.add(own, "count", path, label, color=colour, **look)
        if knee["balanced_count"] <= 2.0 * finest:
            fine = f"fine, {cell_mm:g} mm"
            charts.rule(chart.axes, knee["balanced_count"], fine, vertical=True, colour=colour)
        if cell_mm == 0.5:
            look = {"color": charts.GREY, "linestyle": "--", "marker": ""}
            chart.add(own, "count", "nearest_bin_mm", "nearest bin", **look)
    floors = [knee["floor_mm"] for knee in document["knees"] if knee["floor_mm"]]
    for least in sorted(floors, key=lambda floor: float(floor["mean"]))[:1]:
        words = f"least error {mean_text(least)} mm, {least['trials']} trials"
        charts.rule(chart.axes, least["mean"], words)
    return chart.finish()


def bounds_chart(document: Json) -> Figure:
    """Times of histogram and bounds over bins."""
    chart = Chart("bins in all", f"time per unknown of {document['touches']} touches")
    charts.ticks(chart.axes.xaxis, count_text)
    charts.ticks(chart.axes.yaxis, seconds_text)
    for colour, kind, name in (
        (charts.COLOURS[0], "histogram", "histogram"),
        (charts.COLOURS[1], "bounded", "by bounds"),
    ):
        for asked, words, look in (
            ("once", "asked once", charts.SOLID),
            ("each_touch", "asked after each touch", charts.DASHED),
        ):
            y, label = f"{kind}/{asked}", f"{name}, {words}"
            chart.add(document["bounds"], "bins_in_all", y, label, color=colour, **look)
    return chart.finish()


def charts_of(document: Json) -> dict[str, Figure]:
    """All charts, by the names of their files."""
    return {
        "sweep_front": pose_chart(document),
        "sweep_bins": knee_chart(document),
        "sweep_bounds": bounds_chart(document),
    }
