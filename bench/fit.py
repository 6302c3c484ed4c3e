"""How well touches of learned letters and of shapes never learned fit."""

from dataclasses import replace

import palpate
from palpate._tables import Column, Table, column, number, plain

from .measures import share_record, told_apart, with_interval
from .program import Json, begin, main, parser, write
from .trials import (
    MISFITS,
    VOWELS,
    Bins,
    Touching,
    letter_maps,
    make_trials,
    recognized,
    training_recordings,
)

SEEDS = {"learned": 200_000_000, "never learned": 300_000_000}
SHAPES = {"learned": VOWELS, "never learned": MISFITS}
TOUCHES = (1, 3, 5, 9, 15)

EXACT = Touching(at_random_poses=True)
#: What touches the unknowns, and how finely they are recognised.
SETTINGS: tuple[tuple[str, Bins, Touching], ...] = (
    ("6x6 array", (25, 25, 72), EXACT),
    ("16x16 array", (25, 25, 72), replace(EXACT, elements_mm=palpate.grid_array(16, 16, 1.9))),
    ("6x6 array, 25x25x16 bins", (25, 25, 16), EXACT),
    ("6x6 array off by 0.5 mm, 0.025 rad", (25, 25, 72), replace(EXACT, noise=(0.5, 0.025))),
    ("6x6 array off by 1 mm, 0.05 rad", (25, 25, 72), replace(EXACT, noise=(1.0, 0.05))),
)

_PERCENT = with_interval(".1f", 100.0)
FITS: list[Column] = [
    ("array", "name", plain),
    ("touches", "touches", plain),
    ("pairs told apart, %", "told_apart", _PERCENT),
    *(
        (f"{who}: {verdict}, %", f"{who}/{verdict}", _PERCENT)
        for who in SHAPES
        for verdict in ("fits", "doubtful", "does not fit")
    ),
    ("learned: mean z", "learned/mean_z", number(".2f")),
    ("standard deviation", "learned/sd_z", number(".2f")),
    ("lowest", "learned/least_z", number(".1f")),
]


def fits_of(steps: list[Json]) -> Json:
    """The fits of unknowns after some number of touches: z, and the share of each verdict.

    Of the unknowns that a touch was in contact with.
    """
    steps = [step for step in steps if "fit" in step]
    z, verdicts = column(steps, "fit/z"), [step["fit"]["verdict"] for step in steps]
    shares = {
        verdict: share_record(verdicts.count(verdict), len(steps))
        for verdict in ("fits", "doubtful", "does not fit")
    }
    some = {"mean_z": float(z.mean()), "least_z": float(z.min()), "sd_z": float(z.std())}
    return {"z": z.tolist()} | shares | some


def program() -> None:
    """The histogram over the vowels, learned with the same array, after rising numbers of touches."""
    flags = parser(
        "fit",
        "Measures how well touches of learned letters and of shapes never learned fit, in some minutes "
        "on two CPU cores: pairs told apart and verdicts, of arrays of 6 x 6 and 16 x 16 elements.",
        trials="trials per letter and shape [20, or 2 with --quick]",
    )
    options = flags.parse_args()
    each = options.trials or (2 if options.quick else 20)
    device, facts = begin(options)
    fits = Table(FITS)
    for name, usual, touching in SETTINGS[: 2 if options.quick else None]:  # the two arrays
        bins = (13, 13, 55) if options.quick else usual
        training = training_recordings(touching)
        maps = letter_maps(device, [one[::3] for one in training] if options.quick else training)
        traces = {}
        for who, shapes in SHAPES.items():
            trials = make_trials(shapes, each, max(TOUCHES), SEEDS[who], touching)
            traces[who] = recognized(device, maps, trials, bins=bins, filter="bounded")
        for touches in TOUCHES:
            record: Json = {"name": name, "touches": touches, "unknowns": each}
            record |= {who: fits_of([of[touches - 1] for of in all_of]) for who, all_of in traces.items()}
            record["told_apart"] = told_apart(record["never learned"]["z"], record["learned"]["z"])
            fits.append(record)
    write(options.json, facts | {"fits": fits})


if __name__ == "__main__":
    main(program)
