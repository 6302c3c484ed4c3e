"""The sweep's charts, and its page, which needs no network."""

import html
import pathlib
import string
import urllib.parse
from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate._statistics import LEAST_GAIN
from palpate._tables import Column, count_text, mean_text, seconds_text, texts, value_of

from . import charts
from .report import Json
from .sweep_tables import BOUNDS, LIMITS, PRECISIONS, RUNS, STEPS, VERDICTS, steps_of
from .windows import REACH_MM

#: The files of the charts, without their endings.
CHARTS = ("sweep_front", "sweep_precision", "sweep_bins", "sweep_bounds")
#: Under the pointer: where a mark stands in the chart, as shares of its width and height from the
#: upper left, and what is told.
Spots = list[tuple[float, float, str]]


class _Chart:
    """A chart with logarithmic axes that knows where its marks stand."""

    def __init__(self, x: str, y: str) -> None:
        self.figure, self.axes = charts.chart(x, y, log="xy")
        self._marks: list[tuple[float, float, str]] = []

    def add(
        self, records: Iterable[tuple[float, float, str, str]], label: str = "", **look: Any
    ) -> None:
        """A series of (x, y, label beside the mark, title under the pointer); nothing without any."""
        points = list(records)
        if not points:
            return
        self.axes.plot([p[0] for p in points], [p[1] for p in points], label=label or None, **look)
        for x, y, beside, title in points:
            if beside:
                self.axes.annotate(
                    beside, (x, y), (6, 3), textcoords="offset points", fontsize=8,
                    color=look["color"],
                )  # fmt: skip
            if title:
                self._marks.append((x, y, title))

    def done(self) -> tuple[Figure, Spots]:
        """The chart with its legend, and its spots."""
        charts.legend(self.axes)
        self.figure.draw_without_rendering()  # lays it out
        to_share = self.axes.transData + self.figure.transFigure.inverted()
        spots = []
        for x, y, title in self._marks:
            across, up = to_share.transform((x, y))
            spots.append((float(across), 1.0 - float(up), title))
        return self.figure, spots


def _title(columns: Sequence[Column], record: Json) -> str:
    """A line for every column that the record has."""
    cells = zip(columns, texts(columns, record), strict=True)
    return "\n".join(f"{head}: {text}" for (head, _, _), text in cells if text != "–")


def _front(chart: _Chart, front: Sequence[Json]) -> None:
    points = [(entry["cost"], entry["error"], "", "") for entry in front]
    chart.add(points, "Pareto front", color=charts.GREY, linestyle="-", zorder=1)


def _pose_chart(document: Json) -> tuple[Figure, Spots]:
    chart = _Chart(
        f"time per unknown of {document['touches']} touches, an estimate after each",
        "mean pose error (mm)",
    )
    charts.tick_text(chart.axes, "x", seconds_text, decades=True)
    _front(chart, document["fronts"]["seconds per unknown, mean error in mm"])
    fills = {0.25: {"alpha": 0.4}, 0.5: {}, 1.0: charts.HOLLOW}
    for i, (kind, pose, name, mark, labelled) in enumerate(
        (
            # The refined pose stands right below its mode, and particles by their like.
            ("histogram", "mode", "histogram, mode", "o", False),
            ("histogram", "refined", "histogram, refined", "s", True),
            ("particles", "mode", "particles", "^", True),
            ("augmented", "mode", "Augmented MCL", "D", False),
            ("systematic", "mode", "systematic resampling", "^", False),
        )
    ):
        field = "error_mm" if pose == "mode" else "refined_error_mm"
        for cell_mm, fill in fills.items():
            chart.add(
                (
                    (
                        point["seconds_per_unknown"] + (0.0 if pose == "mode" else point["seconds_refine"]),
                        point[field]["mean"],
                        count_text(point["count"]) if labelled and cell_mm == 0.5 else "",
                        f"{name}\n{_title(RUNS, point)}",
                    )
                    for point in document["points"]
                    if (point["filter"], point["cell_mm"]) == (kind, cell_mm) and point[field]
                ),
                name if cell_mm == 0.5 else "",
                linestyle="", marker=mark, color=charts.COLOURS[i], **fill,
            )  # fmt: skip
    return chart.done()


