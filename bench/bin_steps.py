"""The refined pose's error against the step of the bins, by which `--bins auto` was chosen."""

import math

import numpy

import palpate
from palpate._statistics import errors_over
from palpate._sweep_runs import counts_of
from palpate._tables import (
    Column,
    Table,
    count_text,
    difference_text,
    mean_text,
    number,
    plain,
)

from .measures import differences
from .program import begin, main, parser, write
from .trials import VOWELS, Touching, letter_maps, make_trials

SEED = 70_000  # unknowns of their own: the sweep's and the experiment's chose other constants
REACH_MM = 3.0  # from the truth: poses farther away are at another peak

COLUMNS: list[Column] = [
    ("map cells, mm", "cell_mm", plain),
    ("step, mm", "step_mm", plain),
    ("bins per object", "bins", plain),
    ("", "count", count_text),
    ("touches", "touches", plain),
    ("unknowns", "refined_error_mm/trials", plain),
    ("refined: mean error, mm", "refined_error_mm", mean_text),
    ("median, mm", "refined_error_mm/median", number(".3f")),
    ("over the finest, %", "excess", number("+.1f", 100.0)),
    ("difference, mm", "difference_mm", difference_text),
]


def near(error_mm: float | None) -> float | None:
    """The error, unless it is that of another peak of the belief, which no step mends."""
    return error_mm if error_mm is not None and error_mm <= REACH_MM else None


def in_steps(
    region: palpate.PoseLattice, maps: list[palpate.OccupancyGrid], step_mm: float
) -> palpate.PoseLattice:
    """The region in steps of at most this length; in theta, of what moves an object as far."""
    fine = palpate.balanced_lattice(region, maps, "fine", 10**15)
    fine_step_mm = 0.6 * max(maps[0].cell_mm, maps[0].spread_mm or 0.0)
    return palpate.PoseLattice(
        *(
            (axis.lower, axis.upper, math.ceil(axis.count * fine_step_mm / step_mm))
            for axis in (fine.x_mm, fine.y_mm, fine.theta_rad)
        )
    )


def program() -> None:
    """Prints every run once it is known; the finest step is what the others are compared with."""
    flags = parser(
        "bin-steps",
        "Measures the refined pose's error against the step of the bins, after 3, 5 and 9 touches at "
        "random poses, by bounds, in some ten minutes on two CPU cores.",
        trials="trials per letter [20, or 1 with --quick]",
    )
    options = flags.parse_args()
    device, facts = begin(options)
    cells_mm, touches, steps_mm = [0.5, 1.0], [9, 5, 3], [0.3, 0.45, 0.6, 0.75, 0.9, 1.2]
    if options.quick:
        cells_mm, touches, steps_mm = [0.5], [5], [0.3, 0.6]
    each = options.trials or (1 if options.quick else 20)
    trials = make_trials(VOWELS, each, max(touches), SEED, Touching(at_random_poses=True))
    reach_mm = float(numpy.hypot(*trials[0].elements_mm.T).max())
    runs = Table(COLUMNS)
    for cell_mm in cells_mm:
        maps = letter_maps(device, cell_mm=cell_mm)
        lattices = [in_steps(palpate.touch_region(maps, reach_mm), maps, mm) for mm in steps_mm]
        for count in touches:
            finest: list[float | None] = []
            for step_mm, lattice in zip(steps_mm, lattices, strict=True):
                x, y = ((axis.lower, axis.upper) for axis in (lattice.x_mm, lattice.y_mm))
                records = palpate.recognize(
                    [trial[:count] for trial in trials], maps, bins=counts_of(lattice), x_mm=x, y_mm=y,
                    pivot_mm="auto", filter="bounded", none=0.0, device=device,
                )  # fmt: skip
                errors = [near(record.get("refined_error_mm")) for record in records]
                paired = differences(errors, finest or errors)
                assert paired is not None
                runs.append(
                    {
                        "cell_mm": cell_mm,
                        "step_mm": step_mm,
                        "bins": list(counts_of(lattice)),
                        "count": lattice.bins,
                        "touches": count,
                        "refined_error_mm": errors_over(errors, 20),
                        "excess": paired["to"] / paired["from"] - 1.0,
                        "difference_mm": paired if finest else None,
                    }
                )
                finest = finest or errors
    write(options.json, facts | {"runs": runs})


if __name__ == "__main__":
    main(program)
