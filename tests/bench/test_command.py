"""`palpate-bench` fills its documents and keeps its error bounds; what README.md and bench/*.md say in words and
short tables is what the tables that it printed say, rounded."""

import json
import math
import os
import pathlib
import re
import subprocess
from typing import Any

import pytest

ROOT = pathlib.Path(__file__).parents[2]
Case = dict[str, Any]


def bench(*arguments: object, **options: Any) -> "subprocess.CompletedProcess[str]":
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.run([os.environ["PALPATE_BENCH"], *map(str, arguments)], text=True, timeout=600, **streams)


def document_of(folder: pathlib.Path, *arguments: object) -> dict[str, Any]:
    done = bench(*arguments, "--quick", "--json", folder / "bench.json")
    assert done.returncode == 0, done.stderr
    document: dict[str, Any] = json.loads((folder / "bench.json").read_text())
    return document


def cases_of(document: dict[str, Any]) -> dict[str, dict[str, float]]:
    """The values of each case; every measurement has a unit and a finite value."""
    cases: dict[str, dict[str, float]] = {}
    for case in document["cases"]:
        assert case["name"] not in cases and case["measurements"]
        cases[case["name"]] = {one["name"]: one["value"] for one in case["measurements"]}
        for one in case["measurements"]:
            what = f"{case['name']}: {one['name']} = {one['value']}"
            assert math.isfinite(one["value"]) and one["unit"], what
            assert ("reached" in one) == ("at_most" in one or "at_least" in one), what
            # The goals that are errors do not depend on how busy the machine is.
            if one["unit"].startswith("nats"):
                assert one.get("reached", True), what
    assert cases
    return cases


def test_kernels_keep_their_error_bounds(tmp_path: pathlib.Path) -> None:
    # Some 24 seconds of a processor, for eleven measurements: a thousand touches in a row, in each of
    # 50,000 bins, take five of them.
    document = document_of(tmp_path, "kernels")
    assert all(document[fact] for fact in ("device", "compiler", "date", "command line"))
    cases = cases_of(document)
    assert len(cases) == 11
    assert all(case["path"] for case in document["cases"] if case["name"].startswith("likelihood"))
    for size in ("200x200x4", "100x100x4", "25x25x16"):
        measured = cases[f"likelihood {size}"]
        # Baselines that computed something else would be no baselines.
        for error in ("largest error", "one-bin kernel's largest error", "CPU loop's largest error"):
            assert measured[error] < 1e-4, size
        assert measured["per bin, element and touch"] > 0.0
        assert measured["device memory"] >= 8.0, "two floats per bin"
    for size in ("100x100x1", "25x25x2"):
        assert cases[f"accuracy {size}"]["largest error at touch 1000"] < 1e-2
    assert cases["reductions 200x200x4"]["two runs of equal bits"] == 1.0
    assert cases["maps at 0.1 mm"]["largest error"] < 1e-3
    for stream in ("one spot", "a letter"):
        # Increments to a few parts in 1e7, up to some tenfold cancellation of contact by no contact.
        assert cases[f"map stream of {stream}"]["largest relative error"] < 1e-5
    unknowns = cases["many unknowns"]
    assert unknowns["of 3, other bits than one by one"] == 0.0
    # Nine touches tell the letters apart, by the paper; a seed may be unlucky.
    assert unknowns["letter of the mode is right"] > 90.0
    assert unknowns["a process per unknown"] > 0.0 and unknowns["palpate batch by bounds"] > 0.0
    assert cases["latency 25x25x16"]["device, by its clock"] > 0.0


def expect_within_tolerance(answers: dict[str, Any]) -> None:
    """The certificates of three answers that had the time they needed."""
    assert len(answers["milliseconds"]) == 3
    assert max(answers["dropped_mass"]) <= 1e-6
    assert min(answers["bins_evaluated"]) > 0.0


def test_bounds_answer_within_the_tolerance_and_tell_where_they_search(tmp_path: pathlib.Path) -> None:
    bounded = document_of(tmp_path, "bounded")
    cases_of(bounded)
    assert len(bounded["speed"]) == 2
    for size in bounded["speed"]:
        for threads in ("all_threads", "one_thread"):
            expect_within_tolerance(size[threads])
        assert size["all_threads"]["bins_evaluated"] == size["one_thread"]["bins_evaluated"], "of the same search"
        assert len(size["dense_seconds"]) == 3
    expect_within_tolerance(bounded["mode"]["answers"])
    assert bounded["mode"]["answers"]["mode_certain"] == 3
    assert len(bounded["large"]) == 4, "two pivots, exact and misplaced touches"
    for scene in bounded["large"]:
        expect_within_tolerance(scene["answers"])
        assert scene["host_bytes"] > 0
    assert len(bounded["streaming"]) == 9
    for touch in bounded["streaming"]:
        assert len(touch["milliseconds"]) == 3
        assert all(0.0 <= dropped <= 1.0 for dropped in touch["dropped_mass"]), "also where the budget ends it"
    search = bounded["search"]
    before = search["bins_in_all"]
    assert len(search["stages"]) == 3
    for stage in search["stages"]:
        assert stage["blocks"]
        for level, x, nx, y, ny, thetas in stage["blocks"]:
            assert level >= 0 and x >= 0 and y >= 0 and min(nx, ny, thetas) > 0
            assert x + nx <= search["bins"][0] and y + ny <= search["bins"][1] and thetas <= search["bins"][2]
        assert stage["bins_evaluated"] < before, "touches leave fewer places"
        before = stage["bins_evaluated"]


