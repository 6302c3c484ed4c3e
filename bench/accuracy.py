"""How right recognition is, and how sure: scenarios, the engines that recognise them, after some touches."""

import argparse
import math
import tempfile
from collections.abc import Sequence
from typing import Any

import numpy

import palpate
from palpate._statistics import present, quantile
from palpate._tables import Column, Table, column, number, plain

from .measures import bootstrap_record, level_in_modes, normalised_error, share_record, told_apart
from .measures import with_interval
from .program import Json, at_least_1, begin, main, parser, write
from .scenarios import PLANNED, SCENARIOS, Scenario, slipping, trials_of
from .trials import VOWELS, Bins, Body, Floats, lattice_of, letter_maps, training_recordings, truth_of

WALK_SEED = 850_000_000
SET_SEEDS = 10**10  # between the unknowns of two training sets
PLAN_BINS: Bins = (13, 13, 55)
NEAR_MM = 0.5  # the error that decisions allow by default

Scores = list[list[Json]]  # [unknown][touch]

_PERCENT, _ERROR = with_interval(".1f", 100.0), number(".3f")
FACTS = ("scenario", "engine", "touches", "unknowns", "strangers")
#: By group: what is told of the unknowns that were learned, but where columns say otherwise.
COLUMNS: dict[str, list[Column]] = {
    "identity": [
        ("right, %", "right", _PERCENT),
        ("log-loss, nats", "log_loss", with_interval(".3f")),
    ],
    "pose": [
        ("refined error, mm: median", "median_mm", _ERROR),
        ("mean", "refined_mm", with_interval(".3f")),
        ("over the first engine's", "over_first", with_interval(".2f")),
        ("mode's mean error, mm", "mode_mm", with_interval(".3f")),
    ],
    "covariance": [
        ("NEES: mean", "nees", with_interval(".3g")),
        ("median", "median_nees", number(".1f")),
    ],
    "regions": [
        ("68 % region holds, %", "coverage_68", _PERCENT),
        ("95 %", "coverage_95", _PERCENT),
        ("acts, %", "acts", _PERCENT),
        ("acted and within 0.5 mm, %", "acted_within", _PERCENT),
    ],
    "fit": [
        ("z: mean", "mean_z", number(".2f")),
        ("standard deviation", "sd_z", number(".2f")),
        ("fit, %", "fits", _PERCENT),
        ("do not fit, %", "unfit", _PERCENT),
        ("strangers that fit, %", "strangers_fit", _PERCENT),
        ("told from strangers by z, %", "told_apart_by_z", _PERCENT),
    ],
    "strangers": [("strangers that do not fit, %", "strangers_unfit", _PERCENT)],
    "none": [
        ("called none, %", "called_none", _PERCENT),
        ("strangers called none, %", "strangers_called_none", _PERCENT),
        ("told apart by (none), %", "told_apart_by_none", _PERCENT),
    ],
}


def learn(
    device: palpate.Device, scenario: Scenario, recordings: Sequence[palpate.Recording], folder: str
) -> tuple[Any, dict[str, palpate.OccupancyGrid]]:
    """What recognize() takes as maps, and the maps by label.

    By learn_maps() where an engine takes the sensor that it learns, else by letter_maps(), with equal cells.
    """
    if not scenario.learns:
        maps = letter_maps(device, recordings)
        return maps, {grid.label: grid for grid in maps}
    grids = palpate.learn_maps(recordings, folder, device=device).maps
    for grid in grids:
        if grid.suggested_symmetry is not None:  # errors are from the nearest of poses that look alike
            grid.symmetry = grid.suggested_symmetry
    return folder, {grid.label: grid for grid in grids}


def planned(
    device: palpate.Device, maps: Any, unknown: palpate.Recording, touches: int, seed: int
) -> palpate.Recording:
    """Of an unknown's touches the first, and then each where the most is expected of object and pose."""
    belief = palpate.PoseHistogram(device, maps, lattice_of(PLAN_BINS))
    left, following, order = list(range(len(unknown))), 0, []
    for touch in range(touches):
        if touch > 0:
            gains = belief.expected_gain(unknown.T_robot_sensor[left], unknown.elements_mm, seed=seed + touch)
            following = int(numpy.argmax(gains.both))
        order.append(left.pop(following))
        belief.update(unknown[order[-1]])
    return palpate.Recording(
        unknown.pressure[order], unknown.T_robot_sensor[order], unknown.elements_mm, truth=unknown.truth
    )


