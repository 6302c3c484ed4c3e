"""Charts in one style: series told apart by mark and dashes as well as by colour."""

import io
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib
import numpy
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from ._program import Json, write
from ._tables import column

#: Colours of Okabe and Ito, who chose them for every kind of colour vision.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
#: For a series that others are compared with.
GREY = "#616161"

matplotlib.rcParams.update(
    {
        "figure.figsize": (9.6, 5.4),
        "figure.constrained_layout.use": True,
        "axes.grid": True,
        "axes.axisbelow": True,
        "axes.titlesize": 10,
        "axes.titlelocation": "left",
        "axes.prop_cycle": cycler(color=COLOURS)
        + cycler(marker=list("os^Dos^"))
        + cycler(linestyle=["-", "--", ":", "-", "--", ":", "-"]),
        "grid.color": "#d6d6d6",
        "lines.linewidth": 1.5,
        "lines.markeredgewidth": 0.8,
        "lines.markeredgecolor": "white",
        "legend.frameon": False,
        "savefig.dpi": 150,
        "svg.hashsalt": "palpate",  # the same chart is the same file
    }
)

#: Marks of series that share a colour, and looks of two such.
HOLLOW: Json = {"markerfacecolor": "white", "markeredgecolor": "auto"}
SOLID: Json = {"marker": "o", "linestyle": "-"}
DASHED: Json = {"marker": "s", "linestyle": "--"} | HOLLOW


def chart(x: str, y: str, title: str = "", **scales: str) -> Axes:
    """The axes of an empty chart with these labels; scales: `xscale` and `yscale`."""
    axes = Figure().add_subplot(xlabel=x, ylabel=y, title=title, **scales)
    if x == "touches":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            ticks(axis, "{:g}".format, (1.0, 2.0, 5.0))
    return axes


def ticks(axis: Axis, text: Callable[[float], str], steps: Sequence[float] = (1.0,)) -> None:
    """Writes the ticks of a logarithmic axis: these multiples of the powers of ten."""
    axis.set_major_locator(LogLocator(subs=steps, numticks=20))
    axis.set_major_formatter(lambda value, _: text(value))
    axis.set_minor_formatter(NullFormatter())


def series(
    axes: Axes, records: Sequence[Json], x: str, y: str, label: str, scale: float = 1.0, **look: Any
) -> str | None:
    """What paths find in records, as a line with a look and a gap where one has no y; its colour, or None
    where none has y, and nothing is drawn."""
    values = scale * column(records, y)
    if numpy.isnan(values).all():
        return None
    (line,) = axes.plot(column(records, x), values, label=label, **look)
    return str(line.get_color())


def rule(axes: Axes, at: float, label: str, *, vertical: bool = False, colour: str = GREY) -> None:
    """A dotted line across the chart at one value of x (`vertical`) or y, with its label."""
    text: Json = {"ha": "right", "fontsize": 9, "color": colour}
    if vertical:
        axes.axvline(at, color=colour, linestyle=":", linewidth=1.2)
        place = axes.get_xaxis_transform()
        axes.text(at, 0.98, label + " ", rotation=90, va="top", transform=place, **text)
    else:
        axes.axhline(at, color=colour, linestyle=":", linewidth=1.2)
        axes.text(0.99, at, label, va="bottom", transform=axes.get_yaxis_transform(), **text)


def finished(axes: Axes) -> Figure:
    """The chart with the series' names above it; touches are counted from 0 on."""
    if axes.get_xlabel() == "touches":
        axes.set_xlim(left=0.0)
    names = axes.get_legend_handles_labels()[1]
    figure = axes.figure
    assert isinstance(figure, Figure)
    figure.legend(loc="outside upper left", ncols=2 if max(map(len, names)) > 30 else 3)
    return figure


def image(figure: Figure, kind: str, **options: Any) -> bytes:
    """The figure as a file, "png" or "svg"; the same figure gives the same bytes."""
    drawn = io.BytesIO()
    metadata = {"Date": None} if kind == "svg" else None
    figure.savefig(drawn, format=kind, metadata=metadata, **options)
    return drawn.getvalue()


def save(figures: Mapping[str, Figure], folder: str | None) -> None:
    """Writes each of the charts into the folder as NAME.png and NAME.svg, where there is a folder."""
    for name, figure in figures.items() if folder else ():
        for kind in ("png", "svg"):
            write(pathlib.Path(str(folder), f"{name}.{kind}"), image(figure, kind))
