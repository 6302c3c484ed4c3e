"""How often the regions that a belief calls 68 and 95 % probable hold the truth, over all its modes."""

import math
import pathlib
import tempfile
from collections.abc import Sequence

import numpy

import palpate
from palpate._tables import Column, Table, plain, print_table

from .defaults import learn
from .measures import level_in_modes, share_record, with_interval
from .program import Json, begin, main, parser, write
from .trials import VOWELS, Floats, Touching, make_trials, training_recordings, truth_of

SEED = 400_000_000
LETTERS = ("A", "E", "U")
TOUCHES, QUICK_TOUCHES = (1, 3, 5, 9), (1, 5)
SHARES = (0.68, 0.95)
MODELS: dict[str, str | None] = {"Eq. 7": "none", "learned": None}  # of recognize()
SAMPLES = 4_000  # of a mixture of modes: standard error of a level at most 0.008
MISPLACED = (1.0, 0.05)  # standard deviations, mm and rad
UNTOLD = (0.5, 0.02)

_PERCENT = with_interval(".1f", 100.0)
COLUMNS: list[Column] = [
    ("sensor", "sensor", plain),
    ("touches", "touches", plain),
    ("unknowns", "unknowns", plain),
    *((f"{100 * share:.0f} % region holds, %", f"{share}", _PERCENT) for share in SHARES),
]
DECISIONS: list[Column] = [
    ("sensor", "sensor", plain),
    ("touches", "touches", plain),
    ("acts, %", "acts", _PERCENT),
    ("acted and right, %", "right", _PERCENT),
    ("acted and within 0.5 mm, %", "within", _PERCENT),
]


def covered(levels: Sequence[float]) -> Json:
    """How often the truth lies within the region of each share."""
    return {
        f"{share}": share_record(sum(level < share for level in levels), len(levels))
        for share in SHARES
    }


def program() -> None:
    """Letters by Eq. 7 and by the sensor that `palpate map` learns with their maps, from exact touches."""
    flags = parser(
        "coverage",
        "Measures how often the 68 and 95 % regions of the belief, over all its modes, hold the truth, and "
        "how right decisions are, in some minutes on two CPU cores for each training set.",
        trials="unknowns per letter and training set [34, or 2 with --quick]",
    )
    flags.add_argument(
        "--sets", type=int, default=1, help="training sets, each with unknowns of its own [%(default)s]"
    )
    flags.add_argument("--misplaced", action="store_true", help="touches are 1 mm and 0.05 rad off")
    flags.add_argument(
        "--untold", action="store_true",
        help="touches of unknowns are 0.5 mm and 0.02 rad off, which nobody says",
    )  # fmt: skip
    flags.add_argument(
        "--equal-gains", action="store_true", help="all sensors' elements have the gain 1"
    )
    flags.add_argument("--palpate", default="build/palpate", help="the command [%(default)s]")
    options = flags.parse_args()
    device, facts = begin(options)
    sensor = palpate.SensorModel(gain_spread=0.0) if options.equal_gains else palpate.SensorModel()
    sd_mm, sd_rad = MISPLACED if options.misplaced else (0.0, 0.0)
    touching = Touching(sensor=sensor, at_random_poses=True, noise=(sd_mm, sd_rad))
    every = 5 if options.quick else 1
    each = options.trials or (2 if options.quick else 34)
    counts = QUICK_TOUCHES if options.quick else TOUCHES
    # Each unknown is touched by a sensor of its own, whose gains all of its touches share, and so is
    # each letter that is learned.
    touched = Touching(sensor=sensor, at_random_poses=True, noise=UNTOLD) if options.untold else touching
    trials = make_trials(LETTERS * each * options.sets, 1, max(counts), SEED, touched)
    in_set = len(LETTERS) * each
    records: dict[str, list[Json]] = {name: [] for name in MODELS}
    for index in range(options.sets):
        training = training_recordings(touching, first_seed=1 + index * len(VOWELS))
        with tempfile.TemporaryDirectory() as folder:
            known = [r[::every] for r in training if r.object in LETTERS]
            learn(options.palpate, known, pathlib.Path(folder))
            unknowns = trials[index * in_set : (index + 1) * in_set]
            for name, model in MODELS.items():
                # Nobody is a stranger: what "(none)" has would count against every region.
                records[name] += palpate.recognize(
                    unknowns, f"{folder}/maps", trace=True, device=device, sensor_model=model, none=0.0,
                    touch_sd_mm=sd_mm, touch_sd_deg=math.degrees(sd_rad),
                )  # fmt: skip
    random = numpy.random.default_rng(SEED)
    coverage, decisions = Table(COLUMNS), []
    for name in MODELS:
        for touches in counts:
            steps = [record["trace"][touches - 1] for record in records[name]]
            row: Json = {"sensor": name, "touches": touches, "unknowns": len(trials)}
            levels = [
                level_in_modes(step["modes"], truth_of(trial), random)
                for step, trial in zip(steps, trials, strict=True)
            ]
            coverage.append(row | covered(levels))
            acted = [step for step in steps if step["decision"]["act"]]
            errors = [step["refined_error_mm"] for step in acted if step["right"]]
            within = sum(error is not None and error <= 0.5 for error in errors)
            decisions.append(
                row
                | {"acts": share_record(len(acted), len(steps))}
                | {"right": share_record(len(errors), max(len(acted), 1))}
                | {"within": share_record(within, max(len(acted), 1))}
            )
    print_table(DECISIONS, decisions)
    facts |= {"gain_spread": sensor.gain_spread, "training_sets": options.sets}
    write(options.json, facts | {"coverage": coverage, "decisions": decisions})


if __name__ == "__main__":
    main(program)
