"""Markdown tables of records, and how their values are written."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy
from numpy.typing import NDArray

Text = Callable[[Any], str]


def plain(value: Any) -> str:
    """Numbers in their shortest form, truth as yes and no, lists of numbers such as 64x64x244."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return "x".join(map(plain, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def count_text(count: float) -> str:
    """A count such as 100, 17.5 k, 1 M or 1 G."""
    for size, prefix in ((1e9, " G"), (1e6, " M"), (1e3, " k")):
        if count >= 0.9995 * size:
            return f"{count / size:.3g}{prefix}"
    return f"{count:.3g}"


def seconds_text(seconds: float) -> str:
    """Seconds with a unit and a prefix."""
    if seconds >= 0.9995:
        return f"{seconds:.3g} s"
    return f"{1e3 * seconds:.3g} ms" if seconds >= 0.9995e-3 else f"{1e6 * seconds:.3g} us"


def mean_text(errors: dict[str, float], sign: str = "") -> str:
    """Such as "0.137 ± 0.011", of a mean and its standard error."""
    return f"{errors['mean']:{sign}.3f} ± {errors['standard_error']:.3f}"


def number(form: str, factor: float = 1.0) -> Text:
    """Writes `factor` times a number in a form such as ".3f"."""
    return lambda value: format(factor * value, form)


#: Its head, the path of its field in a record, such as "error_mm/mean", and how it is written.
Column = tuple[str, str, Text]


def value_of(record: Any, path: str) -> Any:
    """What a path finds in a record, or None."""
    for name in path.split("/"):
        record = None if record is None else record.get(name)
    return record


def column(records: Any, path: str) -> NDArray[numpy.float64]:
    """A field of records, in an array as the records lie in lists; NaN where a record has none."""

    def values(of: Any) -> Any:
        return value_of(of, path) if isinstance(of, dict) else [values(each) for each in of]

    return numpy.array(values(records), numpy.float64)


class Table(list[Any]):
    """Records that are printed as they are added: rows of a table, after an empty line and its head.

    A dash stands where a record has nothing.
    """

    def __init__(self, columns: Sequence[Column], records: Iterable[Any] = ()) -> None:
        self._columns = columns
        for record in records:
            self.append(record)

    def append(self, record: Any) -> None:
        if not self:
            print(f"\n| {' | '.join(head for head, _, _ in self._columns)} |")
            print("|:--|" + "--:|" * (len(self._columns) - 1))
        values = [(value_of(record, path), text) for _, path, text in self._columns]
        print(f"| {' | '.join('–' if of is None else text(of) for of, text in values)} |", flush=True)
        super().append(record)
