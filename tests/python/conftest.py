import json
import os
import pathlib
import re
import subprocess
import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import pytest

import palpate

sys.path.append(str(pathlib.Path(__file__).parents[1] / "support"))


@pytest.fixture(scope="session")
def device() -> palpate.Device:
    return palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))


Maps = list[palpate.OccupancyGrid]


def built(device: palpate.Device, touches: palpate.Recording, **options: Any) -> palpate.OccupancyGrid:
    """The map of touches of one object."""
    builder = palpate.MapBuilder(device, **options)
    builder.add(touches)
    return builder.build(touches.object)


def learned(device: palpate.Device, letter: str) -> palpate.OccupancyGrid:
    """The map of a letter, from touches of seed 1."""
    return built(device, palpate.simulate(letter, seed=1))


@pytest.fixture(scope="session")
def maps(device: palpate.Device) -> Maps:
    return [learned(device, letter) for letter in "AEI"]


@pytest.fixture
def belief(device: palpate.Device, maps: Maps) -> palpate.PoseHistogram:
    """Of A, E and I, before any touch."""
    return palpate.PoseHistogram(device, maps)


@pytest.fixture(scope="session")
def unknown() -> palpate.Recording:
    """Nine touches of an E at a pose that the recording knows."""
    return palpate.simulate(
        "E",
        palpate.random_poses(9, seed=2),
        T_object_robot=palpate.random_object_pose(seed=2),
        seed=3,
    )


@pytest.fixture
def posterior(belief: palpate.PoseHistogram, unknown: palpate.Recording) -> palpate.PoseHistogram:
    """The belief after the nine touches."""
    belief.update(unknown)
    return belief


def run(*arguments: object, cwd: pathlib.Path | None = None) -> "subprocess.CompletedProcess[str]":
    """Runs the command `palpate` to its end, whatever comes of it."""
    line = [os.environ["PALPATE_COMMAND"], *map(str, arguments)]
    return subprocess.run(line, cwd=cwd, capture_output=True, text=True, timeout=300)


def python(script: str, *arguments: str, **environment: str) -> "subprocess.CompletedProcess[str]":
    """Runs a script in an interpreter of its own."""
    line, env = [sys.executable, "-c", script, *arguments], {**os.environ, **environment}
    return subprocess.run(line, capture_output=True, text=True, timeout=120, env=env)


def command(*arguments: object, cwd: pathlib.Path | None = None) -> str:
    """What the command `palpate` prints."""
    done = run(*arguments, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def refusal(*arguments: object) -> str:
    """What the command says of input that it refuses."""
    done = run(*arguments)
    assert done.returncode == 2, done.stderr
    return done.stderr.removeprefix("palpate: ").rstrip("\n")


def error_of(call: Callable[..., object], *arguments: object, **named: object) -> str:
    """What the call says of input that it refuses."""
    with pytest.raises(palpate.Error) as refused:
        call(*arguments, **named)
    assert refused.value.fault == "input"
    return str(refused.value)


def warned(call: Callable[..., Any], *arguments: object, **named: object) -> tuple[Any, str]:
    """What the call returns, and what it warns of."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        value = call(*arguments, **named)
    return value, " ".join(str(warning.message) for warning in said)


def expect_refused(call: Callable[[], object], *arguments: object, spelled: Mapping[str, str] = {}) -> None:
    """The call is refused as the command with the arguments is, but for how each spells options.
    `spelled` has how Python spells each option that the command's words name."""
    words, said = refusal(*arguments), error_of(call)
    for flag, keyword in spelled.items():
        assert flag in words
        words = words.replace(flag, keyword)
    assert "--" not in said
    assert said == words if spelled else OPTION.sub("OPTION", said) == OPTION.sub("OPTION", words)


def printed(*arguments: object) -> Any:
    """The command's JSON."""
    return json.loads(command(*arguments, "--json", "-"))


class Files:
    """Maps and an unknown that the command has written, and a record that knows no truth."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.folder = folder
        self.maps = folder / "maps"
        self.unknown = folder / "E.h5"
        self.without_truth = folder / "r.json"
        self.without_truth.write_text('[{"best": "A", "identity": {"A": 1.0}}]')
        self.train = [folder / f"{letter}.train.h5" for letter in "AE"]
        for seed, file in enumerate(self.train, start=1):
            command("simulate", file.name[0], "-o", file, "--seed", seed)
        command("map", *self.train, "-o", f"{self.maps}/", "--prior", "0.2", "--sensor-model", "none")
        placed = ("--object-pose", "random", "--touches", 9, "--seed", 4)
        command("simulate", "E", "-o", self.unknown, *placed)

    def recognized(self, *flags: object) -> list[dict[str, Any]]:
        records: list[dict[str, Any]] = printed("recognize", self.unknown, "--maps", self.maps, *flags)
        return records


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    return Files(tmp_path_factory.mktemp("files"))


@pytest.fixture(scope="session")
def presses(tmp_path_factory: pytest.TempPathFactory) -> list[pathlib.Path]:
    """Ten touches of each of two letters, all over them."""
    folder = tmp_path_factory.mktemp("presses")
    for letter in "AU":
        palpate.simulate(letter, palpate.training_grid()[::19]).save(folder / f"{letter}.h5")
    return [folder / "A.h5", folder / "U.h5"]


OPTION = re.compile(
    r"--[a-z-]+(?:[ =](?:auto|histogram|[a-z]+(?=:)|-?[0-9](?:[^ ,;]*[^ ,;:])?))?"
    r"|[a-z_]+=(?:'\w+'|\([^)]*\)|[-0-9.]+)?|^[a-z_]+(?=:)"
)


def comparable(record: dict[str, Any]) -> dict[str, Any]:
    """Without times; in warnings, each face names options in its own words."""
    record = {key: value for key, value in record.items() if key != "seconds"}
    for step in (record, *record.get("trace", ())):
        step.update({"warnings": [OPTION.sub("OPTION", text) for text in step.get("warnings", ())]})
    return record
