"""Charts in one style: series told apart by mark and dashes as well as by colour."""

import io
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from .report import write

matplotlib.rcParams.update(
    {
        "font.size": 10,
        "axes.grid": True,
        "grid.color": "#d6d6d6",
        "axes.axisbelow": True,
        "lines.linewidth": 1.5,
        "lines.markersize": 6,
        "lines.markeredgewidth": 0.8,
        "legend.frameon": False,
        "svg.hashsalt": "palpate",  # the same chart is the same file
        "svg.fonttype": "path",
    }
)

#: Of Okabe and Ito, who chose them for every kind of colour vision.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
#: For a series that others are compared with.
GREY = "#616161"
_DASHES = ("-", "--", ":")
_MARKS = ("o", "s", "^", "D")


def chart(x: str, y: str, *, title: str = "", log: str = "") -> tuple[Figure, Axes]:
    """An empty chart with the axes' labels; log: the axes that are logarithmic, such as "xy"."""
    figure = Figure(figsize=(9.6, 5.4), layout="constrained")
    axes = figure.add_subplot(xlabel=x, ylabel=y)
    axes.set_title(title, fontsize=10, loc="left")
    if x == "touches":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    for axis, scale in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        if scale in log:
            getattr(axes, f"set_{scale}scale")("log")
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=20))
            axis.set_minor_formatter(NullFormatter())
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    return figure, axes


def tick_text(
    axes: Axes, which: str, text: Callable[[float], str], *, decades: bool = False
) -> None:
    """Writes the ticks of an axis by a function; decades: only the powers of ten have one."""
    axis = getattr(axes, f"{which}axis")
    if decades:
        axis.set_major_locator(LogLocator(numticks=20))
    axis.set_major_formatter(FuncFormatter(lambda value, _: text(value)))


def like(i: int) -> dict[str, Any]:
    """The look of the i-th series."""
    return {"color": COLOURS[i % 7], "marker": _MARKS[i % 4], "linestyle": _DASHES[i % 3]} | EDGE


#: Marks stand out from lines and from each other.
EDGE: dict[str, Any] = {"markeredgecolor": "white"}
HOLLOW: dict[str, Any] = {"markerfacecolor": "white"}


def line(
    axes: Axes,
    records: Sequence[Mapping[str, Any]],
    x: str,
    y: str,
    *,
    scale: float = 1.0,
    interval: tuple[str, str] | None = None,
    band: bool = False,
    **look: Any,
) -> None:
    """Draws a field of records over another; a gap where a record has none.

    x, y and interval are paths such as "error_mm/mean"; interval: the ends of each point's interval,
    as error bars or, for a band, as a shade along the series.
    """
    at = [field(record, x) for record in records]
    values = [scale * field(record, y) for record in records]
    axes.plot(at, values, **look)
    if interval is None:
        return
    low, high = ([scale * field(record, end) for record in records] for end in interval)
    if band:
        axes.fill_between(at, low, high, color=look["color"], alpha=0.12, linewidth=0)
    else:
        axes.vlines(at, low, high, color=look["color"], linewidth=1.0)


def field(record: Mapping[str, Any], path: str) -> float:
    """What a path such as "error_mm/mean" finds in a record; NaN where there is nothing."""
    value: Any = record
    for name in path.split("/"):
        value = None if value is None else value.get(name)
    return float("nan") if value is None else float(value)


def rule(axes: Axes, at: float, label: str, *, vertical: bool = False, colour: str = GREY) -> None:
    """A dotted line across the chart at one value of x (`vertical`) or y, with its label."""
    (axes.axvline if vertical else axes.axhline)(at, color=colour, linestyle=":", linewidth=1.2)
    if vertical:
        axes.text(
            at, 0.98, label + " ", color=colour, rotation=90, ha="right", va="top", fontsize=9,
            transform=axes.get_xaxis_transform(),
        )  # fmt: skip
    else:
        axes.text(
            0.99, at, label, color=colour, ha="right", va="bottom", fontsize=9,
            transform=axes.get_yaxis_transform(),
        )  # fmt: skip


def legend(axes: Axes, columns: int = 3) -> None:
    """The series' names above the chart, and the title above them."""
    names = axes.get_legend_handles_labels()[1]
    if any(len(name) > 30 for name in names):
        columns = 2
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2)
    rows = -(-len(names) // columns)
    axes.set_title(axes.get_title("left"), fontsize=10, loc="left", pad=8.0 + 15.0 * rows)


def percent(axes: Axes, which: str = "y", upper: float = 105.0) -> None:
    """An axis of percents."""
    getattr(axes, f"set_{which}lim")(0.0, upper)


def svg(figure: Figure) -> bytes:
    """The figure as an SVG file; the same figure gives the same bytes."""
    drawn = io.BytesIO()
    figure.savefig(drawn, format="svg", metadata={"Date": None})
    return drawn.getvalue()


def files(names: Sequence[str]) -> list[str]:
    """NAME.png and NAME.svg for each of the charts."""
    return [name + end for name in names for end in (".png", ".svg")]


def save(figures: Mapping[str, Figure], folder: str | None) -> None:
    """Writes each of the charts into the folder as NAME.png and NAME.svg, where there is a folder."""
    for name, figure in figures.items() if folder else ():
        png = io.BytesIO()
        figure.savefig(png, format="png", dpi=150)
        write(pathlib.Path(str(folder), name + ".png"), png.getvalue())
        write(pathlib.Path(str(folder), name + ".svg"), svg(figure))
