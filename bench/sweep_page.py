"""The sweep's charts, and its page, which needs no network."""

import html
import string
import urllib.parse
from collections.abc import Sequence
from typing import Any

import numpy
from numpy.typing import NDArray

from palpate import _charts as charts
from palpate._statistics import LEAST_GAIN
from palpate._tables import Column, column, count_text, mean_text, seconds_text, texts, value_of

from .program import Json
from .sweep_runs import AUTO_RULE, SAMPLED
from .sweep_tables import BOUNDS, LIMITS, PRECISIONS, RUNS, STEPS, VERDICTS
from .trials import Floats


def front_of(costs: Floats, errors: Floats) -> NDArray[numpy.intp]:
    """Which are on the Pareto front of costs and errors, by rising cost; of equals the first."""
    rising = numpy.lexsort((errors, costs))
    least = numpy.minimum.accumulate(errors[rising])
    return numpy.compress(numpy.diff(least, prepend=numpy.inf) < 0.0, rising)


class Chart:
    """A chart with logarithmic axes that knows where its marks stand."""

    def __init__(self, x: str, y: str) -> None:
        self.axes = charts.chart(x, y, xscale="log", yscale="log")
        #: x, y, and what is told under the pointer.
        self.marks: list[tuple[float, float, str]] = []

    def add(
        self,
        records: Sequence[Json],
        x: str,
        y: str,
        label: str,
        columns: Sequence[Column] = (),
        counted: bool = False,
        **look: Any,
    ) -> None:
        """A series of what paths find in records, if any has it.

        columns: what stands under the pointer; counted: whether marks have their counts beside them.
        """
        records = [record for record in records if value_of(record, y) is not None]
        if not records:
            return
        places = column(records, x), column(records, y)
        self.axes.plot(*places, label=label, **({"markeredgecolor": "auto"} | look))
        for record, place in zip(records, numpy.transpose(places).tolist(), strict=True):
            if counted:
                look_of_text: Json = {"fontsize": 8, "color": look["color"]}
                self.axes.annotate(
                    count_text(record["count"]), place, (6, 3), textcoords="offset points", **look_of_text
                )
            cells = zip(columns, texts(columns, record), strict=True)
            told = "\n".join(f"{head}: {text}" for (head, _, _), text in cells if text != "–")
            self.marks += [(*place, told)] if told else []

    def add_front(self, costs: Floats, errors: Floats) -> None:
        """The Pareto front of what costs and errs so much."""
        front = front_of(costs, errors)
        look: Json = {"color": charts.GREY, "linestyle": "-", "marker": "", "zorder": 1}
        self.axes.plot(costs[front], errors[front], label="Pareto front", **look)

    def finish(self) -> "Chart":
        """Adds the legend and lays the chart out."""
        self.figure = charts.finished(self.axes)
        self.figure.draw_without_rendering()
        return self


def pose_chart(document: Json) -> Chart:
    """The front is over runs that recognise and locate all trials, as errors over some would flatter."""
    chart = Chart(
        f"time per unknown of {document['touches']} touches, an estimate after each",
        "mean pose error (mm)",
    )
    charts.ticks(chart.axes.xaxis, seconds_text)
    fills: dict[float, Json] = {0.25: {"alpha": 0.4}, 0.5: {}, 1.0: charts.HOLLOW}
    best = []
    for i, (kind, of, name, mark, counted) in enumerate(
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
            for refine_s in [point["seconds_refine"] if of == "refined_error_mm" else 0.0]
        ]
        for cell_mm, fill in fills.items():
            usual = cell_mm == 0.5
            chart.add(
                [point for point in points if point["cell_mm"] == cell_mm],
                "seconds",
                f"{of}/mean",
                name if usual else "",
                [("pose", "pose", str), *RUNS],
                counted and usual,
                linestyle="",
                marker=mark,
                color=charts.COLOURS[i],
                **fill,
            )
        best += [
            (point["seconds"], point[of]["mean"])
            for point in points
            if point["accuracy"] == 1.0 and point[of] and point[of]["trials"] == document["trials"]
        ]
    if best:
        chart.add_front(*numpy.transpose(best))
    return chart.finish()


def precision_chart(document: Json) -> Chart:
    """Times and deviations of the ways to evaluate the likelihood."""
    chart = Chart("time per pose, element and touch (ns)", "largest deviation from float64 (nats)")
    charts.ticks(chart.axes.yaxis, "{:.0e}".format, (1.0, 2.0, 5.0))
    precisions, x, y = document["precisions"], "nanoseconds", "deviation_nats/largest"
    chart.add_front(column(precisions, x), column(precisions, y))
    for colour, (path, name, mark) in zip(
        charts.COLOURS,
        (
            ("register tiles", "register tiles", "s"),
            ("runs", "runs of bins", "o"),
            ("in logs", "in logs (gamma = 0)", "o"),
            ("array at rest", "array at rest", "s"),
            ("one-bin", "one-bin kernel", "^"),
            ("CPU loop", "CPU loop", "D"),
        ),
        strict=False,
    ):
        own = [of for of in precisions if of["path"].startswith(path)]
        chart.add(own, x, y, name, PRECISIONS, True, linestyle="", marker=mark, color=colour)
    return chart.finish()


