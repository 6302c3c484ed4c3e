"""The sweep's charts, and its page, which needs no network."""

import html
import string
import urllib.parse
from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.figure import Figure

from palpate._statistics import LEAST_GAIN
from palpate._tables import Column, count_text, mean_text, seconds_text, texts, value_of

from . import charts
from .report import Json
from .sweep_runs import SAMPLED
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
        self,
        records: Iterable[Json],
        x: str,
        y: str,
        label: str,
        columns: Sequence[Column] = (),
        *,
        counted: bool = False,
        **look: Any,
    ) -> None:
        """A series of what paths find in records that have it, if there are any.

        columns: what stands under the pointer; counted: whether marks have their counts beside them.
        """
        records = [record for record in records if value_of(record, y) is not None]
        if records:
            charts.line(self.axes, records, x, y, label=label, **look)
        for record in records:
            place = (value_of(record, x), value_of(record, y))
            if counted:
                self.axes.annotate(
                    count_text(record["count"]),
                    place,
                    (6, 3),
                    textcoords="offset points",
                    fontsize=8,
                    color=look["color"],
                )
            cells = zip(columns, texts(columns, record), strict=True)
            told = "\n".join(f"{head}: {text}" for (head, _, _), text in cells if text != "–")
            self._marks += [(*place, told)] if told else []

    def done(self) -> tuple[Figure, Spots]:
        """The chart with its legend, and its spots."""
        charts.legend(self.figure).draw_without_rendering()  # lays it out
        to_share = self.axes.transData + self.figure.transFigure.inverted()
        shares = [to_share.transform(mark[:2]).tolist() for mark in self._marks]
        told = [mark[2] for mark in self._marks]
        return self.figure, [(x, 1.0 - y, of) for (x, y), of in zip(shares, told, strict=True)]


def _pose_chart(document: Json) -> tuple[Figure, Spots]:
    chart = _Chart(
        f"time per unknown of {document['touches']} touches, an estimate after each",
        "mean pose error (mm)",
    )
    charts.log_ticks(chart.axes, "x", seconds_text)
    front = document["fronts"]["seconds per unknown, mean error in mm"]
    chart.add(front, "cost", "error", "Pareto front", color=charts.GREY, zorder=1)
    fills = {0.25: {"alpha": 0.4}, 0.5: {}, 1.0: charts.HOLLOW}
    for i, (kind, field, name, mark, counted) in enumerate(
        (
            # The refined pose stands right below its mode, and particles by their like.
            ("histogram", "error_mm", "histogram, mode", "o", False),
            ("histogram", "refined_error_mm", "histogram, refined", "s", True),
            ("particles", "error_mm", "particles", "^", True),
            ("augmented", "error_mm", "Augmented MCL", "D", False),
            ("systematic", "error_mm", "systematic resampling", "^", False),
        )
    ):
        points = [
            point | {"pose": name, "seconds": point["seconds_per_unknown"] + refine_s}
            for point in document["points"]
            if point["filter"] == kind
            for refine_s in [point["seconds_refine"] if field == "refined_error_mm" else 0.0]
        ]
        for cell_mm, fill in fills.items():
            usual = cell_mm == 0.5
            chart.add(
                [point for point in points if point["cell_mm"] == cell_mm],
                "seconds",
                f"{field}/mean",
                name if usual else "",
                [("pose", "pose", str), *RUNS],
                counted=counted and usual,
                linestyle="",
                marker=mark,
                color=charts.COLOURS[i],
                **fill,
            )
    return chart.done()


def _precision_chart(document: Json) -> tuple[Figure, Spots]:
    chart = _Chart("time per pose, element and touch (ns)", "largest deviation from float64 (nats)")
    charts.log_ticks(chart.axes, "y", "{:.0e}".format, (1.0, 2.0, 5.0))
    front = document["fronts"]["ns per pose, element and touch, largest deviation in nats"]
    chart.add(front, "cost", "error", "Pareto front", color=charts.GREY, zorder=1)
    families = (
        ("register tiles", "register tiles", "s"),
        ("runs", "runs of bins", "o"),
        ("in logs", "in logs (gamma = 0)", "o"),
        ("array at rest", "array at rest", "s"),
        ("one-bin", "one-bin kernel", "^"),
        ("CPU loop", "CPU loop", "D"),
    )
    for colour, (path, name, mark) in zip(charts.COLOURS, families, strict=False):
        own = [of for of in document["precisions"] if of["path"].startswith(path)]
        y, look = "deviation_nats/largest", {"linestyle": "", "marker": mark, "color": colour}
        chart.add(own, "nanoseconds", y, name, PRECISIONS, counted=True, **look)
    return chart.done()


