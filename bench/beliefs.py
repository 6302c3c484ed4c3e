"""How honest beliefs are where touches are misplaced, objects slip, or nobody learned the object."""

import pathlib
from collections.abc import Callable

from . import belief_charts, charts
from .belief_moves import measure_costs, measure_plan, measure_slip
from .belief_touches import (
    MISPLACED_SEED,
    Inputs,
    measure_misplaced,
    measure_none,
    measure_touch_sd,
)
from .report import Json, Report, Run, main, parser, write, write_json
from .trials import letter_maps

PARTS: dict[str, Callable[[Inputs], list[Json]]] = {
    "misplaced": measure_misplaced,
    "touch-sd": measure_touch_sd,
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
    parts = [options.part] if options.part else list(PARTS)
    names = [name for part in parts for name in belief_charts.FIGURES.get(part, ())]
    pictures = [belief_charts.PICTURE] if "misplaced" in parts else []
    run = Run(options, {"plots": [*charts.files(names), *pictures]})
    inputs = Inputs(
        run.device, letter_maps(run.device), options.quick, options.trials, Report(run.facts)
    )
    records: dict[str, list[Json]] = {}
    for part in parts:
        records[part] = PARTS[part](inputs)
        charts.save(belief_charts.draw(part, records[part]), options.plots)
    if options.plots and pictures:
        picture = belief_charts.draw_misplaced_unknown(run.device, inputs.maps, MISPLACED_SEED)
        write(pathlib.Path(options.plots, belief_charts.PICTURE), picture)
    write_json(options.json, inputs.report.document() | records)


if __name__ == "__main__":
    main(program)
