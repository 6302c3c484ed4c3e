"""Everyday objects pressed at unknown poses: which is it, after one press and after several?"""

import tempfile
from collections.abc import Sequence
from typing import Any

import numpy

import palpate
from palpate._tables import Column, Table, number, plain

from .bounded import CLASSIFIER, pitch_of, read_presses
from .measures import share_record, with_interval
from .program import Json, begin, main, parser, write

SEED = 800_000_000
# Where an object may lie about the place where its map was learned, and how fine that is told apart: bins
# of one pitch, 10 degrees. All are evaluated: of presses that fit nowhere well, bounds rule out few bins.
REACH, TURNS = 14, 36  # pitches, bins of a full turn
TOGETHER = (1, 2, 3, 5)
LEAST = 1e-30  # probability that a label counts with

COLUMNS: list[Column] = [
    ("sensor", "sensor", plain),
    ("presses", "presses", plain),
    ("unknowns", "unknowns", plain),
    ("recognised, %", "recognised", with_interval(".1f", 100.0)),
    ("log-loss", "log_loss", number(".3f")),
]


def together(records: Sequence[Json]) -> dict[str, float]:
    """What presses of one object say of its label: each lies at a pose of its own."""
    labels = list(records[0]["identity"])
    logs = numpy.log([[max(record["identity"][label], LEAST) for label in labels] for record in records]).sum(
        axis=0
    )
    p = numpy.exp(logs - logs.max())
    return dict(zip(labels, (p / p.sum()).tolist(), strict=True))


def region_of(pitch_mm: float) -> Any:
    """Where an object may lie, as recognize() takes it, on bins of one pitch."""
    widest_mm = (REACH + 0.5) * pitch_mm
    bins = (2 * REACH + 1, 2 * REACH + 1, TURNS)
    return {"x_mm": (-widest_mm, widest_mm), "y_mm": (-widest_mm, widest_mm), "bins": bins}


def scores(records: Sequence[Json], presses: int, random: numpy.random.Generator) -> Json:
    """Scores of as many unknowns as there are presses: each with others of its object, drawn without
    replacement."""
    of_label: dict[str, list[Json]] = {}
    for record in records:
        of_label.setdefault(record["truth"]["object"], []).append(record)
    right, losses = 0, []
    for label, own in of_label.items():
        for i, record in enumerate(own):
            others = random.permutation([k for k in range(len(own)) if k != i])[: presses - 1]
            identity = together([record, *(own[k] for k in others)])
            right += max(identity, key=identity.__getitem__) == label
            losses.append(-float(numpy.log(max(identity[label], LEAST))))
    return {
        "presses": presses,
        "unknowns": len(losses),
        "recognised": share_record(right, len(losses)),
        "log_loss": float(numpy.mean(losses)),
    }


def program() -> None:
    """Odd presses are learned from, even ones are recognised, with the commands' defaults."""
    flags = parser(
        "presses",
        "Recognises objects pressed at unknown poses, from recordings of presses, one for each object: "
        "every second press is learned from, the others are recognised, by Eq. 7 and by the sensor that "
        "`palpate map` learns.",
    )
    flags.add_argument("--data", metavar="FOLDER", required=True, help="recordings of presses")
    options = flags.parse_args()
    recordings = read_presses(options.data)
    if options.quick:
        recordings = [one[:20] for one in recordings[:3]]
    device, facts = begin(options, f"{len(recordings)} objects, pressed at unknown poses")
    for recording in recordings:
        recording.truth = palpate.Truth(recording.object, (0.0, 0.0, 0.0))
    learned, tried = ([recording[start::2] for recording in recordings] for start in (0, 1))
    document: Json = {}
    rows: list[Json] = []
    region = region_of(pitch_of(recordings[0].elements_mm))
    raw = recordings[0].pressure_unit == "raw"
    contact = {"threshold": CLASSIFIER.threshold, "ratio": CLASSIFIER.ratio} if raw else {}
    models: Any = (("eq7", "Eq. 7", {**contact, "sensor_model": "none"}), ("learned", "learned", {}))
    for key, words, model in models:
        with tempfile.TemporaryDirectory() as maps:
            palpate.learn_maps(learned, maps, unposed=True, **model)
            records = palpate.recognize(
                tried, maps, each_frame=True, none=0.0, filter="histogram", device=device, **region, **model
            )
        random = numpy.random.default_rng(SEED)
        of_sensor = [scores(records, presses, random) for presses in TOGETHER]
        document[key] = {"presses": {str(one["presses"]): one for one in of_sensor}}
        rows += [{"sensor": words} | one for one in of_sensor]
    Table(COLUMNS, rows)
    write(options.json, facts | document)


if __name__ == "__main__":
    main(program)
