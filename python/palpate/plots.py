"""Pictures of maps, beliefs, touches, records and results with Matplotlib, which the extra
`palpate[plot]` installs."""

import io
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy

from ._error import Error
from ._palpate import LearnedSensor, Marginals, OccupancyGrid, transform
from ._recording import Recording
from .results import Evaluation, Record, Scores

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot(shown: object, ax: "Axes | None" = None) -> "Axes":
    """Draws a map, a belief over position, touches or a recognised pose, in mm, or what was evaluated or
    learned; returns the axes."""
    if ax is None:
        try:
            from matplotlib import pyplot
        except ImportError as missing:
            raise Error("plot: Matplotlib is missing; pip install 'palpate[plot]'") from missing
        ax = pyplot.figure(layout="constrained").add_subplot()
    _draw(shown, ax)
    return ax


def png(shown: object) -> bytes | None:
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


def _draw(shown: object, ax: "Axes") -> None:
    draw, in_mm = next(row for kind, row in _DRAWN.items() if isinstance(shown, kind))
    draw(shown, ax)
    if in_mm:
        ax.set_aspect("equal")
        ax.set_xlabel("x, mm")
        ax.set_ylabel("y, mm")


def _draw_confusion(evaluation: Evaluation, ax: "Axes") -> None:
    """How often the records of a class, a row, were taken for an answer, a column."""
    confusion = evaluation.confusion
    counts = confusion.counts
    shares = counts / numpy.maximum(counts.sum(axis=1, keepdims=True), 1)
    ax.imshow(shares, cmap="Blues", vmin=0, vmax=1)
    for row, column in numpy.argwhere(counts > 0):
        colour = "white" if shares[row, column] > 0.5 else "black"
        ax.text(column, row, str(counts[row, column]), ha="center", va="center", color=colour)
    ax.set_xticks(range(counts.shape[1]), confusion["columns"], rotation=90)
    ax.set_yticks(range(counts.shape[0]), confusion["rows"])
    ax.set_xlabel("taken for")
    ax.set_ylabel("class")
    ax.set_title(f"{evaluation.right} of {evaluation.records} right")


def _draw_reliability(scores: Scores, ax: "Axes") -> None:
    """Accuracy over confidence with its 95 % interval; honest confidence lies on the dotted line."""
    bins = [each for each in scores.reliability if each.records > 0]
    confidence = [each.mean_confidence for each in bins]
    for each in bins:
        ax.plot([each.mean_confidence] * 2, each.accuracy_interval, color="0.6")
    ax.plot(confidence, [each.accuracy for each in bins], "o-")
    ax.plot([0, 1], [0, 1], ":", color="0.4")
    ax.set_xlabel("probability of the best label")
    ax.set_ylabel("share that is right")
    ax.set_title(f"{scores.records} records, calibration error {scores.calibration_error:.3f}")


def _draw_readings(sensor: LearnedSensor, ax: "Axes") -> None:
    """The probability of each level of reading over what a map says at the element's place."""
    sensed = numpy.arange(-8.0, 8.25, 0.5)  # the values of cells that touches sensed, after the others
    edges = [f"{edge:.3g}" for edge in sensor.level_edges]
    contact = [f"{a} to {b}" for a, b in zip(["threshold", *edges], edges, strict=False)]
    contact.append(f"above {edges[-1]}" if edges else "In Contact")
    for name, levels in zip(["No Contact", *contact], sensor.log_likelihood, strict=True):
        ax.plot(sensed, numpy.exp(levels[-len(sensed) :]), label=name)
    pressure = sensor.layer == "mean_level"
    ax.set_xlabel("mean pressure of the map: -8 none, 8 full, log scale" if pressure else "log odds, nats")
    ax.set_ylabel("probability of the reading")
    ax.legend(title=f"pressure, {sensor.pressure_unit}")


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
    places = numpy.reshape([transform(*one) for one in zip(poses, arrays, strict=True)], (-1, 2))
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
        slope = numpy.array([[-c, -s, y], [s, -c, -x]])
        covariance = slope @ numpy.array(refined["covariance"]) @ slope.T
        widths, axes = numpy.linalg.eigh(covariance)
        turn = numpy.linspace(0, 2 * numpy.pi, 100)
        circle = axes @ (numpy.sqrt(numpy.maximum(widths, 0))[:, None] * [numpy.cos(turn), numpy.sin(turn)])
        length = 2.448 * numpy.sqrt(widths[1])
        for share, radius in ((68, 1.515), (95, 2.448)):
            ax.plot(x + radius * circle[0], y + radius * circle[1], marker="", label=f"{share} %")
        ax.legend()
    modes = [mode for mode in record["modes"] if mode["probability"] >= 0.05]
    for mode in modes if len(modes) > 1 else []:
        place = mode["T_robot_object"][:2]
        ax.plot(*place, "o", color="0.6", zorder=0)
        words = f"{mode['object']} {100 * mode['probability']:.0f} %"
        ax.annotate(words, place, xytext=(3, -9), textcoords="offset points", color="0.4")
    for angle, name in ((theta, "x"), (theta + numpy.pi / 2, "y")):
        end = x + length * numpy.cos(angle), y + length * numpy.sin(angle)
        ax.plot((x, end[0]), (y, end[1]), color="black", marker="")
        ax.annotate(name, end, xytext=(3, 3), textcoords="offset points")
    ax.set_title(f"{record['best']}, {100 * record['identity'][record['best']]:.1f} %")


#: What draws an object of each class, and whether in the plane, in mm.
_DRAWN: dict[type[object], tuple[Callable[..., None], bool]] = {
    OccupancyGrid: (_draw_map, True),
    Marginals: (_draw_belief, True),
    Recording: (_draw_touches, True),
    Record: (_draw_record, True),
    Evaluation: (_draw_confusion, False),
    Scores: (_draw_reliability, False),
    LearnedSensor: (_draw_readings, False),
}
