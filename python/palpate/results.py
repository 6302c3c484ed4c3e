"""What functions return: the JSON of the commands, whose keys are attributes, too."""

from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    import numpy
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from ._palpate import LearnedSensor


def text_of(shown: object) -> str:
    """Class(name=value, ...), by the properties of a class of C++; arrays to three digits, times to ms."""

    def text(value: Any) -> str:
        if hasattr(value, "dtype"):
            import numpy

            return numpy.array2string(value, precision=3, threshold=8, separator=", ")
        return f"{value:.13g}" if isinstance(value, float) else repr(value)

    names = [name for name, of in vars(type(shown)).items() if isinstance(of, property)]
    return f"{type(shown).__name__}({', '.join(f'{name}={text(getattr(shown, name))}' for name in names)})"


class Drawn:
    """What is drawn with Matplotlib."""

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draws this object with Matplotlib, as its class's docstring describes, and returns the axes."""
        from .plots import plot

        return plot(self, ax)


class Fields(dict[str, Any]):
    """A JSON object whose keys are attributes, too; lists of numbers are arrays as attributes."""

    _kinds: ClassVar[dict[str, type["Fields"]]] = {}
    """Classes of objects within, by their keys; others are Fields."""

    def __getattr__(self, name: str) -> Any:
        try:
            value = self[name]
        except KeyError:
            raise AttributeError(f"the record has no '{name}'; it has {', '.join(self)}") from None
        kind = self._kinds.get(name, Fields)
        if type(value) is dict:
            value = self[name] = kind(value)
        elif isinstance(value, list) and value and type(value[0]) is dict:
            value = self[name] = [kind(each) for each in value]
        elif isinstance(value, list) and value and isinstance(value[0], (float, int, list)):
            import numpy

            return numpy.array(value)
        return value

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *(key for key in self if key.isidentifier())})


class Record(Fields, Drawn):
    """What was recognised, as a record in the JSON of `palpate recognize`.

    Keys are attributes, too: record["refined"]["sd"] is a list, record.refined.sd an array.

    `best` is the most probable label, `identity` {label: probability}, `mode` the most probable bin,
    `decision` whether to act, and why: {"act", "because"}, `modes` where the belief lies: a list of
    {"object", "probability", "T_robot_object", "covariance"}, the most probable first, `refined` the
    refined pose, where the posterior peaks to a fraction of a bin, with
    `T_robot_object` [x_mm, y_mm, theta_rad], `sd` and `covariance`, `fit` how well the touches fit
    it: {"z", "verdict"}. Of a recording that recognize_many() could not recognise there are only its
    name, `touches` (0), `truth` and `error`. docs/files.md lists all keys.

    plot(ax=None) draws the object's frame and where x and y lie in 68 and 95 %, in the robot frame, in mm, with
    Matplotlib, and returns the axes.
    """

    def __repr__(self) -> str:
        if "error" in self:
            return f"Record(error: {self['error']})"
        probability = self["identity"][self["best"]]
        pose = self.get("refined", self)["T_robot_object"]
        return (
            f"Record('{self['best']}' with probability {probability:.3f}, T_robot_object "
            f"x {pose[0]:.2f} mm, y {pose[1]:.2f} mm, theta {pose[2]:.3f} rad: "
            f"{'act' if self['decision']['act'] else 'do not act'})"
        )


class Scores(Fields, Drawn):
    """How right, and how honest, a set of records is: `records`, `right`, `accuracy` with its 95 %
    interval `accuracy_interval` [2] (Wilson), `log_loss` in nats, `calibration_error`, and `reliability`,
    ten bins of confidence. docs/files.md explains them with the JSON of `palpate evaluate`. plot(ax=None) draws
    accuracy over confidence with Matplotlib, and returns the axes."""

    def __repr__(self) -> str:
        return f"Scores({self['right']} of {self['records']} right, log_loss {self['log_loss']:.3f} nats)"


