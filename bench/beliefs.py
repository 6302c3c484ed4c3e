"""How honest beliefs are where touches are misplaced, objects slip, or nobody learned the object."""

import pathlib
from collections.abc import Callable

from palpate import _charts as charts

from . import belief_charts
from .belief_moves import measure_costs, measure_plan, measure_slip
from .belief_touches import Inputs, measure_misplaced, measure_none
from .program import Json, begin, main, parser, write
from .trials import letter_maps

PARTS: dict[str, Callable[[Inputs], list[Json]]] = {
    "misplaced": measure_misplaced,
    "none": measure_none,
    "slip": measure_slip,
    "plan": measure_plan,
    "cost": measure_costs,
}


def program() -> None:
    """Reads the flags and measures."""
    flags = parser(
        "beliefs",
        "Measures how honest beliefs are, in some 40 minutes on two CPU cores: misplaced touches, how "
        "well touches tell how far they are misplaced, objects never learned, objects that slip, planned "
        "touches, and what each costs.",
        plots="draw charts in this folder",
        trials="unknowns per letter and shape [each part's own]",
    )
    flags.add_argument("--part", choices=PARTS, help="measure only this part")
    options = flags.parse_args()
    device, document = begin(options)
    inputs = Inputs(device, letter_maps(device), options.quick, options.trials)
    for part, measure in PARTS.items():
        if options.part in (None, part):
            document[part] = measure(inputs)
            if part in belief_charts.DRAWERS:
                charts.save(belief_charts.DRAWERS[part](document[part]), options.plots)
            if part == "misplaced" and options.plots:
                picture = belief_charts.draw_misplaced_unknown(inputs)
                write(pathlib.Path(options.plots, "misplaced_unknown.png"), picture)
    write(options.json, document)


if __name__ == "__main__":
    main(program)
