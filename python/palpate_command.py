"""The command `palpate` of the wheel. Apart from the package, which would load NumPy first."""

import os
import pathlib
import sys
from typing import NoReturn


def main() -> NoReturn:
    """Becomes the program that lies in the package."""
    program = pathlib.Path(__file__).parent / "palpate" / "bin" / "palpate"
    os.execv(program, ["palpate", *sys.argv[1:]])