def score(
    step: Json, truth: palpate.Truth, grid: palpate.OccupancyGrid | None, random: numpy.random.Generator
) -> Json:
    """What a belief says beside the truth; without the map of a stranger, that alone which needs none."""
    fit, labels, tiny = step.get("fit", {}), dict(step["identity"]), numpy.finfo(float).tiny
    none, objects = labels.pop("(none)", 0.0), sum(labels.values())
    scored: Json = {
        "none": step["best"] == "(none)",
        "none_log_odds": math.log(max(none, tiny)) - math.log(max(objects, tiny)),
        "z": fit.get("z"),
        "fits": fit.get("verdict") == "fits",
        "unfit": fit.get("verdict") == "does not fit",
    }
    if grid is None:
        return scored
    scored |= {
        "right": step["best"] == truth.object,
        "loss": -math.log(max(step["identity"][truth.object], tiny)),
        "level": level_in_modes(step["modes"], truth, random),
        "act": step["decision"]["act"],
    }
    if step["mode"]["object"] != truth.object:
        return scored
    for name in ("mode", "refined"):
        if name in step:
            pose = [step[name][of] for of in ("x_mm", "y_mm", "theta_rad")]
            scored[f"{name}_mm"] = palpate.pose_error_mm(grid, pose, truth.T_object_robot)
            if name == "refined":
                covariance = step[name]["covariance"]
                scored["nees"] = normalised_error(grid, pose, covariance, truth.T_object_robot)
    return scored


def believed(
    device: palpate.Device, scenario: Scenario, engine: Json, maps: Any,
    grids: dict[str, palpate.OccupancyGrid], trials: Sequence[palpate.Recording],
) -> Scores:  # fmt: skip
    """The scores of one engine."""
    options, random = {**scenario.options, **engine}, numpy.random.default_rng(scenario.seed)
    touched, truths = [], []
    for i, trial in enumerate(trials):
        truth = truth_of(trial)
        poses = [truth.T_object_robot] * scenario.touches
        if options.get(PLANNED):
            trial = planned(device, maps, trial, scenario.touches, 1 + i * len(trial))
        if any(scenario.slip_sd):
            centroid_mm = Body.of(grids[truth.object]).centroid_mm
            trial, poses = slipping(trial, centroid_mm, scenario.slip_sd, WALK_SEED + i)
        touched.append(trial[: scenario.touches])
        truths.append([palpate.Truth(truth.object, pose) for pose in poses])
    options.pop(PLANNED, None)
    records = palpate.recognize(touched, maps, trace=True, device=device, **options)
    return [
        [
            score(step, truth, grids.get(truth.object), random)
            for step, truth in zip(record["trace"], of, strict=True)
        ]
        for record, of in zip(records, truths, strict=True)
    ]


def row_of(
    known: Scores, strangers: Scores, first: Scores, after: int | tuple[int, int], within_mm: float
) -> Json:
    """The columns of one row; first: what `known` is by the scenario's first engine."""
    least, most = (after, after) if isinstance(after, int) else after

    def values(of: Scores, name: str) -> Floats:
        """By unknown, the mean over the touches that have the field; NaN where none has."""
        steps = column(of, name).reshape(len(of), -1)[:, least - 1 : most]
        if name.endswith("_mm"):
            steps[steps > within_mm] = numpy.nan
        return numpy.array([there.mean() if len(there := present(one)) else math.nan for one in steps])

    def share(of: Any) -> Json | None:
        return share_record(of.sum(), len(of)) if len(of) else None

    def mean(of: Floats, over: Any = 1.0) -> Json | None:
        return bootstrap_record(of, over) if len(of) else None

    def median(of: Floats) -> float | None:
        return quantile(of, 0.5) if len(of) else None

    refined, first_mm = values(known, "refined_mm"), values(first, "refined_mm")
    levels, acts = values(known, "level"), values(known, "act")
    refined_there, nees, z = (present(values(known, name)) for name in ("refined_mm", "nees", "z"))
    both = ~numpy.isnan(refined + first_mm)
    row: Json = {
        "touches": str(least) if least == most else f"{least} to {most}",
        "unknowns": len(known),
        "right": share(values(known, "right")),
        "log_loss": mean(values(known, "loss")),
        "median_mm": median(refined_there),
        "refined_mm": mean(refined_there),
        "over_first": mean(refined[both], first_mm[both]) if known is not first else None,
        "mode_mm": mean(present(values(known, "mode_mm"))),
        "nees": mean(nees),
        "median_nees": median(nees),
        "coverage_68": share(levels < 0.68),
        "coverage_95": share(levels < 0.95),
        "acts": share(acts),
        "acted_within": share((refined <= NEAR_MM)[acts > 0.0]),
        "mean_z": float(z.mean()),
        "sd_z": float(z.std()),
        "fits": share(values(known, "fits")),
        "unfit": share(values(known, "unfit")),
        "called_none": share(values(known, "none")),
    }
    if strangers:
        of_strangers = {name: values(strangers, name) for name in strangers[0][0]}
        row |= {
            "strangers_fit": share(of_strangers["fits"]),
            "strangers_unfit": share(of_strangers["unfit"]),
            "strangers_called_none": share(of_strangers["none"]),
            "told_apart_by_z": told_apart(present(of_strangers["z"]), z),
            "told_apart_by_none": told_apart(values(known, "none_log_odds"), of_strangers["none_log_odds"]),
        }
    return row


