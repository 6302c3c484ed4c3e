"""The exception, apart from the extension module, which raises it."""

from typing import Literal


class Error(RuntimeError):
    """The one exception of Palpate.

    Its text is one line that names the file, the field, the value and the remedy, with options as
    keyword arguments: bins=(25, 25, 16).
    """

    fault: Literal["input", "system"] = "input"
    """"input" where a file or value has to change, "system" where the machine failed."""


Error.__module__ = "palpate"
