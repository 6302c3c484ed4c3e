"""The paper's figures, and what goes beyond the paper, drawn from the experiment's document."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate import _charts as charts
from palpate._tables import column

from .program import Json

# What the paper reports of letters that it touched with a real sensor.
PUBLISHED_BINS_KNOW_AFTER = {1_000: 46, 10_000: 9}  # touches to an accuracy of 100 %
PUBLISHED_ERROR_MM = 1.3  # mean, of the histogram
PUBLISHED_PARTICLE_ACCURACY = 74.0  # %, where 10,000 particles level out
MOST_PARTICLES = 10_000
MEAN_ERROR = "mean pose error of trials with the right letter (mm)"


def as_many(a: int, b: int) -> bool:
    """Whether two counts agree within a tenth.

    Whole numbers of balanced bins along each axis rarely multiply to a given count.
    """
    return 10 * abs(a - b) <= max(a, b)


def plot(axes: Axes, run: Json, path: str, label: str, scale: float = 1.0, **look: Any) -> str:
    """A field over touches, with a mark at every fifth, so that the dashes show between: the colour."""
    curve = run["curve"]
    touches, values = column(curve, "touches"), scale * column(curve, path)
    (line,) = axes.plot(touches, values, label=label, markevery=5, **look)
    return str(line.get_color())


def draw_accuracy(runs: list[Json]) -> Axes:
    """With 95 % intervals as shades."""
    axes = charts.chart("touches", "trials with the right letter, and 95 % interval (%)")
    for run in runs:
        colour = plot(axes, run, "accuracy", run["name"], 100.0)
        touches, *ends = (
            column(run["curve"], of) for of in ("touches", "accuracy_low", "accuracy_high")
        )
        axes.fill_between(
            touches, 100.0 * ends[0], 100.0 * ends[1], color=colour, alpha=0.12, linewidth=0
        )
    axes.set_ylim(0.0, 105.0)
    return axes


def draw_errors(runs: list[Json]) -> Axes:
    """Mean errors of modes."""
    axes = charts.chart("touches", MEAN_ERROR)
    for run in runs:
        plot(axes, run, "error_mm/mean", run["name"])
    axes.set_ylim(bottom=0.0)
    return axes


def draw_noise(document: Json, most: int) -> Axes:
    """Colours tell the noise apart, dashes the filters, each with its largest count."""
    title = "standard deviation of the error of the reported sensor pose"
    axes = charts.chart("touches", MEAN_ERROR, title, yscale="log")
    exact = {"translation_mm": 0.0, "rotation_rad": 0.0, "filters": document["filters"]}
    for kind, count, look in (
        ("histogram", most, charts.SOLID),
        ("particles", MOST_PARTICLES, charts.DASHED),
    ):
        for colour, level in zip(charts.COLOURS, [exact, *document["pose_noise"]], strict=False):
            for run in level["filters"]:
                if run["filter"] == kind and run["count"] == count:
                    off = f"{level['translation_mm']:g} mm, {level['rotation_rad']:g} rad"
                    plot(axes, run, "error_mm/mean", f"{run['name']}, {off}", color=colour, **look)
    axes.set_xlim(right=len(document["pose_noise"][0]["filters"][0]["curve"]) + 0.5)
    return axes


def draw_calibration(runs: list[Json]) -> Axes:
    """The share that is right against the probability that was told."""
    fewest = 10  # estimates of which a fraction says something
    axes = charts.chart(
        "confidence: probability of the most probable letter (%)",
        "estimates that are right (%)",
        f"expected calibration error in brackets; at least {fewest} estimates per point",
    )
    for run in runs:
        bins = [part for part in run["calibration"]["bins"] if part["count"] >= fewest]
        told, right = (100.0 * column(bins, of) for of in ("mean_confidence", "fraction_right"))
        error = 100.0 * run["calibration"]["expected_error"]
        axes.plot(told, right, label=f"{run['name']} ({error:.1f} %)")
    axes.plot([0, 100], [0, 100], ":", marker="", color=charts.GREY, label="perfectly calibrated")
    axes.set(xlim=(0.0, 100.0), ylim=(0.0, 105.0))
    return axes


def draw(document: Json) -> dict[str, Figure]:
    """Fig. 6a, 6b, 7a and 7b with the paper's headline numbers, and what goes beyond the paper."""
    histograms, particles, augmented = (
        [run for run in document["filters"] if run["filter"] == kind]
        for kind in ("histogram", "particles", "augmented")
    )
    drawn = {"fig6a": draw_accuracy(particles), "fig7a": draw_accuracy(histograms)}
    charts.rule(drawn["fig6a"], PUBLISHED_PARTICLE_ACCURACY, "paper: 10,000 particles level out")
    for mark, (count, touches) in zip("PD", PUBLISHED_BINS_KNOW_AFTER.items(), strict=True):
        look: Json = {"color": charts.GREY, "markersize": 8, "linestyle": ""}
        label = f"paper: {count:,} bins reach 100 %"
        drawn["fig7a"].plot(touches, 100.0, marker=mark, label=label, **look)
    drawn |= {"fig6b": draw_errors(particles), "fig7b": draw_errors(histograms)}
    charts.rule(drawn["fig7b"], PUBLISHED_ERROR_MM, f"paper: {PUBLISHED_ERROR_MM} mm")

    drawn["augmented"] = charts.chart("touches", "trials with the right letter (%)")
    for runs, dash in ((particles, "-"), (augmented, "--")):
        for colour, run in zip(charts.COLOURS, runs, strict=False):
            look = {"color": colour, "linestyle": dash}
            plot(drawn["augmented"], run, "accuracy", run["name"], 100.0, **look)
    drawn["augmented"].set_ylim(0.0, 105.0)

    most = max(run["count"] for run in histograms)
    largest = [run for run in histograms if as_many(run["count"], most)]
    finest = next(run for run in largest if run["count"] == most)
    y = "pose error of trials with the right letter (mm)"
    drawn["errors"] = charts.chart("touches", y, finest["name"], yscale="log")
    for label, path in (
        ("mode, mean", "error_mm/mean"),
        ("mode, 95th percentile", "error_mm/p95"),
        ("mode, median", "error_mm/median"),
        ("refined, 95th percentile", "refined_error_mm/p95"),
        ("refined, mean", "refined_error_mm/mean"),
    ):
        plot(drawn["errors"], finest, path, label)
    drawn["refined"] = charts.chart("touches", MEAN_ERROR, yscale="log")
    for run in largest:
        plot(drawn["refined"], run, "error_mm/mean", f"{run['name']}, mode")
        plot(drawn["refined"], run, "refined_error_mm/mean", f"{run['name']}, refined")
    drawn["pose_noise"] = draw_noise(document, most)
    # All particle filters would hide more than they show.
    drawn["calibration"] = draw_calibration([*histograms, particles[-1]])
    return {name: charts.finished(axes) for name, axes in drawn.items()}