def scenario_name(text: str) -> str:
    """A scenario's name of a flag."""
    if text not in SCENARIOS:
        raise argparse.ArgumentTypeError(f"{text}: no such scenario; give one of {', '.join(SCENARIOS)}")
    return text


def program() -> None:
    """Scenario by scenario, its engines on the same unknowns."""
    flags = parser(
        "accuracy",
        "Measures how right recognition is, and how sure, over scenarios of simulated unknowns: "
        + "; ".join(f"{name}: {of.about}" for name, of in SCENARIOS.items())
        + ". All of them take some two hours on two CPU cores, most a few minutes each. Intervals are of "
        "95 %: Wilson's of shares, by bootstrap over unknowns of means.",
        trials="unknowns of each object, and strangers [each scenario's own]",
    )
    flags.add_argument(
        "scenarios", nargs="*", type=scenario_name, metavar="SCENARIO",
        help="measure only this or these [all]",
    )  # fmt: skip
    flags.add_argument(
        "--sets", type=at_least_1, default=1, metavar="N",
        help="training sets, each with unknowns of its own [%(default)s]",
    )  # fmt: skip
    options = flags.parse_args()
    device, facts = begin(options)
    chosen = {name: of for name, of in SCENARIOS.items() if name in (options.scenarios or SCENARIOS)}
    groups = {group for scenario in chosen.values() for group in scenario.columns}
    shown: list[Column] = [(fact, fact, plain) for fact in FACTS]
    for group, columns in COLUMNS.items():
        shown += columns if group in groups else []
    table = Table(shown)
    for name, scenario in chosen.items():
        scenario = scenario.quick() if options.quick else scenario
        each = options.trials or scenario.each
        each_stranger = options.trials or scenario.each_stranger
        scores: dict[str, tuple[Scores, Scores]] = {engine: ([], []) for engine in scenario.engines}
        for i in range(options.sets):
            with tempfile.TemporaryDirectory() as folder:
                recordings = training_recordings(
                    scenario.touching, first_seed=1 + i * len(VOWELS), shapes=scenario.learned
                )
                if options.quick:
                    recordings = [recording[::5] for recording in recordings]
                maps, grids = learn(device, scenario, recordings, folder)
                trials = trials_of(scenario, each, each_stranger, i * SET_SEEDS, folder)
                for engine, own in scenario.engines.items():
                    for scored, some in zip(scores[engine], trials, strict=True):
                        scored += believed(device, scenario, own, maps, grids, some) if some else []
        first = next(iter(scores.values()))[0]
        for after in scenario.after:
            for engine, (known, strangers) in scores.items():
                row = row_of(known, strangers, first, after, scenario.within_mm)
                fields = [field for group in scenario.columns for _, field, _ in COLUMNS[group]]
                row |= {"scenario": name, "engine": engine, "strangers": len(strangers)}
                table.append({field: row[field] for field in (*FACTS, *fields) if field in row})
    write(options.json, facts | {"accuracy": table})


if __name__ == "__main__":
    main(program)