def _knee_chart(document: Json) -> tuple[Figure, Spots]:
    chart = _Chart("bins per object", "mean pose error (mm)")
    charts.log_ticks(chart.axes, "x", count_text)
    balanced = [point for point in document["points"] if point["balanced"]]
    finest = max((point["count"] for point in balanced), default=0)
    for colour, knee in zip(charts.COLOURS, document["knees"], strict=False):
        cell_mm = knee["cell_mm"]
        own = [point for point in balanced if point["cell_mm"] == cell_mm]
        mode, refined = f"{cell_mm:g} mm cells, mode", f"{cell_mm:g} mm, refined"
        chart.add(own, "count", "error_mm/mean", mode, RUNS, color=colour, marker="o")
        look = {"color": colour, "marker": "s"} | charts.HOLLOW
        chart.add(own, "count", "refined_error_mm/mean", refined, RUNS, **look)
        if knee["balanced_count"] <= 2.0 * finest:
            fine = f"fine, {cell_mm:g} mm"
            charts.rule(chart.axes, knee["balanced_count"], fine, vertical=True, colour=colour)
        if cell_mm == 0.5:
            look = {"color": charts.GREY, "linestyle": "--"}
            chart.add(own, "count", "nearest_bin_mm", "nearest bin", **look)
    floors = [knee["floor_mm"] for knee in document["knees"] if knee["floor_mm"]]
    for least in sorted(floors, key=lambda floor: float(floor["mean"]))[:1]:
        words = f"least error {mean_text(least)} mm, {least['trials']} trials"
        charts.rule(chart.axes, least["mean"], words)
    return chart.done()


def _bounds_chart(document: Json) -> tuple[Figure, Spots]:
    chart = _Chart("bins in all", f"time per unknown of {document['touches']} touches")
    charts.log_ticks(chart.axes, "x", count_text)
    charts.log_ticks(chart.axes, "y", seconds_text)
    for colour, kind, name in zip(
        charts.COLOURS, ("histogram", "bounded"), ("histogram", "by bounds"), strict=False
    ):
        for asked, words, look in (
            ("once", "asked once", charts.SOLID),
            ("each_touch", "asked after each touch", charts.DASHED),
        ):
            y, label = f"{kind}/{asked}", f"{name}, {words}"
            chart.add(document["bounds"], "bins_in_all", y, label, BOUNDS, color=colour, **look)
    charts.rule(chart.axes, document["auto_rule"]["rule"], "--filter auto", vertical=True)
    return chart.done()


def charts_of(document: Json) -> dict[str, tuple[Figure, Spots]]:
    """All charts, each with what stands under the pointer."""
    drawn = (_pose_chart, _precision_chart, _knee_chart, _bounds_chart)
    return {name: draw(document) for name, draw in zip(CHARTS, drawn, strict=True)}


def _figure(figure: Figure, spots: Spots) -> str:
    """The chart as a picture in the page; invisible discs over its marks show their titles."""
    width, height = 1000.0, 1000.0 * figure.get_figheight() / figure.get_figwidth()
    discs = "".join(
        f'<circle cx="{width * x:.0f}" cy="{height * y:.0f}" r="8"><title>{html.escape(title)}'
        "</title></circle>\n"
        for x, y, title in spots
    )
    axes = figure.axes[0]
    alt = html.escape(f"{axes.get_ylabel()} against {axes.get_xlabel()}")
    picture = urllib.parse.quote(charts.image(figure, "svg"), safe=" -.,;:/()")
    return (
        f'<div class="chart"><img alt="{alt}" src="data:image/svg+xml,{picture}"/>\n'
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}">\n{discs}</svg></div>'
    )


