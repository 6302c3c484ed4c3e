#!/usr/bin/env python3
"""Fails where a file includes what lies above it: each folder may include the folders it is built on
alone, and benchmarks and the Python module nothing of the commands."""

import pathlib
import re
import sys

LIBRARY = ["model", "gpu", "shaders", "estimation", "simulation", "options", "yaml", "io", "streaming"]
BELOW = {
    "host/model": [],
    "host/reference": [],
    "host/gpu": ["model"],
    "host/estimation": ["model", "gpu", "shaders"],
    "host/simulation": ["model"],
    "host/options": ["model"],
    "host/yaml": ["model"],
    "host/io": ["model", "options", "yaml"],
    "host/streaming": ["model", "simulation", "io"],
    "host/recognition": LIBRARY,
    "host/learning": [*LIBRARY, "recognition"],
    "host/figures": ["model"],
    "host/cli": [*LIBRARY, "recognition", "learning", "figures"],
    "driver": ["model", "yaml"],
    "python": [*LIBRARY, "recognition", "learning", "reference"],
    "bench": [*LIBRARY, "recognition", "learning", "reference"],
}


def reached_up(root: pathlib.Path) -> list[str]:
    folders = {pathlib.Path(folder).name for folder in BELOW}
    wrong = []
    for folder, below in BELOW.items():
        allowed = {*below, pathlib.Path(folder).name}
        files = [file for file in sorted((root / folder).rglob("*")) if file.suffix in (".cpp", ".hpp")]
        if not files:
            wrong.append(f"{folder} holds no source")
        for file in files:
            for name in re.findall(r'^#include "(.+)"', file.read_text(), re.MULTILINE):
                layer = name.split("/")[0]
                if "/" in name and layer in folders - allowed:
                    wrong.append(f"{file.relative_to(root)} includes {name}")
    return wrong


if __name__ == "__main__":
    found = reached_up(pathlib.Path(sys.argv[1]))
    print("\n".join(found))
    sys.exit(bool(found))
