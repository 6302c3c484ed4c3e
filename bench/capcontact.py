"""Which press of several fingers a real array touches, and where: against contact measured by light."""

import math
import pathlib
import tempfile
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy
from matplotlib.figure import Figure

import palpate
from palpate import _charts as charts
from palpate._statistics import present
from palpate._tables import Column, Table, column, number, plain

from .contact_array import AS_BUILT, PIXEL_MM, RATIO, SPREAD_MM, THRESHOLD, Press, Registration
from .contact_array import read_presses, touched
from .contact_learning import Learned, Learning
from .measures import level_in_modes, turning, wrapped
from .program import Json, begin, main, parser, write
from .trials import Floats, truth_of

SEED = 700_000_000
OBJECTS, QUICK_OBJECTS = 12, 4  # of a round
WINDOWS = (1, 2, 3, 5)
WHOLE = "all"  # of the windows side by side over the sheet, which show what any windows can tell
SHOWN = [*map(str, WINDOWS), WHOLE]
ROUNDS = 20
SENSORS = {"eq7": "Eq. 7", "learned": "learned"}
#: Where the sheet may lie in the object frame: objects lie within 10 mm of the robot's origin along x and
#: y, at any angle.
REGION: Any = {"bins": "auto", "x_mm": (-15.0, 15.0), "y_mm": (-15.0, 15.0)}
SEEN = 0.9  # of the contact, from which on all of it counts as seen
AMONG_MODES = 11.34  # 99 % of the squared errors over their covariance lie below, of three unknowns

_PERCENT = number(".1f", 100.0)
COLUMNS: list[Column] = [
    ("sensor", "sensor", plain),
    ("windows", "windows", plain),
    ("recognised, %", "recognised", _PERCENT),
    ("error, mm: median", "median_mm", number(".2f")),
    ("90 %", "p90_mm", number(".2f")),
    ("error, degrees: median", "median_deg", number(".2f")),
    ("90 %", "p90_deg", number(".2f")),
    ("within 2 mm, %", "within_2mm", _PERCENT),
    ("bias along x, mm", "bias_x_mm", number(".2f")),
    ("along y", "bias_y_mm", number(".2f")),
    ("log-loss", "log_loss", number(".3f")),
    ("68 % region holds, %", "coverage_68", _PERCENT),
    ("95 %", "coverage_95", _PERCENT),
    ("truth among modes, %", "among_modes", _PERCENT),
    ("all contact seen, %", "seen", _PERCENT),
    ("recognised of these, %", "recognised_where_seen", _PERCENT),
]


class Trial(NamedTuple):
    """One press as an unknown object: its windows and where it lies."""

    press: Press
    label: str
    windows: Any
    T_robot_object: Floats

    def touches(self, registration: Registration) -> palpate.Recording:
        pose = self.T_robot_object.tolist()
        return touched(self.press, self.windows, registration, pose, self.label)

    def beliefs(
        self, grids: Sequence[palpate.OccupancyGrid], registration: Registration, **options: Any
    ) -> dict[str, tuple["Trial", Json]]:
        """After each of SHOWN, as a trial of these windows and the belief."""

        def steps(trial: Trial, trace: bool) -> Any:
            # Steps before the last, too, tell improbable objects, for the log-loss.
            (found,) = palpate.recognize(
                trial.touches(registration), grids, trace=trace, none=0.0, filter="bounded", tolerance=1e-6,
                **REGION, **options,
            )  # fmt: skip
            return found.get("trace", [found])

        all_windows, after = self._replace(windows=self.press.tiles()), steps(self, True)
        beliefs = {str(n): (self._replace(windows=self.windows[:n]), after[n - 1]) for n in WINDOWS}
        return beliefs | {WHOLE: (all_windows, steps(all_windows, False)[-1])}


def draw_round(presses: Sequence[Press], objects: int, random: numpy.random.Generator) -> list[Trial]:
    """Presses that differ, at random poses in the plane."""
    return [
        Trial(
            presses[k],
            f"press {k}",
            presses[k].windows(random, max(WINDOWS)),
            random.uniform((-10.0, -10.0, -math.pi), (10.0, 10.0, math.pi)),
        )
        for k in random.permutation(len(presses))[:objects]
    ]