def _table(columns: Sequence[Column], records: Iterable[Json]) -> str:
    """A table that sorts by its cells' data-value: a number, the mean of a record, or the text."""
    rows = []
    for record in records:
        cells = ""
        for (_, path, _), text in zip(columns, texts(columns, record), strict=True):
            value = value_of(record, path)
            key = (
                value["mean"] if isinstance(value, dict) else "Infinity" if value is None else value
            )
            key = html.escape(text if isinstance(value, (bool, list)) else str(key))
            cells += f'<td data-value="{key}">{html.escape(text)}</td>'
        rows.append(f"<tr>{cells}</tr>\n")
    heads = "".join(f"<th>{html.escape(head)}</th>" for head, _, _ in columns)
    return f"<table>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{''.join(rows)}</tbody></table>\n"


_PAGE = string.Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<title>Palpate: speed against error</title>
<style>
body { margin: 2rem auto; max-width: 70rem; padding: 0 1rem; font: 15px/1.5 sans-serif; }
.chart { position: relative; }
.chart img { width: 100%; display: block; }
.chart svg { position: absolute; inset: 0; width: 100%; height: 100%; }
.chart circle { fill: transparent; }
table { border-collapse: collapse; font-size: 12px; display: block; overflow-x: auto; }
th, td { padding: 0.2rem 0.4rem; text-align: right; border-bottom: 1px solid #dcdcdc; }
th { cursor: pointer; vertical-align: bottom; }
</style>
</head>
<body>
<h1>Palpate: speed against error</h1>
<p>$facts</p>
<p>bench/SWEEP.md explains the tables. Click on a head to sort; a mark shows its numbers under the
pointer. ± is a standard error.</p>
$goals<h2>Time against pose error</h2>
$sweep_front
<p>Labels are bins per object, of which there are five, or particles in all. Marks are solid for maps
with cells of 0.5 mm, pale for 0.25 mm and hollow for 1 mm. The Pareto front is over runs that
recognise and locate all $trials trials.</p>
<h2>Time against numerical error</h2>
$sweep_precision
$precisions<h2>Error against bins</h2>
$sweep_bins
<p>"Nearest bin" is the least error of any bin of the lattice. Vertical lines mark the bins that
--bins fine takes.</p>
<h2>By bounds</h2>
$sweep_bounds
<p>$auto_rule</p>
$bounds<h2>Where more bins stop helping</h2>
<p>Bins suffice where every trial is located and no finer lattice lowers the mean error by more than
$least_gain % and by more than two standard errors of the paired differences.</p>
<ul>
$knees</ul>
$steps<h2>What bounds the error</h2>
$limits<h2>All runs</h2>
<p>Trials "in full" get the full posterior. A run with fewer of them than trials has its pose errors from
windows: the bins within $reach mm of the truth. $windows Deviations are of $sampled bins per object or
as many particles.</p>
$runs<script>
document.querySelectorAll("th").forEach(function (head) {
  var sign = -1;
  head.addEventListener("click", function () {
    var body = head.closest("table").tBodies[0];
    sign = -sign;
    var key = function (row) { return row.cells[head.cellIndex].dataset.value; };
    Array.from(body.rows).sort(function (a, b) {
      var x = Number(key(a)), y = Number(key(b));
      return sign * (isNaN(x) || isNaN(y) ? key(a).localeCompare(key(b)) : x - y);
    }).forEach(function (row) { body.appendChild(row); });
  });
});
</script>
</body>
</html>
""")


def page_of(document: Json, figures: dict[str, tuple[Figure, Spots]]) -> str:
    """The document as one self-contained page."""
    facts = ("device", "host threads", "python", "data", "date", "command line", "seconds in all")
    verdicts = document["verdicts"]
    return _PAGE.substitute(
        {name: _figure(*figure) for name, figure in figures.items()},
        facts="<br/>\n".join(html.escape(f"{fact}: {document[fact]}") for fact in facts),
        goals="<h2>Goals</h2>\n" + _table(VERDICTS, verdicts) if verdicts else "",
        trials=document["trials"],
        precisions=_table(PRECISIONS, document["precisions"]),
        auto_rule=html.escape(document["auto_rule"]["sentence"]),
        bounds=_table(BOUNDS, document["bounds"]),
        least_gain=f"{100.0 * LEAST_GAIN:.0f}",
        knees="".join(f"<li>{html.escape(knee['sentence'])}</li>\n" for knee in document["knees"]),
        steps=_table(STEPS, steps_of(document)),
        limits=_table(LIMITS, document["limits"]),
        reach=f"{REACH_MM:g}",
        windows=html.escape(document["windows"]),
        sampled=SAMPLED,
        runs=_table(RUNS, document["points"]),
    )