def _precision_chart(document: Json) -> tuple[Figure, Spots]:
    chart = _Chart("time per pose, element and touch (ns)", "largest deviation from float64 (nats)")
    charts.tick_text(chart.axes, "y", lambda nats: f"{nats:.0e}")
    _front(chart, document["fronts"]["ns per pose, element and touch, largest deviation in nats"])
    families = (
        ("register tiles", "register tiles", "s"),
        ("runs", "runs of bins", "o"),
        ("in logs", "in logs (gamma = 0)", "o"),
        ("array at rest", "array at rest", "s"),
        ("one-bin", "one-bin kernel", "^"),
        ("CPU loop", "CPU loop", "D"),
    )
    for i, (path, name, mark) in enumerate(families):
        chart.add(
            (
                (of["nanoseconds"], of["deviation_nats"]["largest"], count_text(of["count"]),
                 _title(PRECISIONS, of))
                for of in document["precisions"]
                if of["path"].startswith(path)
            ),
            name, linestyle="", marker=mark, color=charts.COLOURS[i],
        )  # fmt: skip
    return chart.done()


def _bounds_chart(document: Json) -> tuple[Figure, Spots]:
    chart = _Chart("bins in all", f"time per unknown of {document['touches']} touches")
    charts.tick_text(chart.axes, "x", count_text, decades=True)
    charts.tick_text(chart.axes, "y", seconds_text, decades=True)
    for colour, kind, name in zip(
        charts.COLOURS, ("histogram", "bounded"), ("histogram", "by bounds"), strict=False
    ):
        for asked, words, look in (
            ("once", "asked once", {"marker": "o", "linestyle": "-"}),
            (
                "each_touch",
                "asked after each touch",
                {"marker": "s", "linestyle": "--"} | charts.HOLLOW,
            ),
        ):
            chart.add(
                (
                    (record["bins_in_all"], record[kind][asked], "", _title(BOUNDS, record))
                    for record in document["bounds"]
                ),
                f"{name}, {words}", color=colour, **look,
            )  # fmt: skip
    charts.rule(chart.axes, document["auto_rule"]["rule"], "--filter auto", vertical=True)
    return chart.done()


def _knee_chart(document: Json) -> tuple[Figure, Spots]:
    chart = _Chart("bins per object", "mean pose error (mm)")
    charts.tick_text(chart.axes, "x", count_text, decades=True)
    balanced = [point for point in document["points"] if point["balanced"]]
    finest = max((point["count"] for point in balanced), default=0)
    for colour, knee in zip(charts.COLOURS, document["knees"], strict=False):
        cell_mm = knee["cell_mm"]
        for field, name, look in (
            ("error_mm", "mm cells, mode", {"marker": "o"}),
            ("refined_error_mm", "mm, refined", {"marker": "s"} | charts.HOLLOW),
        ):
            chart.add(
                (
                    (point["count"], point[field]["mean"], "", _title(RUNS, point))
                    for point in balanced
                    if point["cell_mm"] == cell_mm and point[field]
                ),
                f"{cell_mm:g} {name}", color=colour, linestyle="-", **look,
            )  # fmt: skip
        if knee["balanced_count"] <= 2.0 * finest:
            fine = f"fine, {cell_mm:g} mm"
            charts.rule(chart.axes, knee["balanced_count"], fine, vertical=True, colour=colour)
    nearest = [(p["count"], p["nearest_bin_mm"], "", "") for p in balanced if p["cell_mm"] == 0.5]
    chart.add(nearest, "nearest bin", color=charts.GREY, linestyle="--")
    floors = [knee["floor_mm"] for knee in document["knees"] if knee["floor_mm"]]
    if floors:
        least = min(floors, key=lambda floor: float(floor["mean"]))
        words = f"least error {mean_text(least)} mm, {least['trials']} trials"
        charts.rule(chart.axes, least["mean"], words)
    return chart.done()