def score(trial: Trial, step: Json, random: numpy.random.Generator) -> Json:
    """What the belief after a trial's windows says, beside the truth."""
    truth = truth_of(trial.touches(AS_BUILT))
    right = step["best"] == trial.label
    error = numpy.array((step.get("refined") or step["mode"])["T_robot_object"]) - trial.T_robot_object
    squared = [math.inf]
    for mode in step["modes"]:
        if mode["object"] == trial.label:
            off = numpy.array(mode["T_robot_object"]) - trial.T_robot_object
            off[2] = wrapped(off[2])
            squared.append(float(off @ numpy.linalg.solve(mode["covariance"], off)))
    return {
        "right": right,
        "moved_mm": (turning(-trial.T_robot_object[2]) @ error[:2]).tolist() if right else None,
        "error_mm": math.hypot(*error[:2]) if right else None,
        "error_deg": abs(math.degrees(wrapped(error[2]))) if right else None,
        "loss": -math.log(max(step["identity"].get(trial.label, 0.0), 1e-30)),
        "level": level_in_modes(step["modes"], truth, random),
        "among_modes": min(squared) < AMONG_MODES,
        "seen": trial.press.seen(trial.windows) > SEEN,
    }


def summary(scores: Sequence[Json]) -> Json:
    """Shares are of all unknowns, errors and bias of those that are recognised.

    The bias is the mean over those within 5 mm: what lies farther off is another mode.
    """
    count = len(scores)
    mm, deg = (present(column(scores, name)) for name in ("error_mm", "error_deg"))
    near = [one["moved_mm"] for one in scores if one["right"] and one["error_mm"] < 5.0]
    bias = numpy.mean(near, axis=0).tolist() if near else [None, None]
    seen = [one["right"] for one in scores if one["seen"]]
    record: Json = {
        "unknowns": count,
        "recognised": len(mm) / count,
        "within_2mm": int((mm <= 2.0).sum()) / count,
        "bias_mm": bias,
        "bias_x_mm": bias[0],
        "bias_y_mm": bias[1],
        "log_loss": float(column(scores, "loss").mean()),
        "among_modes": sum(one["among_modes"] for one in scores) / count,
        "seen": len(seen) / count,
        "recognised_where_seen": sum(seen) / len(seen) if seen else None,
    }
    for share in (68, 95):
        record[f"coverage_{share}"] = sum(one["level"] < share / 100.0 for one in scores) / count
    for name, errors in (("mm", mm), ("deg", deg)):
        for what, q in (("median", 0.5), ("p90", 0.9)):
            record[f"{what}_{name}"] = float(numpy.quantile(errors, q)) if len(errors) else None
    return record


def draw_errors(scores: Json) -> Figure:
    """Median errors of the place against windows, with bands that hold the middle 80 %."""
    axes = charts.chart("windows", "error of the place of recognised unknowns, mm", yscale="log")
    for (name, words), colour in zip(SENSORS.items(), charts.COLOURS, strict=False):
        errors = [present(column(scores[name][str(n)], "error_mm")) for n in WINDOWS]
        bands = [numpy.quantile(of, (0.1, 0.5, 0.9)) if len(of) else [math.nan] * 3 for of in errors]
        low, median, high = numpy.array(bands).T
        axes.fill_between(WINDOWS, low, high, color=colour, alpha=0.15, linewidth=0)
        axes.plot(WINDOWS, median, color=colour, label=f"{words}: median, middle 80 %")
    axes.set_xticks(WINDOWS)
    charts.rule(axes, 2.0, "2 mm")
    return charts.finished(axes)


def draw_press(beliefs: dict[str, tuple[Trial, Json]]) -> bytes:
    """The readings of one window and of five where they lie, the true contact, and the belief."""
    figure = Figure(figsize=(11.4, 4.6), layout="constrained")
    for windows, axes in zip(("1", "5"), figure.subplots(1, 2), strict=True):
        trial, step = beliefs[windows]
        trial.touches(AS_BUILT).plot(axes)
        palpate.Record(step).plot(axes)
        press = trial.press
        pixels = numpy.argwhere(numpy.ones_like(press.contact))[:, ::-1]
        places = palpate.transform(trial.T_robot_object, PIXEL_MM * pixels - press.centroid_mm)
        x, y = places.T.reshape(2, *press.contact.shape)
        axes.contour(x, y, press.contact, levels=[0.5], colors="black", linestyles="dashed")
        reach = numpy.abs(places[press.contact.ravel()]).max() + 40  # and the windows about the contact
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach))
        axes.set_title(f"{windows} of 5 windows: readings, contact (dashed) and belief")
    return charts.image(figure, "png", dpi=100)