class Evaluation(Fields, Drawn):
    """Records compared with the truth, as in the JSON of `palpate evaluate`.

    It has the fields of Scores, of all records; `known_classes`, Scores of the classes that maps have,
    and `unknown_classes`, where there are both; `classes`, a list of {"class", "known", "records",
    "right", "recall", "recall_interval"}; `confusion`: {"rows", "columns", "counts" [row, column]}, how
    often the class of a row was taken for the answer of a column; `error_mm` and `refined_error_mm`:
    {"records", "median"}; how many records were left out: `without_truth` and `failed`. The right answer
    of a class that no map has is "(none)". docs/files.md explains all keys.

    plot(ax=None) draws with Matplotlib which classes are taken for which, and returns the axes; `all.plot()`
    draws how far confidence can be trusted.
    """

    _kinds = {"known_classes": Scores}

    @property
    def all(self) -> Scores:
        """The scores of all records."""
        return Scores(self)

    def __repr__(self) -> str:
        return f"Evaluation({self['right']} of {self['records']} right, {len(self['classes'])} classes)"


class GroupScores(Fields):
    """The cross-validation of several touches of one object at a time, `touches` of a group: Scores
    `before`, by Eq. 7, of the `table`, and `after`."""

    _kinds = {"before": Scores, "table": Scores, "after": Scores}


class SensorCalibration(Fields):
    """A learned sensor and how good it is on touches that it has not seen, by cross-validation.

    Scores of single touches are `before`, by Eq. 7 with gamma 0.1 and temperature 1; of the `table`, at
    temperature 1; and `after`, with temperature and press features. With one object there is none to
    compare by, and they are missing. `groups` has GroupScores, at known poses and of enough touches;
    `objects` is the number of objects; `tried` lists the tables that were tried, {"layer", "levels",
    "log_loss"}; `array_offset` says where the array sits in the tool, as a finding of check_setup(), from
    touches of objects whose maps are drawn: all else is learned with the array there; `warnings` say what
    could not be learned.
    """

    _kinds = {**GroupScores._kinds, "groups": GroupScores}

    sensor: "LearnedSensor"
    """What was learned."""

    def __init__(self, fields: dict[str, Any], sensor: "LearnedSensor"):
        super().__init__(fields)
        self.sensor = sensor

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draws the learned table with Matplotlib, as sensor.plot(). Returns the axes."""
        return self.sensor.plot(ax)

    def __repr__(self) -> str:
        of = f", {self.after.right} of {self.after.records} touches right" if "after" in self else ""
        return f"SensorCalibration({self.objects} object{'' if self.objects == 1 else 's'}{of})"


class SetupCheck(Fields):
    """What touches say about their set-up.

    `findings` are those in the JSON of `palpate check`, empty where the set-up is sound: {"what", "nats",
    "words"} and, where they apply, `flag`, the options that mend it, and `array_offset` [3] with its
    `sd` [3], the array's pose in the true sensor frame in mm, mm and rad. `what` is "pose_unit",
    "element_order", "array_offset", "pitch", "dead_elements", "stuck_elements", "contradicting",
    "unexplained", "tilt", "clock" or "dropped"; `nats`, by how much more likely the touches are once it
    is mended (of "clock", log 19 for each press that it explains; 0 of "unexplained", "tilt" and
    "dropped"). `remarks` are what these touches cannot tell, in sentences, `elements_mm` [e, 2] is the
    array as the findings correct it, and `touches` counts those in contact.
    """


class Plan(Fields):
    """Poses of the next touch, as in the JSON of `palpate plan`.

    `candidates` lists them, the best first: {"index", "x_mm", "y_mm", "theta_rad", "gain"}, where the gain
    is what the touch is expected to tell, {"identity", "pose", "both", "standard_error"}, nats. `believed`
    is what is believed before the touch, a Record from `decision` on, with its `entropy`: {"identity",
    "pose", "both"}, nats. `warnings` say what looks wrong with the touches, and what limits the gains.
    docs/files.md explains all keys.
    """

    _kinds = {"believed": Record}

    @property
    def T_robot_sensor(self) -> "NDArray[numpy.float64]":
        """[n, 3] (x_mm, y_mm, theta_rad), the poses of the candidates."""
        import numpy

        keys = ("x_mm", "y_mm", "theta_rad")
        return numpy.array([[one[key] for key in keys] for one in self["candidates"]])