def knee_chart(document: Json) -> Chart:
    """Errors over balanced bins, by colours for map cells."""
    chart = Chart("bins per object", "mean pose error (mm)")
    charts.ticks(chart.axes.xaxis, count_text)
    balanced = [point for point in document["points"] if point["balanced"]]
    finest = max(point["count"] for point in balanced)
    for colour, knee in zip(charts.COLOURS, document["knees"], strict=False):
        cell_mm = knee["cell_mm"]
        own = [point for point in balanced if point["cell_mm"] == cell_mm]
        for path, label, look in (
            ("error_mm/mean", f"{cell_mm:g} mm cells, mode", charts.SOLID),
            ("refined_error_mm/mean", f"{cell_mm:g} mm, refined", charts.DASHED | {"linestyle": "-"}),
        ):
            chart.add(own, "count", path, label, RUNS, color=colour, **look)
        if knee["balanced_count"] <= 2.0 * finest:
            fine = f"fine, {cell_mm:g} mm"
            charts.rule(chart.axes, knee["balanced_count"], fine, vertical=True, colour=colour)
        if cell_mm == 0.5:
            look = {"color": charts.GREY, "linestyle": "--", "marker": ""}
            chart.add(own, "count", "nearest_bin_mm", "nearest bin", **look)
    floors = [knee["floor_mm"] for knee in document["knees"] if knee["floor_mm"]]
    for least in sorted(floors, key=lambda floor: float(floor["mean"]))[:1]:
        words = f"least error {mean_text(least)} mm, {least['trials']} trials"
        charts.rule(chart.axes, least["mean"], words)
    return chart.finish()


def bounds_chart(document: Json) -> Chart:
    """Times of histogram and bounds over bins."""
    chart = Chart("bins in all", f"time per unknown of {document['touches']} touches")
    charts.ticks(chart.axes.xaxis, count_text)
    charts.ticks(chart.axes.yaxis, seconds_text)
    for colour, kind, name in (
        (charts.COLOURS[0], "histogram", "histogram"),
        (charts.COLOURS[1], "bounded", "by bounds"),
    ):
        for asked, words, look in (
            ("once", "asked once", charts.SOLID),
            ("each_touch", "asked after each touch", charts.DASHED),
        ):
            y, label = f"{kind}/{asked}", f"{name}, {words}"
            chart.add(document["bounds"], "bins_in_all", y, label, BOUNDS, color=colour, **look)
    charts.rule(chart.axes, AUTO_RULE, "--filter auto", vertical=True)
    return chart.finish()


def charts_of(document: Json) -> dict[str, Chart]:
    """All charts, by the names of their files."""
    return {
        "sweep_front": pose_chart(document),
        "sweep_precision": precision_chart(document),
        "sweep_bins": knee_chart(document),
        "sweep_bounds": bounds_chart(document),
    }


def _picture(chart: Chart) -> str:
    """The chart as a picture in the page; invisible discs over its marks show their titles."""
    figure, axes = chart.figure, chart.axes
    width, height = 1000.0, 1000.0 * figure.get_figheight() / figure.get_figwidth()
    to_share = axes.transData + figure.transFigure.inverted()
    discs = ""
    for *place, told in chart.marks:
        x, y = to_share.transform(place)
        discs += f'<circle cx="{width * x:.0f}" cy="{height * (1.0 - y):.0f}" r="8"><title>'
        discs += f"{html.escape(told)}</title></circle>\n"
    alt = html.escape(f"{axes.get_ylabel()} against {axes.get_xlabel()}")
    picture = urllib.parse.quote(charts.image(figure, "svg"), safe=" -.,;:/()")
    return (
        f'<div class="chart"><img alt="{alt}" src="data:image/svg+xml,{picture}"/>\n'
        f'<svg viewBox="0 0 {width:.0f} {height:.0f}">\n{discs}</svg></div>'
    )


def _table(columns: Sequence[Column], records: Sequence[Json]) -> str:
    """A table that sorts by its cells' data-value: a number, the mean of a record, or the text."""
    rows = ""
    for record in records:
        cells = ""
        for (_, path, _), text in zip(columns, texts(columns, record), strict=True):
            value = value_of(record, path)
            if isinstance(value, dict):
                value = value["mean"]
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            key = value if number else "Infinity" if value is None else text
            cells += f'<td data-value="{html.escape(str(key))}">{html.escape(text)}</td>'
        rows += f"<tr>{cells}</tr>\n"
    heads = "".join(f"<th>{html.escape(head)}</th>" for head, _, _ in columns)
    return f"<table>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody></table>\n"


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
$bounds<h2>Where more bins stop helping</h2>
<p>Bins suffice where every trial is located and no finer lattice lowers the mean error by more than
$least_gain % and by more than two standard errors of the paired differences.</p>
<ul>
$knees</ul>
$steps<h2>What bounds the error</h2>
$limits<h2>All runs</h2>
<p>Trials "in full" get the full posterior. A run with fewer of them than trials has its pose errors by
bounds. $agreement Deviations are of $sampled bins per object or as many particles.</p>
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


def page_of(document: Json, drawn: dict[str, Chart]) -> str:
    """The document as one self-contained page."""
    facts = ("device", "host threads", "python", "data", "date", "command line", "seconds in all")
    verdicts, knees = document["verdicts"], document["knees"]
    return _PAGE.substitute(
        {name: _picture(chart) for name, chart in drawn.items()},
        facts="<br/>\n".join(html.escape(f"{fact}: {document[fact]}") for fact in facts),
        goals="<h2>Goals</h2>\n" + _table(VERDICTS, verdicts) if verdicts else "",
        trials=document["trials"],
        precisions=_table(PRECISIONS, document["precisions"]),
        bounds=_table(BOUNDS, document["bounds"]),
        least_gain=f"{100.0 * LEAST_GAIN:.0f}",
        knees="".join(f"<li>{html.escape(knee['sentence'])}</li>\n" for knee in knees),
        steps=_table(STEPS, [step for knee in knees for step in knee["steps"]]),
        limits=_table(LIMITS, document["limits"]),
        agreement=html.escape(document["agreement"]),
        sampled=SAMPLED,
        runs=_table(RUNS, document["points"]),
    )
