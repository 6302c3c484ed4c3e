"""Pictures of maps, beliefs, touches and records with Matplotlib, which the extra `palpate[plot]` installs."""

import io
from typing import TYPE_CHECKING

import numpy

from ._error import Error
from ._palpate import Marginals, OccupancyGrid, Recording, transform
from .recognition import Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_Shown = OccupancyGrid | Marginals | Recording | Record


def plot(shown: _Shown, ax: "Axes | None" = None) -> "Axes":
    """Draws a map, a belief over position, touches or a recognised pose, in mm; returns the axes."""
    if ax is None:
        try:
            from matplotlib import pyplot
        except ImportError as missing:
            raise Error("plot: Matplotlib is missing; pip install 'palpate[plot]'") from missing
        ax = pyplot.figure().add_subplot()
    _draw(shown, ax)
    return ax


def png(shown: _Shown) -> bytes | None:
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


def _draw(shown: _Shown, ax: "Axes") -> None:
    if isinstance(shown, OccupancyGrid):
        _draw_map(shown, ax)
    elif isinstance(shown, Recording):
        _draw_touches(shown, ax)
    elif isinstance(shown, Record):
        _draw_record(shown, ax)
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


def _draw_touches(recording: Recording, ax: "Axes") -> None:
    """Every reading where its element was in the robot frame; unposed ones about the origin."""
    arrays = numpy.broadcast_to(
        recording.elements_mm, (len(recording), *recording.elements_mm.shape[-2:])
    )
    poses = numpy.nan_to_num(recording.T_robot_sensor)
    places = numpy.concatenate([transform(*one) for one in zip(poses, arrays, strict=True)])
    pressure = recording.pressure.ravel()
    order = numpy.argsort(pressure)  # the largest on top; NaN, which is last, is not drawn
    x, y = places[order].T
    points = ax.scatter(x, y, c=pressure[order], s=9, cmap="viridis")
    ax.figure.colorbar(points, ax=ax, label=f"pressure, {recording.pressure_unit}")
    ax.set_title(f"{len(recording)} touches of {recording.object or 'an unknown'}")


def _draw_record(record: Record, ax: "Axes") -> None:
    """The object's frame in the robot's, with the ellipses that hold x and y in 68 and 95 % about
    the refined pose, and the modes with 5 % and more where there are several."""
    refined = record.get("refined")
    x, y, theta = (refined or record)["T_robot_object"]
    ax.plot(x, y, "o", color="black")
    length = 10.0
    if refined:
        # The covariance of T_object_robot, carried over to the place of the inverse.
        c, s = numpy.cos(refined["theta_rad"]), numpy.sin(refined["theta_rad"])
        t_x, t_y = -c * refined["x_mm"] - s * refined["y_mm"], s * refined["x_mm"] - c * refined["y_mm"]
        slope = numpy.array([[-c, -s, t_y], [s, -c, -t_x]])
        covariance = slope @ numpy.array(refined["covariance"]) @ slope.T
        widths, axes = numpy.linalg.eigh(covariance)
        turn = numpy.linspace(0, 2 * numpy.pi, 100)
        circle = axes @ (numpy.sqrt(numpy.maximum(widths, 0))[:, None] * [numpy.cos(turn), numpy.sin(turn)])
        length = 2.448 * numpy.sqrt(widths[1])
        for share, radius in ((68, 1.515), (95, 2.448)):
            ax.plot(x + radius * circle[0], y + radius * circle[1], label=f"{share} %")
        ax.legend()
    modes = [mode for mode in record["modes"] if mode["probability"] >= 0.05]
    for mode in modes if len(modes) > 1 else []:
        place = mode["T_robot_object"][:2]
        ax.plot(*place, "o", color="0.6", zorder=0)
        words = f"{mode['object']} {100 * mode['probability']:.0f} %"
        ax.annotate(words, place, xytext=(3, -9), textcoords="offset points", color="0.4")
    for angle, name in ((theta, "x"), (theta + numpy.pi / 2, "y")):
        end = x + length * numpy.cos(angle), y + length * numpy.sin(angle)
        ax.plot((x, end[0]), (y, end[1]), color="black")
        ax.annotate(name, end, xytext=(3, 3), textcoords="offset points")
    ax.set_title(f"{record['best']}, {100 * record['identity'][record['best']]:.1f} %")
