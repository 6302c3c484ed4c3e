"""How often "(none)" is the answer for objects that nobody learned: outlines drawn at random."""

import math
import pathlib
import tempfile
from collections.abc import Callable

import numpy

import palpate
from palpate._tables import Column, Table, plain

from .coverage import MODELS
from .defaults import learn
from .measures import share_record, with_interval
from .program import begin, main, parser, write
from .trials import VOWELS, Floats, Touching, make_trials, training_recordings

OUTLINE_SEED = 800_000_000
STRANGER_SEED = 810_000_000
LEARNED_SEED = 820_000_000
TOUCHES, QUICK_TOUCHES = (1, 3, 5, 9, 15), (5,)

_PERCENT = with_interval(".1f", 100.0)
STRANGERS: list[Column] = [
    ("sensor", "sensor", plain),
    ("touches", "touches", plain),
    ("learned called none, %", "learned_called_none", _PERCENT),
    ("strangers called none, %", "strangers_called_none", _PERCENT),
    ("strangers that do not fit, %", "unfit", _PERCENT),
]


def on_rays(angles: Floats, radii: Floats) -> Floats:
    """Points [n, 2] at the radii, in mm, along the angles."""
    return numpy.stack([radii * numpy.cos(angles), radii * numpy.sin(angles)], axis=1)


def round_outline(random: numpy.random.Generator) -> Floats:
    """A closed curve, 7 to 11 mm from its middle, by five waves around it."""
    angles = numpy.linspace(0.0, 2.0 * math.pi, 120, endpoint=False, dtype=numpy.float64)
    radii = numpy.ones(len(angles))
    for wave in range(2, 7):
        height = random.normal(0.0, 0.35 / (wave - 1) ** 0.7)
        radii += height * numpy.cos(wave * angles + random.uniform(0.0, 2.0 * math.pi))
    return on_rays(angles, random.uniform(7.0, 11.0) * radii.clip(0.3, 2.2))


def angular_outline(random: numpy.random.Generator) -> Floats:
    """A polygon of three to eight corners, 4 to 15 mm from a point within or beside it."""
    corners = random.integers(3, 9)
    angles = numpy.sort(random.uniform(0.0, 2.0 * math.pi, corners))
    outline = on_rays(angles, random.uniform(4.0, 15.0, corners))
    outline -= outline.mean(axis=0)
    return outline


def bent_outline(random: numpy.random.Generator) -> Floats:
    """A bar 4 to 6 mm wide, bent once or twice by 34 to 103 degrees."""
    parts = random.integers(2, 4)
    turns = random.choice([-1.0, 1.0], parts) * random.uniform(0.6, 1.8, parts)
    angles = random.uniform(0.0, 2.0 * math.pi) + numpy.cumsum(turns)
    steps = on_rays(angles, random.uniform(8.0, 18.0, parts))
    middle = numpy.vstack([numpy.zeros(2), numpy.cumsum(steps, axis=0)])
    normals = on_rays(angles + 0.5 * math.pi, numpy.ones(parts))
    # At a bend both sides of the bar meet on the bisector.
    sums = normals[:-1] + normals[1:]
    bends = 2.0 * sums / (sums**2).sum(axis=1, keepdims=True)
    sides = random.uniform(2.0, 3.0) * numpy.vstack([normals[:1], bends, normals[-1:]])
    outline = numpy.vstack([middle + sides, (middle - sides)[::-1]])
    outline -= outline.mean(axis=0)
    return outline


KINDS: tuple[Callable[[numpy.random.Generator], Floats], ...] = (
    round_outline, angular_outline, bent_outline,
)  # fmt: skip


def program() -> None:
    """Letters and strangers by Eq. 7 and by the sensor that `palpate map` learns, from exact touches."""
    flags = parser(
        "strangers",
        "Measures how often objects that nobody learned are called (none), and learned ones, with the "
        "command's defaults, in some ten minutes on two CPU cores.",
        trials="strangers, each a shape of its own, and unknown letters [200, or 3 with --quick]",
    )
    flags.add_argument("--palpate", default="build/palpate", help="the command [%(default)s]")
    options = flags.parse_args()
    device, facts = begin(options)
    count = options.trials or (3 if options.quick else 200)
    random = numpy.random.default_rng(OUTLINE_SEED)
    touching = Touching(at_random_poses=True)
    table = Table(STRANGERS)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        every = 5 if options.quick else 1
        learn(options.palpate, [r[::every] for r in training_recordings()], folder)
        shapes = []
        for i in range(count):
            shapes.append(str(folder / f"stranger.{i}.txt"))
            numpy.savetxt(shapes[-1], KINDS[i % len(KINDS)](random), "%.4f")
        strangers = make_trials(shapes, 1, max(TOUCHES), STRANGER_SEED, touching)
        letters = [VOWELS[i % len(VOWELS)] for i in range(count)]
        learned = make_trials(letters, 1, max(TOUCHES), LEARNED_SEED, touching)
        for sensor, model in MODELS.items():
            for touches in QUICK_TOUCHES if options.quick else TOUCHES:
                trials = [trial[:touches] for trial in [*learned, *strangers]]
                records = palpate.recognize(
                    trials, f"{folder}/maps", device=device, sensor_model=model
                )
                none = [record["best"] == "(none)" for record in records]
                verdicts = [record.get("fit", {}).get("verdict") for record in records[count:]]
                table.append(
                    {
                        "sensor": sensor,
                        "touches": touches,
                        "learned_called_none": share_record(sum(none[:count]), count),
                        "strangers_called_none": share_record(sum(none[count:]), count),
                        "unfit": share_record(verdicts.count("does not fit"), count),
                    }
                )
    write(options.json, facts | {"strangers": table})


if __name__ == "__main__":
    main(program)
