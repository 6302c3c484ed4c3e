"""Pictures of maps and beliefs with Matplotlib, which the extra `palpate[plot]` installs."""

import io
from typing import TYPE_CHECKING

import numpy

from ._error import Error
from ._palpate import Marginals, OccupancyGrid

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot(shown: OccupancyGrid | Marginals, ax: "Axes | None" = None) -> "Axes":
    """Draws a map or a belief over position, in mm, and returns the axes."""
    if ax is None:
        try:
            from matplotlib import pyplot
        except ImportError as missing:
            raise Error("plot: Matplotlib is missing; pip install 'palpate[plot]'") from missing
        ax = pyplot.figure().add_subplot()
    _draw(shown, ax)
    return ax


def png(shown: OccupancyGrid | Marginals) -> bytes | None:
    """The picture that a notebook shows; None without Matplotlib, so that it shows the text."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return None
    figure = Figure(figsize=(4, 3.4), layout="constrained")  # not pyplot's: nothing stays open
    _draw(shown, figure.add_subplot())
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=100)
    return picture.getvalue()


def _draw(shown: OccupancyGrid | Marginals, ax: "Axes") -> None:
    if isinstance(shown, OccupancyGrid):
        _draw_map(shown, ax)
    else:
        _draw_belief(shown, ax)
    ax.set_aspect("equal")
    ax.set_xlabel("x, mm")
    ax.set_ylabel("y, mm")


def _draw_map(grid: OccupancyGrid, ax: "Axes") -> None:
    left, bottom = grid.origin_mm - grid.cell_mm / 2
    extent = (left, left + grid.nx * grid.cell_mm, bottom, bottom + grid.ny * grid.cell_mm)
    # White is what nothing is known of: the prior.
    surprise = grid.log_odds - numpy.log(grid.prior / (1 - grid.prior))
    image = ax.imshow(surprise, origin="lower", extent=extent, cmap="RdBu_r", vmin=-8, vmax=8)
    ax.figure.colorbar(image, ax=ax, label="log odds over the prior, nats")
    ax.set_title(grid.label)


def _draw_belief(marginals: Marginals, ax: "Axes") -> None:
    x, y = marginals.grid.x_mm, marginals.grid.y_mm
    image = ax.imshow(
        marginals.xy, origin="lower", extent=(x.lower, x.upper, y.lower, y.upper), cmap="Blues"
    )
    ax.figure.colorbar(image, ax=ax, label="probability")
