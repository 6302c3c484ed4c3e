"""The charts of the beliefs' parts, and a picture of one misplaced unknown."""

import math
from collections.abc import Callable
from typing import Any

import numpy
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

import palpate
from palpate import _charts as charts
from palpate._tables import column

from .belief_touches import MISPLACED_SEED, Inputs
from .measures import turning
from .program import Json
from .trials import VOWELS, Floats, Touching, error_of, make_trials, truth_of


def plot(axes: Axes, records: list[Json], path: str, label: str, **look: Any) -> None:
    """Means over touches, with their intervals."""
    touches, mean = column(records, "touches"), column(records, f"{path}/mean")
    (line,) = axes.plot(touches, mean, label=label, **look)
    low, high = (column(records, f"{path}/{of}") for of in ("low", "high"))
    axes.vlines(touches, low, high, color=line.get_color(), linewidth=1.0)


def draw_misplaced(records: list[Json]) -> dict[str, Figure]:
    """Colours tell the noise apart, dashes the beliefs."""
    figures = {}
    levels = sorted({record["off_by"] for record in records})
    for name, path, y in (
        ("misplaced", "refined_mm", "mean error of refined poses with the right letter (mm)"),
        ("sureness", "normalised_error", "squared pose error over covariance (NEES)"),
    ):
        title = "standard deviation of the error of the reported sensor pose"
        axes = charts.chart("touches", y, title, yscale="log")
        for colour, off_by in zip(charts.COLOURS, levels, strict=False):
            for belief, look in (("as if exact", charts.DASHED), ("averaged", charts.SOLID)):
                some = [of for of in records if (of["off_by"], of["belief"]) == (off_by, belief)]
                plot(axes, some, path, f"{off_by}, {belief}", color=colour, **look)
        if name == "sureness":
            charts.rule(axes, 3.0, "3 where covariances are right")
        figures[name] = charts.finished(axes)
    return figures


def draw_none(records: list[Json]) -> dict[str, Figure]:
    """Shares called none: colours tell the settings apart, dashes who was learned.

    Larger regions are left to the tables.
    """
    axes = charts.chart("touches", "called none (%)")
    names = list(dict.fromkeys(record["name"] for record in records))
    shown = [name for name in names if name == names[0] or not name.startswith("exact")]
    for colour, name in zip(charts.COLOURS, shown, strict=False):
        own = [record for record in records if record["name"] == name]
        for who, path, look in (
            ("never learned", "unlearned_called_none/mean", charts.SOLID),
            ("learned", "learned_called_none/mean", charts.DASHED),
        ):
            label = f"{name}: {who}"
            axes.plot(column(own, "touches"), 100.0 * column(own, path), label=label, color=colour, **look)
    axes.set_ylim(0.0, 105.0)
    return {"none": charts.finished(axes)}


def draw_slip(records: list[Json]) -> dict[str, Figure]:
    """Mean errors over touches."""
    y = "mean error of modes with the right letter (mm)"
    axes = charts.chart("touches", y, yscale="log")
    for record in records:
        touches, error_mm = (column(record["curve"], of) for of in ("touches", "mode_mm"))
        axes.plot(touches, error_mm, label=record["belief"], markevery=5)
    return {"slip": charts.finished(axes)}


def draw_plan(records: list[Json]) -> dict[str, Figure]:
    """Mean entropies over touches."""
    axes = charts.chart("touches", "entropy of the belief (nats)")
    for record in records:
        plot(axes, record["curve"], "entropy", record["order"])
    axes.set_ylim(bottom=0.0)
    return {"plan": charts.finished(axes)}


#: By part, what draws its charts from its records.
DRAWERS: dict[str, Callable[[list[Json]], dict[str, Figure]]] = {
    "misplaced": draw_misplaced,
    "none": draw_none,
    "slip": draw_slip,
    "plan": draw_plan,
}


