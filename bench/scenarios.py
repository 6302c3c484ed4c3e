"""What `accuracy` tries: which objects are learned, what touches the unknowns, and what recognises them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy

import palpate
from palpate._palpate import Random, Stream

from .program import Json
from .trials import MISFITS, VOWELS, Floats, Touching, make_trials, truth_of

Sd = tuple[float, float]  # standard deviations in mm and rad
PLANNED = "planned"  # of an engine: each touch is where most is expected of it

OUTLINE_SEED = 800_000_000
AT_RANDOM = Touching(at_random_poses=True)


def off_by(mm: float, rad: float) -> Touching:
    """Touches at random poses, off by these standard deviations."""
    return Touching(at_random_poses=True, noise=(mm, rad))


def with_touch_sd(mm: float, rad: float) -> Json:
    """Recognition that knows how far touches are off."""
    return {"touch_sd_mm": mm, "touch_sd_deg": math.degrees(rad)}


def on_bins(*bins: int, extent_mm: float = 10.0, engine: str = "histogram") -> Json:
    """Bins over an extent about 0 along x and y, and over the full circle."""
    reach = (-extent_mm, extent_mm)
    return {"bins": bins, "x_mm": reach, "y_mm": reach, "pivot_mm": (0.0, 0.0), "filter": engine}


@dataclass(frozen=True)
class Scenario:
    """Unknowns of one kind, and the engines that recognise them by the same maps and touches."""

    about: str
    columns: tuple[str, ...]  #: groups of columns that are shown
    engines: dict[str, Json]  #: by name
    seed: int
    each: int  #: unknowns of every object that was learned
    learned: tuple[str, ...] = VOWELS
    strangers: tuple[str, ...] = ()
    each_stranger: int = 20
    outlines: bool = False  #: strangers are outlines drawn at random, as many as there are other unknowns
    stranger_seed: int = 0
    after: tuple[int | tuple[int, int], ...] = (1, 3, 5, 9)  #: touches; or the mean over a range of them
    touching: Touching = AT_RANDOM  #: its array and sensor are those that learned, too
    own_gains: bool = False  #: each unknown is touched by a sensor of its own
    slip_sd: Sd = (0.0, 0.0)  #: of the object, between two touches
    within_mm: float = math.inf  #: errors beyond are of another peak of the belief, and left out
    options: Json = field(default_factory=dict)  #: of all engines

    @property
    def touches(self) -> int:
        """So many touches of each unknown are recognised."""
        return max(of if isinstance(of, int) else of[1] for of in self.after)

    @property
    def learns(self) -> bool:
        """Whether an engine takes the sensor that `palpate map` learns."""
        return any("sensor_model" not in self.options | of for of in self.engines.values())

    def quick(self) -> "Scenario":
        """One unknown of each object, at most five touches of it, and half as many bins along each axis."""

        def wider(options: Json) -> Json:
            bins = options.get("bins")
            return options | {"bins": tuple(n // 2 for n in bins)} if isinstance(bins, tuple) else options

        return replace(
            self,
            each=1,
            each_stranger=1,
            after=tuple(of for of in self.after if isinstance(of, int) and of <= 5) or ((1, 5),),
            engines={name: wider(options) for name, options in self.engines.items()},
            options=wider(self.options),
        )


EQ7: Json = {"sensor_model": "none"}
MODELS: dict[str, Json] = {"Eq. 7": EQ7, "learned": {}}
NO_NONE: Json = {"none": 0.0}
EVEN_NONE: Json = {"none": float(len(VOWELS))}  # as likely before the first touch as all letters together

_GAINS: Any = dict(
    columns=("identity", "pose", "regions"), learned=("A", "E", "U"), own_gains=True, seed=400_000_000, each=34,
    options=NO_NONE,
)  # fmt: skip
_DEFAULTS: Any = dict(
    columns=("identity", "pose", "strangers"), engines=MODELS, after=(1, 3, 9), seed=500_000_000,
    stranger_seed=503_000_000, each=20,
)  # fmt: skip
_FIT: Any = dict(
    columns=("fit", "strangers"), strangers=MISFITS, after=(1, 3, 5, 9, 15), seed=200_000_000,
    stranger_seed=300_000_000, each=20,
)  # fmt: skip
_BINS = {"Eq. 7": EQ7 | NO_NONE | on_bins(25, 25, 72, engine="bounded")}
_MISPLACED: Any = dict(
    columns=("identity", "pose", "covariance"), after=(3, 5, 9, 12), seed=500_000_000, each=40,
    options=EQ7 | NO_NONE | on_bins(30, 30, 113),
)  # fmt: skip
_NONE: Any = dict(
    columns=("none",), strangers=MISFITS, after=(1, 3, 5, 9, 15), seed=600_000_000,
    stranger_seed=700_000_000, each=40,
)  # fmt: skip

SCENARIOS = {
    "letters": Scenario(
        "three letters by the command's defaults", learned=("A", "E", "U"), strangers=("I", "O"), **_DEFAULTS
    ),
    "other-shapes": Scenario(
        "the same of a T, an L and a ring", learned=("T", "L", "ring"), strangers=("X", "bar"), **_DEFAULTS
    ),
    "other-gains": Scenario(
        "unknowns touched by other sensors than the letters were learned with", engines=MODELS, **_GAINS
    ),
    "equal-gains": Scenario(
        "all elements of all sensors alike", engines=MODELS,
        touching=Touching(sensor=palpate.SensorModel(gain_spread=0.0), at_random_poses=True), **_GAINS,
    ),
    "misplaced-told": Scenario(
        "touches 1 mm and 0.05 rad off, which is known", touching=off_by(1.0, 0.05),
        engines={name: model | with_touch_sd(1.0, 0.05) for name, model in MODELS.items()}, **_GAINS,
    ),
    "misplaced-untold": Scenario(
        "touches 0.5 mm and 0.02 rad off, which nobody says", touching=off_by(0.5, 0.02), engines=MODELS,
        **_GAINS,
    ),
    "misplaced-1mm": Scenario(
        "touches 1 mm and 0.05 rad off, as if exact and averaged", touching=off_by(1.0, 0.05),
        engines={"as if exact": {}, "averaged": with_touch_sd(1.0, 0.05)}, **_MISPLACED,
    ),
    "misplaced-2mm": Scenario(
        "the same of 2 mm and 0.1 rad", touching=off_by(2.0, 0.1),
        engines={"as if exact": {}, "averaged": with_touch_sd(2.0, 0.1)}, **_MISPLACED,
    ),
    "fit": Scenario("how well learned letters and other shapes fit", engines=_BINS, **_FIT),
    "fit-16x16": Scenario(
        "the same by a large array", engines=_BINS,
        touching=Touching(palpate.grid_array(16, 16, 1.9), at_random_poses=True), **_FIT,
    ),
    "fit-wide-bins": Scenario(
        "the same on bins wider than maps resolve",
        engines={"Eq. 7": EQ7 | NO_NONE | on_bins(25, 25, 16, engine="bounded")}, **_FIT,
    ),
    "fit-misplaced": Scenario(
        "the same of touches 0.5 mm and 0.025 rad off", engines=_BINS, touching=off_by(0.5, 0.025), **_FIT
    ),
    "none": Scenario(
        "(none) where touches are exact", touching=Touching(), options=EQ7 | EVEN_NONE,
        engines={
            f"within {cm} cm": on_bins(13 * cm, 13 * cm, 55, extent_mm=10.0 * cm) for cm in (1, 2)
        },
        **_NONE,
    ),
    "none-misplaced": Scenario(
        "(none) where touches are 1 mm and 0.05 rad off", touching=off_by(1.0, 0.05),
        options=EQ7 | EVEN_NONE | on_bins(20, 20, 75),
        engines={"as if exact": {}, "averaged": with_touch_sd(1.0, 0.05)}, **_NONE,
    ),
    "strangers": Scenario(
        "outlines drawn at random, by the command's defaults", columns=("none", "strangers"),
        engines=MODELS, after=(1, 3, 5, 9, 15), own_gains=True, seed=820_000_000, each=40, outlines=True,
        stranger_seed=810_000_000,
    ),
    "slipping": Scenario(
        "objects that move by 0.3 mm and 1 degree between touches", columns=("identity", "pose"),
        engines={"without": {}, "with slip_sd": {"slip_sd_mm": 0.3, "slip_sd_deg": 1.0}},
        # Steps of 0.5 mm and 2 degrees resolve such slips.
        options=EQ7 | NO_NONE | on_bins(32, 32, 180, extent_mm=8.0), touching=Touching(),
        slip_sd=(0.3, math.radians(1.0)), after=((1, 50), (26, 50)), seed=800_000_000, each=5,
    ),
    "planned": Scenario(
        "touches where most is expected of them", columns=("identity", "pose"),
        engines={"at random": {}, "planned": {PLANNED: True}}, touching=Touching(),
        options=EQ7 | NO_NONE | on_bins(13, 13, 55), after=(1, 2, 3, 4, 5, 6, 7), seed=950_000_000, each=20,
    ),
    "bin-steps": Scenario(
        "default bins and finer ones; errors of at most 3 mm", columns=("pose",),
        engines={"--bins fine": {"bins": "fine"}, "--bins auto": {}},
        options=EQ7 | NO_NONE | {"filter": "bounded"}, after=(3, 5, 9), seed=70_000, each=20, within_mm=3.0,
    ),
}  # fmt: skip


def trials_of(
    scenario: Scenario, each: int, each_stranger: int, later: int, folder: str
) -> tuple[list[palpate.Recording], list[palpate.Recording]]:
    """Unknowns of learned objects, and strangers, so many of each.

    later: what is added to the seeds. The folder gets the outlines of strangers.
    """
    all_poses = any(PLANNED in engine for engine in scenario.engines.values())
    touches = len(palpate.training_grid()) if all_poses else scenario.touches

    def made(shapes: Sequence[str], number: int, seed: int) -> list[palpate.Recording]:
        own: tuple[Any, int] = (shapes, number)
        if scenario.own_gains:  # as shapes of one trial each
            own = (list(shapes) * number, 1)
        return make_trials(*own, touches, seed + later, scenario.touching)

    known = made(scenario.learned, each, scenario.seed)
    if not scenario.outlines:
        return known, made(scenario.strangers, each_stranger, scenario.stranger_seed)
    random = numpy.random.default_rng(OUTLINE_SEED + later)
    outlines = [f"{folder}/stranger.{i}.txt" for i in range(len(known))]
    for i, path in enumerate(outlines):
        numpy.savetxt(path, KINDS[i % len(KINDS)](random), "%.4f")
    return known, made(outlines, 1, scenario.stranger_seed)


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


def slipping(
    trial: palpate.Recording, centroid_mm: Floats, step: Sd, seed: int
) -> tuple[palpate.Recording, list[Floats]]:
    """A trial whose object takes a step of a random walk before every touch but the first.

    A turn about its centroid and a translation, of these standard deviations. The walk begins at 3/10
    of the trial's distance from the robot frame's origin, within 3 mm along x and y, so that few walks
    of 50 steps of 0.3 mm leave a region of +-8 mm. The readings stay as they are. Returns the touches
    as the robot reports them, and the true T_object_robot [3] at each.
    """
    at_rest = truth_of(trial).T_object_robot
    here = at_rest * (0.3, 0.3, 1.0)
    steps = Random(seed, Stream.object_pose).normals(3 * len(trial)).reshape(-1, 3)
    poses, truths = [], []
    for i in range(len(trial)):
        if i > 0:
            dx, dy, turn = steps[i - 1] * (step[0], step[0], step[1])
            about = centroid_mm - palpate.transform((0.0, 0.0, turn), [centroid_mm])[0]
            here = palpate.compose((dx + about[0], dy + about[1], turn), here)
        on_object = palpate.compose(at_rest, trial.T_robot_sensor[i])
        poses.append(palpate.compose(palpate.inverse(here), on_object))
        truths.append(here)
    return palpate.Recording(trial.pressure, numpy.array(poses), trial.elements_mm), truths
