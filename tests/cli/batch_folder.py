"""Recordings, and what `palpate batch` makes of them."""

import json
from typing import Any

from command import PreparedTest, run

RECORDINGS = 11
BROKEN = 4


def name(i: int) -> str:
    return f"u/{i:02}.h5"


def batch_of(inputs: list[str], results: str, *more: str) -> list[str]:
    """`palpate batch` on these inputs, by few bins and, unless it is asked for, without a device."""
    filter = [] if "--filter" in more else ["--filter", "bounded"]
    return ["batch", *inputs, "-o", results, "--maps", "maps", "--bins", "10x10x10", *filter, *more]


def batch(results: str, *more: str) -> list[str]:
    """The same of all of u/, in chunks of 3."""
    return batch_of(["u"], results, "--chunk", "3", *more)


def parse(lines: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in lines.splitlines()]


class Batch(PreparedTest):
    """Recordings of two letters in u/, one of them broken, and in r/ what a batch makes of them."""

    expected: str  #: r/, merged

    @classmethod
    def prepare(cls) -> None:
        cls.learn("AE")
        (cls.prepared / "u").mkdir()
        for i in range(RECORDINGS):
            pose = f"--object-pose={0.5 * i - 2},1,{17 * i}"
            cls.make("simulate", "AE"[i % 2], "-o", name(i), "--touches", "5", pose)
        (cls.prepared / name(BROKEN)).write_text("no recording")
        first = run(cls.prepared, *batch("r"))
        assert first.returncode == 3 and not first.stderr, first.stderr
        cls.expected = run(cls.prepared, "merge", "r", check=True).stdout

    def merged(self, results: str) -> str:
        return self.palpate("merge", results).stdout

    def put(self, file: str, text: str) -> None:
        (self.folder / file).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / file).write_text(text)

    def recognized(self, *arguments: str) -> list[dict[str, Any]]:
        """Records of `recognize`, less what those of a batch lack."""
        records = self.records(*arguments)
        return [{k: v for k, v in of.items() if k not in ("seconds", "device")} for of in records]

    def import_presses(self, file: str, *flags: str) -> None:
        """Four touches of 36 elements."""
        presses = [[(7 * k + 5 * i) % 11 / 2 for k in range(36)] + [i, -i, 0] for i in range(4)]
        rows = [",".join(map(str, press)) for press in presses]
        heading = ",".join([*(f"p{k}" for k in range(36)), "x", "y", "theta"])
        self.put("presses.csv", "\n".join([heading, *rows]) + "\n")
        tables = ("presses.csv", "--poses", "presses.csv", "--pressure-columns", "p*")
        self.palpate("import", *tables, "-o", file, *flags)
