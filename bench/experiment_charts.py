"""The paper's figures, drawn from the experiment's document."""

from typing import Any

from matplotlib.figure import Figure

from . import charts
from .report import Json

# What the paper reports of letters that it touched with a real sensor.
PUBLISHED_BINS_KNOW_AFTER = {1_000: 46, 10_000: 9}  # touches to an accuracy of 100 %
PUBLISHED_ERROR_MM = 1.3  # mean, of the histogram
PUBLISHED_PARTICLE_ACCURACY = 74.0  # %, where 10,000 particles level out
MOST_PARTICLES = 10_000

FIGURES = (
    "fig6a", "fig6b", "fig7a", "fig7b", "augmented", "errors", "refined", "pose_noise", "calibration",
)  # fmt: skip
MEAN_ERROR = "mean pose error of trials with the right letter (mm)"


def as_many(a: int, b: int) -> bool:
    """Whether two counts agree within a tenth.

    Whole numbers of balanced bins along each axis rarely multiply to a given count.
    """
    return 10 * abs(a - b) <= max(a, b)


def _curve(axes: Any, run: Json, path: str, label: str, **look: Any) -> None:
    """A field over touches, with a mark at every fifth, so that the dashes show between."""
    charts.line(axes, run["curve"], "touches", path, label=label, markevery=5, **look)


def _accuracy(runs: list[Json]) -> tuple[Figure, Any]:
    figure, axes = charts.chart("touches", "trials with the right letter, and 95 % interval (%)")
    axes.set_ylim(0.0, 105.0)
    ends = ("accuracy_low", "accuracy_high")
    for i, run in enumerate(runs):
        look = {"scale": 100.0, "band": True, "interval": ends} | charts.like(i)
        _curve(axes, run, "accuracy", run["name"], **look)
    return figure, axes


def _errors(runs: list[Json], published_mm: float | None = None) -> Figure:
    figure, axes = charts.chart("touches", MEAN_ERROR)
    for i, run in enumerate(runs):
        _curve(axes, run, "error_mm/mean", run["name"], **charts.like(i))
    axes.set_ylim(bottom=0.0)
    if published_mm is not None:
        charts.rule(axes, published_mm, f"paper: {published_mm} mm")
    return figure


def draw(document: Json) -> dict[str, Figure]:
    """Fig. 6a, 6b, 7a and 7b with the paper's headline numbers, and what goes beyond the paper."""
    runs: dict[str, list[Json]] = {}
    for run in document["filters"]:
        runs.setdefault(run["filter"], []).append(run)
    fig6a, axes = _accuracy(runs["particles"])
    charts.rule(axes, PUBLISHED_PARTICLE_ACCURACY, "paper: 10,000 particles level out")
    fig7a, axes = _accuracy(runs["histogram"])
    for mark, (count, touches) in zip("PD", PUBLISHED_BINS_KNOW_AFTER.items(), strict=True):
        look: dict[str, Any] = {"color": charts.GREY, "markersize": 8} | charts.EDGE
        axes.plot(touches, 100.0, mark, label=f"paper: {count:,} bins reach 100 %", **look)

    augmented, axes = charts.chart("touches", "trials with the right letter (%)")
    axes.set_ylim(0.0, 105.0)
    for kind, dash in (("particles", "-"), ("augmented", "--")):
        for i, run in enumerate(runs[kind]):
            look = charts.like(i) | {"linestyle": dash, "scale": 100.0}
            _curve(axes, run, "accuracy", run["name"], **look)

    most = max(run["count"] for run in runs["histogram"])
    largest = [run for run in runs["histogram"] if as_many(run["count"], most)]
    finest = next(run for run in largest if run["count"] == most)
    y = "pose error of trials with the right letter (mm)"
    errors, axes = charts.chart("touches", y, title=finest["name"], log="y")
    for i, (label, path) in enumerate(
        (
            ("mode, mean", "error_mm/mean"),
            ("mode, 95th percentile", "error_mm/p95"),
            ("mode, median", "error_mm/median"),
            ("refined, 95th percentile", "refined_error_mm/p95"),
            ("refined, mean", "refined_error_mm/mean"),
        )
    ):
        _curve(axes, finest, path, label, **charts.like(i))

    refined, axes = charts.chart("touches", MEAN_ERROR, log="y")
    for i, run in enumerate(largest):
        _curve(axes, run, "error_mm/mean", f"{run['name']}, mode", **charts.like(2 * i))
        path, name = "refined_error_mm/mean", f"{run['name']}, refined"
        _curve(axes, run, path, name, **charts.like(2 * i + 1))

    fig6b = _errors(runs["particles"])
    fig7b = _errors(runs["histogram"], PUBLISHED_ERROR_MM)
    noise, calibrated = _noise(document, most), _calibration(runs)
    figures = (fig6a, fig6b, fig7a, fig7b, augmented, errors, refined, noise, calibrated)
    return dict(zip(FIGURES, map(charts.legend, figures), strict=True))


def _noise(document: Json, most: int) -> Figure:
    """Colours tell the noise apart, dashes the filters, each with its largest count."""
    title = "standard deviation of the error of the reported sensor pose"
    figure, axes = charts.chart("touches", MEAN_ERROR, title=title, log="y")
    exact = {"translation_mm": 0.0, "rotation_rad": 0.0, "filters": document["filters"]}
    for kind, count, look in (
        ("histogram", most, charts.SOLID),
        ("particles", MOST_PARTICLES, charts.DASHED),
    ):
        for colour, level in zip(charts.COLOURS, [exact, *document["pose_noise"]], strict=False):
            for run in level["filters"]:
                if run["filter"] == kind and run["count"] == count:
                    off = f"{level['translation_mm']:g} mm, {level['rotation_rad']:g} rad"
                    name = f"{run['name']}, {off}"
                    _curve(axes, run, "error_mm/mean", name, color=colour, **look)
    axes.set_xlim(right=len(document["pose_noise"][0]["filters"][0]["curve"]) + 0.5)
    return figure


def _calibration(runs: dict[str, list[Json]]) -> Figure:
    fewest = 10  # estimates of which a fraction says something
    figure, axes = charts.chart(
        "confidence: probability of the most probable letter (%)",
        "estimates that are right (%)",
        title=f"expected calibration error in brackets; at least {fewest} estimates per point",
    )
    axes.plot([0, 100], [0, 100], ":", color=charts.GREY, label="perfectly calibrated")
    # All particle filters would hide more than they show.
    for i, run in enumerate([*runs["histogram"], runs["particles"][-1]]):
        bins = [part for part in run["calibration"]["bins"] if part["count"] >= fewest]
        axes.plot(
            [100.0 * part["mean_confidence"] for part in bins],
            [100.0 * part["fraction_right"] for part in bins],
            label=f"{run['name']} ({100.0 * run['calibration']['expected_error']:.1f} %)",
            **charts.like(i),
        )
    axes.set(xlim=(0.0, 100.0), ylim=(0.0, 105.0))
    return figure