def recognise(
    device: palpate.Device, presses: Sequence[Press], learned: dict[int, Learned], rounds: int, objects: int
) -> tuple[dict[str, dict[str, list[Json]]], Any]:
    """The scores by sensor and windows, and the beliefs of a press that is recognised.

    learned: without the person who pressed, by person.
    """
    # What is drawn of a belief must not change which unknowns follow.
    random, in_beliefs = numpy.random.default_rng(SEED), numpy.random.default_rng(SEED + 2)
    scores: dict[str, dict[str, list[Json]]] = {name: {n: [] for n in SHOWN} for name in SENSORS}
    example: Any = None
    eq7: Any = {"threshold": THRESHOLD, "ratio": RATIO}
    for _ in range(rounds):
        trials = draw_round(presses, objects, random)
        maps = {
            spread_mm: [trial.press.grid(trial.label, spread_mm) for trial in trials]
            for spread_mm in {SPREAD_MM} | {one.settings.spread_mm for one in learned.values()}
        }
        for trial in trials:
            own = learned[trial.press.person]
            grids = maps[own.settings.spread_mm]
            beliefs = {
                "eq7": trial.beliefs(maps[SPREAD_MM], AS_BUILT, device=device, **eq7),
                "learned": trial.beliefs(grids, own.registration, device=device, sensor_model=own.sensor),
            }
            for sensor, after in beliefs.items():
                for n, belief in after.items():
                    scores[sensor][n].append(score(*belief, in_beliefs))
            if example is None and scores["learned"]["5"][-1]["right"]:
                example = beliefs["learned"]
    return scores, example


def results(scores: dict[str, dict[str, list[Json]]], learned: dict[int, Learned]) -> Json:
    """The summaries by sensor and windows, which it prints, and what was learned without each person."""
    summaries: Json = {
        sensor: {"windows": {n: summary(of) for n, of in by.items()}} for sensor, by in scores.items()
    }
    Table(COLUMNS, [
        {"sensor": words, "windows": n} | summaries[sensor]["windows"][n]
        for n in SHOWN
        for sensor, words in SENSORS.items()
    ])  # fmt: skip
    registration, settings = {}, {}
    for person, one in learned.items():
        scale = dict(zip(("factor", "map_sd_mm"), one.pose_scale, strict=True))
        registration[str(person)] = one.registration.coefficients.tolist()
        settings[str(person)] = one.settings._asdict() | {"pose_scale": scale}
    return summaries | {"registration": registration, "settings": settings, "unknowns": scores}


def program() -> None:
    """Rounds of twelve presses, by Eq. 7 as the array was built, and by what other people's presses tell."""
    flags = parser(
        "capcontact",
        "Recognises presses of several fingers on a real array among twelve, at random poses in the plane, "
        "from windows of 9 x 9 elements, in some twenty minutes of a core. Settings, sensor, pose scale "
        "and the array's place are learned without the person who is tried: the people of presses.npz are "
        "left out in turn. The presses of held_out.npz, where there is one, are tried beside, by what all of "
        "presses.npz tells.",
        plots="draw the errors, and a press with its belief, in this folder",
        trials="rounds of twelve presses [20, or 1 with --quick]",
    )
    flags.add_argument("--data", metavar="FOLDER", required=True, help="folder of presses.npz")
    options = flags.parse_args()
    folder = pathlib.Path(options.data)
    held_out = folder / "held_out.npz"
    training = read_presses(folder / "presses.npz")
    tried = {"in_turn": training}
    if held_out.exists():
        tried["held_out"] = read_presses(held_out)
    objects = QUICK_OBJECTS if options.quick else OBJECTS
    for presses in tried.values():
        if len(presses) < objects:
            raise palpate.Error(f"--data {folder}: {len(presses)} presses; give {objects} or more")
    device, facts = begin(options, f"{len(training)} presses of fingers on a capacitive array")
    rounds = options.trials or (1 if options.quick else ROUNDS)
    documents: Json = {}
    with tempfile.TemporaryDirectory() as name:
        learning = Learning(device, training, pathlib.Path(name), quick=options.quick)
        for regime, presses in tried.items():
            people = sorted({press.person for press in presses})
            if regime == "held_out":  # nobody of presses.npz is among them
                learned = dict.fromkeys(people, learning.without(frozenset()))
            else:
                learned = {person: learning.without(frozenset({person})) for person in people}
            scores, example = recognise(device, presses, learned, rounds, objects)
            print(f"\npeople of {'held_out.npz' if regime == 'held_out' else 'presses.npz, in turn'}:")
            documents[regime] = results(scores, learned)
    # Figures are those of held-out people, where there are any.
    last = documents.popitem()[1]
    write(options.json, facts | last | documents)
    charts.save({"capcontact": draw_errors(scores)}, options.plots)
    if options.plots and example:
        write(pathlib.Path(options.plots, "capcontact_press.png"), draw_press(example))


if __name__ == "__main__":
    main(program)
