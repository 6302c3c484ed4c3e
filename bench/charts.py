"""Charts in one style: series told apart by mark and dashes as well as by colour."""

import io
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from palpate._tables import value_of

from .report import write

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
        "grid.color": "#d6d6d6",
        "lines.linewidth": 1.5,
        "lines.markeredgewidth": 0.8,
        "legend.frameon": False,
        "savefig.dpi": 150,
        "svg.hashsalt": "palpate",  # the same chart is the same file
    }
)

#: Marks stand out from lines and from each other.
EDGE: dict[str, Any] = {"markeredgecolor": "white"}
HOLLOW: dict[str, Any] = {"markerfacecolor": "white"}
#: Looks of two series that share a colour.
SOLID: dict[str, Any] = {"marker": "o", "linestyle": "-"} | EDGE
DASHED: dict[str, Any] = {"marker": "s", "linestyle": "--"} | HOLLOW


def chart(x: str, y: str, *, title: str = "", log: str = "") -> tuple[Figure, Axes]:
    """An empty chart with the axes' labels; log: the axes that are logarithmic, such as "xy"."""
    figure = Figure()
    axes = figure.add_subplot(xlabel=x, ylabel=y, title=title)
    if x == "touches":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    for scale in log:
        axes.set(**{f"{scale}scale": "log"})
        log_ticks(axes, scale, "{:g}".format, (1.0, 2.0, 5.0))
    return figure, axes


def log_ticks(
    axes: Axes, which: str, text: Callable[[float], str], steps: Sequence[float] = (1.0,)
) -> None:
    """Writes the ticks of a logarithmic axis: these multiples of the powers of ten."""
    axis = getattr(axes, f"{which}axis")
    axis.set_major_locator(LogLocator(subs=steps, numticks=20))
    axis.set_major_formatter(lambda value, _: text(value))
    axis.set_minor_formatter(NullFormatter())


def like(i: int) -> dict[str, Any]:
    """The look of the i-th series."""
    return {
        "color": COLOURS[i % 7],
        "marker": "os^D"[i % 4],
        "linestyle": "- -- :".split()[i % 3],
    } | EDGE


def line(
    axes: Axes,
    records: Sequence[Mapping[str, Any]],
    x: str,
    y: str,
    *,
    scale: float = 1.0,
    where: Mapping[str, Any] | None = None,
    interval: tuple[str, str] | None = None,
    band: bool = False,
    **look: Any,
) -> None:
    """Draws a field of records over another; a gap where a record has none.

    x, y and interval are paths such as "error_mm/mean"; where: the fields by which records are chosen;
    interval: the ends of each point's interval, as error bars or, for a band, as a shade along the
    series.
    """
    records = [record for record in records if (where or {}).items() <= record.items()]

    def of(path: str) -> list[float]:
        values = [value_of(record, path) for record in records]
        return [float("nan") if value is None else scale * value for value in values]

    at = [value_of(record, x) for record in records]
    axes.plot(at, of(y), **look)
    if interval:
        low, high = map(of, interval)
        if band:
            axes.fill_between(at, low, high, color=look["color"], alpha=0.12, linewidth=0)
        else:
            axes.vlines(at, low, high, color=look["color"], linewidth=1.0)


def rule(axes: Axes, at: float, label: str, *, vertical: bool = False, colour: str = GREY) -> None:
    """A dotted line across the chart at one value of x (`vertical`) or y, with its label."""
    text: dict[str, Any] = {"ha": "right", "fontsize": 9, "color": colour}
    if vertical:
        axes.axvline(at, color=colour, linestyle=":", linewidth=1.2)
        place = axes.get_xaxis_transform()
        axes.text(at, 0.98, label + " ", rotation=90, va="top", transform=place, **text)
    else:
        axes.axhline(at, color=colour, linestyle=":", linewidth=1.2)
        axes.text(0.99, at, label, va="bottom", transform=axes.get_yaxis_transform(), **text)


def legend(figure: Figure) -> Figure:
    """Puts the series' names above the finished chart; touches are counted from 0 on."""
    axes = figure.axes[0]
    if axes.get_xlabel() == "touches":
        axes.set_xlim(left=0.0)
    names = axes.get_legend_handles_labels()[1]
    columns = 2 if any(len(name) > 30 for name in names) else 3
    figure.legend(loc="outside upper left", ncols=columns)
    return figure


def image(figure: Figure, kind: str, **options: Any) -> bytes:
    """The figure as a file, "png" or "svg"; the same figure gives the same bytes."""
    drawn = io.BytesIO()
    figure.savefig(
        drawn, format=kind, metadata={"Date": None} if kind == "svg" else None, **options
    )
    return drawn.getvalue()


def files(names: Sequence[str]) -> list[str]:
    """NAME.png and NAME.svg for each of the charts."""
    return [f"{name}.{kind}" for name in names for kind in ("png", "svg")]


def save(figures: Mapping[str, Figure], folder: str | None) -> None:
    """Writes each of the charts into the folder as NAME.png and NAME.svg, where there is a folder."""
    for name, figure in figures.items() if folder else ():
        for kind in ("png", "svg"):
            write(pathlib.Path(str(folder), f"{name}.{kind}"), image(figure, kind))
