"""How well touches of learned letters and of shapes never learned fit."""

import argparse
from dataclasses import replace
from typing import Any

import palpate

from .measures import told_apart
from .report import Json, Measurement, Report, Run, main, parser, share_of, write_json
from .trials import MISFITS, VOWELS, Touching, letter_maps, make_trials, training_recordings

LEARNED_SEED = 200_000_000
UNLEARNED_SEED = 300_000_000
TOUCHES = (1, 3, 5, 9)
VERDICTS = ("fits", "doubtful", "does not fit")

EXACT = Touching(at_random_poses=True)
#: What touches the unknowns, and how finely they are recognised.
SETTINGS: tuple[tuple[str, tuple[int, int, int], Touching], ...] = (
    ("6x6 array", (25, 25, 72), EXACT),
    ("16x16 array", (25, 25, 72), replace(EXACT, elements_mm=palpate.grid_array(16, 16, 1.9))),
    ("6x6 array, 25x25x16 bins", (25, 25, 16), EXACT),
    ("6x6 array off by 0.5 mm, 0.025 rad", (25, 25, 72), replace(EXACT, noise=(0.5, 0.025))),
    ("6x6 array off by 1 mm, 0.05 rad", (25, 25, 72), replace(EXACT, noise=(1.0, 0.05))),
)


def add_fits(report: Report, name: str, fits: dict[str, list[Any]]) -> Json:
    """The fits of learned and unlearned unknowns after a number of touches, {"z", "verdict"} each."""
    z = {who: [fit["z"] for fit in of] for who, of in fits.items()}
    learned, unlearned = z["learned"], z["never learned"]
    apart, (low, high) = told_apart(unlearned, learned)
    name_of, interval = "unlearned fit worse than learned", (100.0 * low, 100.0 * high)
    rows = [Measurement(name_of, 100.0 * apart, "% of pairs", interval=interval)]
    for who, of in fits.items():
        for verdict in VERDICTS:
            count = sum(fit["verdict"] == verdict for fit in of)
            rows.append(share_of(f"{who}: {verdict}", count, len(of)))
    report.add(name, {who: len(of) for who, of in fits.items()}, rows)
    return {"name": name, "learned_z": learned, "unlearned_z": unlearned}


def measure(run: Run, options: argparse.Namespace) -> Json:
    """The histogram over the vowels, learned with the same array, after rising numbers of touches."""
    each = options.trials or (2 if options.quick else 20)
    report = Report(run.facts)
    fits = []
    for name, usual, touching in SETTINGS[: 2 if options.quick else None]:  # the two arrays
        bins = (13, 13, 55) if options.quick else usual
        maps = letter_maps(run.device, training_recordings(touching))
        traces: dict[str, list[Any]] = {}
        for who, shapes, seed in (
            ("learned", VOWELS, LEARNED_SEED),
            ("never learned", MISFITS, UNLEARNED_SEED),
        ):
            trials = make_trials(shapes, each, max(TOUCHES), seed, touching)
            records = palpate.recognize(
                trials, maps, bins=bins, x_mm=(-10, 10), y_mm=(-10, 10), pivot_mm=(0, 0),
                filter="histogram", trace=True, device=run.device,
            )  # fmt: skip
            traces[who] = [record["trace"] for record in records]
        for touches in TOUCHES:
            after = {who: [trace[touches - 1]["fit"] for trace in of] for who, of in traces.items()}
            fits.append(add_fits(report, f"{name}, touch {touches}", after))
    return report.document() | {"fits": fits}


def program() -> None:
    """Reads the flags and measures."""
    flags = parser(
        "fit",
        "Measures how well touches of learned letters and of shapes never learned fit, in some minutes "
        "on two CPU cores: pairs told apart and verdicts, of arrays of 6 x 6 and 16 x 16 elements.",
        trials="trials per letter and shape [20, or 2 with --quick]",
    )
    options = flags.parse_args()
    write_json(options.json, measure(Run(options), options))


if __name__ == "__main__":
    main(program)