def charts_of(document: Json) -> dict[str, tuple[Figure, Spots]]:
    """All charts, each with what stands under the pointer."""
    drawn = (_pose_chart, _precision_chart, _knee_chart, _bounds_chart)
    return {name: draw(document) for name, draw in zip(CHARTS, drawn, strict=True)}


def _figure(figure: Figure, spots: Spots) -> str:
    """The chart as a picture in the page; invisible discs over its marks show their titles."""
    width, height = 1000.0, 1000.0 * figure.get_figheight() / figure.get_figwidth()
    axes: Axes = figure.axes[0]
    alt = html.escape(f"{axes.get_ylabel()} against {axes.get_xlabel()}")
    discs = "".join(
        f'<circle cx="{width * x:.0f}" cy="{height * y:.0f}" r="8"><title>{html.escape(title)}'
        "</title></circle>\n"
        for x, y, title in spots
    )
    picture = urllib.parse.quote(charts.svg(figure), safe=" -.,;:/()")
    return (
        f'<div class="chart"><img alt="{alt}" src="data:image/svg+xml,{picture}"/>\n'
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}">\n{discs}</svg></div>'
    )


def _sort_key(value: Any, text: str) -> str:
    """What a column is sorted by: a number, the mean of a record, or the text."""
    value = value["mean"] if isinstance(value, dict) else value
    if value is None:
        return "inf"
    return (
        f"{value:.9g}" if isinstance(value, (int, float)) and not isinstance(value, bool) else text
    )


def _table(columns: Sequence[Column], records: Iterable[Json]) -> str:
    heads = "".join(f'<th scope="col">{html.escape(head)}</th>' for head, _, _ in columns)
    rows = ""
    for record in records:
        cells = ""
        for (_, path, _), plain_text in zip(columns, texts(columns, record), strict=True):
            value, text = value_of(record, path), html.escape(plain_text)
            verdict = f' class="{text}"' if isinstance(value, bool) else ""
            cells += f'<td{verdict} data-value="{_sort_key(value, text)}">{text}</td>'
        rows += f"<tr>{cells}</tr>\n"
    return (
        f'<div class="wide"><table>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}'
        "</tbody></table></div>\n"
    )


class _Template(string.Template):
    """The page's text, with a part in the place of every {{name}}."""

    pattern: ClassVar[Any] = (
        r"\{\{(?:(?P<named>[a-z_]+)|(?P<braced>\b\B)|(?P<escaped>\b\B)|(?P<invalid>\b\B))\}\}"
    )


def page_of(document: Json, figures: dict[str, tuple[Figure, Spots]]) -> str:
    """The document as one self-contained page, by the template in sweep_page.html."""
    facts = ("device", "host threads", "python", "data", "date", "command line", "seconds in all")
    verdicts = document["verdicts"]
    parts = {
        "facts": "".join(
            f"<dt>{fact}</dt><dd>{html.escape(str(document[fact]))}</dd>\n" for fact in facts
        ),
        "goals": "<h2>Goals</h2>\n" + _table(VERDICTS, verdicts) if verdicts else "",
        "trials": str(document["trials"]),
        "limit_trials": str(document["limits"][0]["error_mm"]["trials"]),
        "windows": html.escape(document["windows"]),
        "sampled_bins": str(document["points"][0]["deviation_nats"]["samples"] // 5),
        "least_gain": f"{100.0 * LEAST_GAIN:.0f}",
        "window_reach": f"{REACH_MM:g}",
        "auto_rule": html.escape(document["auto_rule"]["sentence"]),
        "knees": "".join(
            f"<li>{html.escape(knee['sentence'])}</li>\n" for knee in document["knees"]
        ),
        "steps": _table(STEPS, steps_of(document)),
        "limits": _table(LIMITS, document["limits"]),
        "runs": _table(RUNS, document["points"]),
        "precisions": _table(PRECISIONS, document["precisions"]),
        "bounds": _table(BOUNDS, document["bounds"]),
    } | {name: _figure(*figure) for name, figure in figures.items()}
    page = pathlib.Path(__file__).with_suffix(".html").read_text(encoding="utf-8")
    return _Template(page).substitute(parts)
