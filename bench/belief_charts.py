"""The charts of the beliefs' parts, and a picture of one misplaced unknown."""

import math
from collections.abc import Sequence
from typing import Any

import numpy
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

import palpate

from . import charts
from .measures import EXPECTED_NORMALISED_ERROR, turning
from .report import Json
from .trials import VOWELS, Floats, Touching, judged, lattice_of, make_trials, truth_of

#: By part, the files of its charts, without their endings.
FIGURES = {
    "misplaced": ("misplaced", "sureness"),
    "none": ("none",),
    "slip": ("slip",),
    "plan": ("plan",),
}
PICTURE = "misplaced_unknown.png"


def draw(part: str, records: list[Json]) -> dict[str, Figure]:
    """A part's charts from its records; none of a part without charts."""
    drawers = {"misplaced": _misplaced, "none": _none, "slip": _slip, "plan": _plan}
    drawn = drawers[part](records) if part in drawers else []
    return dict(zip(FIGURES.get(part, ()), map(charts.legend, drawn), strict=True))


def _misplaced(records: list[Json]) -> list[Figure]:
    """Means with intervals over touches: colours tell the noise apart, dashes the beliefs."""
    figures = []
    levels = sorted({(record["noise_mm"], record["noise_rad"]) for record in records})
    for field, y in (
        ("refined_mm", "mean error of refined poses with the right letter (mm)"),
        ("normalised_error", "squared pose error over covariance (NEES)"),
    ):
        title = "standard deviation of the error of the reported sensor pose"
        figure, axes = charts.chart("touches", y, title=title, log="y")
        ends = (f"{field}/low", f"{field}/high")
        for colour, (mm, rad) in zip(charts.COLOURS, levels, strict=False):
            for belief, look in (("as if exact", charts.DASHED), ("averaged", charts.SOLID)):
                look = look | {"color": colour, "label": f"{mm:g} mm, {rad:g} rad, {belief}"}
                where = {"noise_mm": mm, "belief": belief}
                charts.line(
                    axes, records, "touches", f"{field}/mean", where=where, interval=ends, **look
                )
        figures.append(figure)
    charts.rule(axes, EXPECTED_NORMALISED_ERROR, "3 where covariances are right")
    return figures


def _none(records: list[Json]) -> list[Figure]:
    """Shares called none: colours tell the settings apart, dashes who was learned.

    Larger regions are left to the tables.
    """
    figure, axes = charts.chart("touches", "called none (%)")
    names = list(dict.fromkeys(record["name"] for record in records))
    shown = [name for name in names if name == names[0] or not name.startswith("exact")]
    for colour, name in zip(charts.COLOURS, shown, strict=False):
        for who, field, look in (
            ("never learned", "unlearned_called_none", charts.SOLID),
            ("learned", "learned_called_none", charts.DASHED),
        ):
            look = look | {"color": colour, "label": f"{name}: {who}", "scale": 100.0}
            charts.line(axes, records, "touches", field, where={"name": name}, **look)
    axes.set_ylim(0.0, 105.0)
    return [figure]


def _slip(records: list[Json]) -> list[Figure]:
    y = "mean error of modes with the right letter (mm)"
    figure, axes = charts.chart("touches", y, log="y")
    for i, record in enumerate(records):
        look = charts.like(i) | {"label": record["belief"], "markevery": 5}
        charts.line(axes, record["curve"], "touches", "mode_mm", **look)
    return [figure]


def _plan(records: list[Json]) -> list[Figure]:
    figure, axes = charts.chart("touches", "entropy of the belief (nats)")
    for i, record in enumerate(records):
        look = charts.like(i) | {"label": record["order"]}
        ends = ("entropy/low", "entropy/high")
        charts.line(axes, record["curve"], "touches", "entropy/mean", interval=ends, **look)
    axes.set_ylim(bottom=0.0)
    return [figure]


def _place(refined: palpate.RefinedPose, pivot_mm: Floats) -> tuple[Floats, Floats]:
    """The pivot's place in the object frame, R(theta) p + t, and its covariance to first order."""
    x, y, theta = refined.T_object_robot
    turn = turning(theta)
    jacobian = numpy.column_stack([numpy.eye(2), turn @ (-pivot_mm[1], pivot_mm[0])])
    return turn @ pivot_mm + (x, y), jacobian @ refined.covariance @ jacobian.T


def draw_misplaced_unknown(
    device: palpate.Device, maps: Sequence[palpate.OccupancyGrid], seed: int
) -> bytes:
    """The belief about one U, touched five times 1 mm and 0.05 rad beside the reported places.

    Its plain belief is too sure of the position; in others it is too sure of the angle. As if touches
    were exact, and averaged over where they may have been: the belief over position, the true place, and
    the refined pose with the ellipse that holds it up to two standard deviations. Returns a PNG file.
    """
    noise = (1.0, 0.05)
    trial = make_trials(VOWELS, 1, 5, seed, Touching(at_random_poses=True, noise=noise))[4]
    pivot_mm = trial.T_robot_sensor[
        0, :2
    ]  # as --pivot-mm auto: x and y then hardly depend on the angle
    true_mm = palpate.transform(truth_of(trial).T_object_robot, [pivot_mm])[0]
    figure = Figure(figsize=(12.0, 6.4))
    panels: Any = figure.subplots(1, 2)
    for axes, touch_sd, title in (
        (panels[0], (0.0, 0.0), "Five touches taken as exact"),
        (panels[1], noise, "The same, each known to 1 mm and 3°"),
    ):
        belief = palpate.PoseHistogram(
            device, maps, lattice_of(60, 60, 113, pivot_mm=pivot_mm), touch_sd=touch_sd
        )
        belief.update(trial)
        step = judged(belief, maps, truth_of(trial))
        shown = belief.marginals(step.mode.object).xy
        place_mm, covariance = _place(step.refined, pivot_mm)
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
        axes.plot(*ellipse.T, color="white", linewidth=3.5)
        name = "refined pose, two standard deviations"
        axes.plot(*ellipse.T, color="black", linewidth=1.8, label=name)
        look = {"color": "#d55e00", "markersize": 12, "markeredgewidth": 3, "label": "true"}
        axes.plot(*true_mm, "x", **look)
        sd = numpy.sqrt(numpy.diag(covariance))
        error = f"error {step.refined_error_mm:.1f} mm; "
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
