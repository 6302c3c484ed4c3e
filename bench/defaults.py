"""What recognition gains by the sensor that `palpate map` learns, beside Eq. 7 on the same maps."""

import json
import pathlib
import tempfile
from collections.abc import Iterable

import numpy

import palpate
from palpate._tables import Column, number, plain, print_table

from .measures import share_record, with_interval
from .program import Json, begin, main, parser, run_palpate, write
from .trials import Touching, make_trials

SEED = 500_000_000
TOUCHES = (1, 3, 9)
#: What is learned, and what is not.
SCENES = {
    "letters": (("A", "E", "U"), ("I", "O")),
    "other shapes": (("T", "L", "ring"), ("X", "bar")),
}
#: Flags of the two models.
FLAGS = {"Eq. 7": ["--sensor-model", "none"], "learned": []}

_PERCENT = with_interval(".1f", 100.0)
DEFAULTS: list[Column] = [
    ("learned", "scene", plain),
    ("touches", "touches", plain),
    ("sensor", "sensor", plain),
    ("recognised, %", "right", _PERCENT),
    ("median error, mm", "median_mm", number(".2f")),
    ("mean", "mean_mm", number(".2f")),
    ("strangers that do not fit, %", "unfit", _PERCENT),
]


def learn(command: str, recordings: Iterable[palpate.Recording], folder: pathlib.Path) -> str:
    """What `palpate map` says of recordings, of which it makes `folder`/maps with the learned sensor."""
    files = []
    for recording in recordings:
        files.append(str(folder / f"{recording.object}.h5"))
        recording.save(files[-1])
    return run_palpate(command, "map", *files, "-o", f"{folder}/maps/")


def scores_of(known: list[Json], strangers: list[Json]) -> Json:
    """The scores of what was believed after some number of touches."""
    errors = [step["refined_error_mm"] for step in known if step["refined_error_mm"] is not None]
    verdicts = [step.get("fit", {}).get("verdict") for step in strangers]
    return {
        "right": share_record(sum(step["right"] for step in known), len(known)),
        "median_mm": float(numpy.median(errors)),
        "mean_mm": float(numpy.mean(errors)),
        "unfit": share_record(verdicts.count("does not fit"), len(verdicts)),
    }


def program() -> None:
    """Objects of 192 touches, recognised by the command with its defaults and with --sensor-model none."""
    flags = parser(
        "defaults",
        "Compares recognition by the sensor that `palpate map` learns with Eq. 7, in some minutes on two "
        "CPU cores.",
        trials="unknowns per object [20, or 2 with --quick]",
    )
    flags.add_argument("--palpate", default="build/palpate", help="the command [%(default)s]")
    options = flags.parse_args()
    _, facts = begin(options)
    each = options.trials or (2 if options.quick else 20)
    rows: list[Json] = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene, (learned, strangers) in SCENES.items():
            (folder / scene).mkdir()
            recordings = [palpate.simulate(shape, seed=seed) for seed, shape in enumerate(learned, start=1)]
            print(learn(options.palpate, recordings, folder / scene).splitlines()[-2])
            maps = f"{folder}/{scene}/maps/"
            trials = make_trials(
                [*learned, *strangers], each, max(TOUCHES), SEED, Touching(at_random_poses=True)
            )
            unknowns = []
            for i, trial in enumerate(trials):
                unknowns.append(str(folder / f"unknown.{i}.h5"))
                trial.save(unknowns[-1])
            result = folder / "records.json"
            steps = {}
            for sensor, model in FLAGS.items():
                recognize = ["recognize", *unknowns, "--maps", maps, "--trace", "--json", str(result)]
                run_palpate(options.palpate, *recognize, *model)
                steps[sensor] = [record["trace"] for record in json.loads(result.read_text())]
            known = each * len(learned)
            for touches in TOUCHES:
                for sensor, of_all in steps.items():
                    after = [trace[touches - 1] for trace in of_all]
                    scores = scores_of(after[:known], after[known:])
                    rows.append({"scene": scene, "touches": touches, "sensor": sensor} | scores)
    print_table(DEFAULTS, rows)
    write(options.json, facts | {"defaults": rows})


if __name__ == "__main__":
    main(program)