def _place(refined: palpate.RefinedPose, pivot_mm: Floats) -> tuple[Floats, Floats]:
    """The pivot's place in the object frame, R(theta) p + t, and its covariance to first order."""
    x, y, theta = refined.T_object_robot
    turn = turning(theta)
    jacobian = numpy.column_stack([numpy.eye(2), turn @ (-pivot_mm[1], pivot_mm[0])])
    return turn @ pivot_mm + (x, y), jacobian @ refined.covariance @ jacobian.T


def draw_misplaced_unknown(inputs: Inputs) -> bytes:
    """The belief about one U, touched five times 1 mm and 0.05 rad beside the reported places.

    Its plain belief is too sure of the position; in others it is too sure of the angle. As if touches
    were exact, and averaged over where they may have been: the belief over position, the true place, and
    the refined pose with the ellipse that holds it up to two standard deviations. Returns a PNG file.
    """
    noise = (1.0, 0.05)
    touching = Touching(at_random_poses=True, noise=noise)
    trial = make_trials(VOWELS, 1, 5, MISPLACED_SEED, touching)[4]
    # As --pivot-mm auto: x and y then hardly depend on the angle.
    pivot_mm = trial.T_robot_sensor[0, :2]
    axis = (-10.0, 10.0, 30 if inputs.quick else 60)
    thetas = 57 if inputs.quick else 113
    lattice = palpate.PoseLattice(axis, axis, (0.0, 2.0 * math.pi, thetas), pivot_mm)
    true_mm = palpate.transform(truth_of(trial).T_object_robot, [pivot_mm])[0]
    figure = Figure(figsize=(12.0, 6.4))
    panels: Any = figure.subplots(1, 2)
    for axes, touch_sd, title in (
        (panels[0], (0.0, 0.0), "Five touches taken as exact"),
        (panels[1], noise, "The same, each known to 1 mm and 3°"),
    ):
        belief = palpate.PoseHistogram(inputs.device, inputs.maps, lattice, touch_sd=touch_sd)
        belief.update(trial)
        mode = belief.estimate().mode
        refined = belief.refine(mode)
        shown = belief.marginals(mode.object).xy
        place_mm, covariance = _place(refined, pivot_mm)
        image = axes.imshow(
            numpy.maximum(shown / shown.max(), 1e-9),
            origin="lower",
            extent=(-10, 10, -10, 10),
            norm=LogNorm(1e-6, 1.0),
        )
        circle = numpy.linspace(0.0, 2.0 * math.pi, 73)
        # The Cholesky factor carries the circle to the ellipse.
        unit = numpy.stack([numpy.cos(circle), numpy.sin(circle)], 1)
        ellipse = place_mm + 2.0 * unit @ numpy.linalg.cholesky(covariance).T
        axes.plot(*ellipse.T, "-", marker="", color="white", linewidth=3.5)
        name = "refined pose, two standard deviations"
        axes.plot(*ellipse.T, "-", marker="", color="black", linewidth=1.8, label=name)
        look: Json = {"markersize": 12, "markeredgewidth": 3, "markeredgecolor": "#d55e00"}
        axes.plot(*true_mm, "x", linestyle="", label="true", **look)
        sd = numpy.sqrt(numpy.diag(covariance))
        error_mm = error_of(inputs.maps[mode.object], truth_of(trial), refined)
        error = f"error {error_mm:.1f} mm; "
        error += f"standard deviations {sd[0]:.1f} and {sd[1]:.1f} mm"
        axes.set_title(f"{title}\n{error}", fontsize=12)
        axes.set(xlim=true_mm[0] + (-4.0, 4.0), ylim=true_mm[1] + (-4.0, 4.0))
        axes.set(xlabel="x of the first touch in the object frame, mm", ylabel="y, mm")
        axes.grid(visible=False)
    panels[0].legend(loc="lower left", frameon=True, fontsize=9)
    figure.colorbar(
        image, ax=panels, shrink=0.8, label="probability relative to the largest, all angles"
    )
    return charts.image(figure, "png", dpi=100)
