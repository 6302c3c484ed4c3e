"""The charts of palpate.sweep: error and time against bins."""

from typing import Any

from matplotlib.figure import Figure

from . import _charts as charts
from ._program import Json
from ._tables import column, count_text, seconds_text

#: The files of --plots, without their endings.
CHARTS = ("sweep_own_bins", "sweep_own_time")


def draw(document: dict[str, Any]) -> dict[str, Figure]:
    """The charts of a sweep: error and time against bins."""
    points = document["points"]
    truth_known = document["true_poses"] > 0
    counts = column(points, "count")
    y = "mean pose error (mm)" if truth_known else "mean distance from the pose of the finest bins (mm)"
    errors, times = (
        charts.chart("bins per object", of, xscale="log", yscale="log")
        for of in (y, "time per unknown")
    )
    charts.ticks(times.yaxis, seconds_text, (1.0, 2.0, 5.0))
    field = "error_mm" if truth_known else "from_finest_mm"
    spread: Json = {"color": charts.GREY, "linestyle": ":", "marker": ""}
    for axes, path, label, look in (
        (errors, f"{field}/mean", "mode", charts.SOLID),
        (errors, f"refined_{field}/mean", "refined pose", charts.DASHED),
        (errors, "sd_mm", "standard deviation of x and y, median", spread),
        (times, "seconds_histogram", "histogram", charts.SOLID),
        (times, "seconds_bounds", "by bounds", charts.DASHED),
    ):
        axes.plot(counts, column(points, path), label=label, **look)
    for name, label, colour in (
        ("auto_count", "--bins auto", charts.GREY),
        ("fine_count", "--bins fine", charts.GREY),
        ("refined_count", "enough", "black"),
    ):
        at = document[name]
        if at is not None and counts[0] <= at <= counts[-1]:
            charts.rule(errors, at, label, vertical=True, colour=colour)
    for axes in (errors, times):
        charts.ticks(axes.xaxis, count_text)
    return dict(zip(CHARTS, map(charts.finished, (errors, times)), strict=True))
