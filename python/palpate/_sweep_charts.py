"""The charts of palpate.sweep: error and time against bins."""

from typing import TYPE_CHECKING, Any

from ._error import Error
from ._tables import column, count_text, seconds_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The files of --plots, without their endings.
CHARTS = ("sweep_own_bins", "sweep_own_time")


def draw(document: dict[str, Any]) -> "dict[str, Figure]":
    """The charts of a sweep: error and time against bins. Raises Error without Matplotlib."""
    try:
        from matplotlib.figure import Figure
        from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
    except ImportError as missing:
        raise Error("--plots: Matplotlib is missing; pip install 'palpate[plot]'") from missing
    points = document["points"]
    truth_known = document["true_poses"] > 0
    counts = [point["count"] for point in points]

    def chart(y: str) -> tuple[Any, Any]:
        figure = Figure(figsize=(9.6, 5.4), layout="constrained")
        axes = figure.add_subplot(xlabel="bins per object", ylabel=y, xscale="log", yscale="log")
        axes.grid(color="#d6d6d6")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda count, _: count_text(count)))
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=20))
        axes.yaxis.set_minor_formatter(NullFormatter())
        return figure, axes

    def line(axes: Any, path: str, label: str, **look: Any) -> None:
        axes.plot(counts, column(points, path), label=label, **look)

    blue: Any = {"color": "#0072b2", "marker": "o"}
    red: Any = {"color": "#d55e00", "marker": "s", "linestyle": "--"}
    error_chart, axes = chart(
        "mean pose error (mm)"
        if truth_known
        else "mean distance from the pose of the finest bins (mm)"
    )
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    field_of = "error_mm" if truth_known else "from_finest_mm"
    line(axes, f"{field_of}/mean", "mode", **blue)
    line(axes, f"refined_{field_of}/mean", "refined pose", **red)
    line(axes, "sd_mm", "standard deviation of x and y, median", color="#616161", linestyle=":")
    for name, label, colour in (
        ("auto_count", "--bins auto", "#616161"),
        ("fine_count", "--bins fine", "#616161"),
        ("refined_count", "enough", "black"),
    ):
        at = document[name]
        if at is not None and counts[0] <= at <= counts[-1]:
            axes.axvline(at, color=colour, linestyle=":")
            axes.text(at, 0.98, label + " ", color=colour, rotation=90, ha="right", va="top",
                      transform=axes.get_xaxis_transform())  # fmt: skip
    time_chart, time_axes = chart("time per unknown")
    time_axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: seconds_text(value)))
    line(time_axes, "seconds_histogram", "histogram", **blue)
    line(time_axes, "seconds_bounds", "by bounds", **red)
    for each in (axes, time_axes):
        each.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False)
    return dict(zip(CHARTS, (error_chart, time_chart), strict=True))