@pytest.mark.parametrize(
    "arguments",
    [["bounded", "--part", "nonsense"], ["kernels", "--json", "/missing/bench.json"], ["kernels", "--slowly"], []],
)
def test_what_cannot_be_is_refused_before_anything_is_measured(arguments: list[str]) -> None:
    assert bench(*arguments).returncode == 2


def test_output_that_is_lost_is_a_failure() -> None:
    with open("/dev/full", "w") as full:
        assert bench("--help", stdout=full).returncode == 1


FINE, MIDDLE, COARSE = "likelihood 200x200x250", "likelihood 100x100x100", "likelihood 25x25x16"
EXACT, REDUCED = "accuracy 100x100x1", "reductions 200x200x250"
PER_BIN = "per bin, element and touch"
README, RESULTS = "README.md", "bench/RESULTS.md"

#: File, words of the line that quotes a figure, case, what was measured, and how the line has it.
QUOTED = [
    (README, "| log-likelihood against", EXACT, "largest error at touch 1", " {:.1e} nats per touch"),
    (README, "| log-likelihood against", EXACT, "largest error at touch 1000", " {:.1e} after 1,000"),
    (RESULTS, "| likelihood 200x200x250 ≤", FINE, PER_BIN, " {:.2f} ns |"),
    (RESULTS, "| likelihood 100x100x100 ≤", MIDDLE, PER_BIN, " {:.2f} ns |"),
    (RESULTS, "| coarse lattice, 25x25x16", COARSE, PER_BIN, " {:.2f} ns |"),
    (RESULTS, "| error ≤ 1e-4 nats per touch", EXACT, "largest error at touch 1", " {:.1e} |"),
    (RESULTS, "| error ≤ 1e-3 nats after 50", EXACT, "largest error at touch 50", " {:.1e} |"),
    (RESULTS, "| error ≤ 1e-2 nats after 1,000", EXACT, "largest error at touch 1000", " {:.1e} |"),
    (RESULTS, "| ≤ 10 B per bin", FINE, "device memory", " {:.2f} B |"),
    (RESULTS, "| identity and mode of 50", REDUCED, "identity and mode", " {:.0f} ms |"),
    (RESULTS, "| with all marginals", REDUCED, "identity, mode and all marginals", " {:.0f} ms |"),
    (RESULTS, "| five maps of 192", "maps at 0.1 mm", "all maps", " {:.3f} s, "),
    (RESULTS, "| five maps of 192", "maps at 0.1 mm", "largest error", " {:.1e} nats |"),
    (RESULTS, "| a relative 1e-4", "map stream of one spot", "largest relative error", " {:.1e} |"),
    (RESULTS, "| many unknowns: ≤ 10 %", "many unknowns", "lost against the large case", " {:.1f} % |"),
    (RESULTS, "| many unknowns: ≥ 4", "many unknowns", "rate over a process per unknown", " {:.1f} times |"),
    (RESULTS, "| many unknowns: ≥ 1,000 per s", "many unknowns", "palpate batch by bounds", " {:.0f} per s |"),
    (RESULTS, "| one touch of 5 x 10,000", COARSE.replace("likelihood", "latency"), "touch to estimate, median",
     " {:.1f} ms, "),
    (RESULTS, "| one touch of 5 x 10,000", COARSE.replace("likelihood", "latency"), "device, by its clock",
     " {:.1f} on the device"),
    (RESULTS, "times as long: it blends", FINE, "CPU loop's time over this", "  {:.2f} to "),
    (RESULTS, "times as long: it blends", COARSE, "CPU loop's time over this", " to {:.2f} times"),
]  # fmt: skip


def test_documents_quote_the_kernels_table_as_it_is() -> None:
    table = {}
    for row in re.findall(r"^\|(.+)\|$", (ROOT / RESULTS).read_text(), re.MULTILINE):
        cells = [cell.strip() for cell in row.split("|")]
        if len(cells) == 5 and (value := re.match(r"-?\d[-+.e\d]*", cells[2])):
            table[cells[0], cells[1]] = float(value[0])
    for file, words, case, what, form in QUOTED:
        figure = form.format(table[case, what])
        [line] = [line for line in (ROOT / file).read_text().splitlines() if words in line]
        assert figure in line, f"{file}: '{figure}' is not in: {line}"
