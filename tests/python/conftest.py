import json
import os
import pathlib
import re
import subprocess
from collections.abc import Callable, Mapping
from typing import Any

import pytest

import palpate


@pytest.fixture(scope="session")
def device() -> palpate.Device:
    return palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))


@pytest.fixture(scope="session")
def maps(device: palpate.Device) -> list[palpate.OccupancyGrid]:
    """Maps of three letters, from touches of seed 1."""
    built = []
    for letter in "AEI":
        builder = palpate.MapBuilder(device)
        builder.add(palpate.simulate(letter, seed=1))
        built.append(builder.build(letter))
    return built


@pytest.fixture(scope="session")
def unknown() -> palpate.Recording:
    """Nine touches of an E at a pose that the recording knows."""
    return palpate.simulate(
        "E",
        palpate.random_poses(9, seed=2),
        T_object_robot=palpate.random_object_pose(seed=2),
        seed=3,
    )


def command(*arguments: object) -> str:
    """Runs the command `palpate` and returns its output."""
    run = subprocess.run(
        [os.environ["PALPATE_COMMAND"], *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )
    if run.returncode != 0:
        raise RuntimeError(run.stderr.removeprefix("palpate: ").rstrip("\n"))
    return run.stdout


def refusal(*arguments: object) -> str:
    """What the command says of input that it refuses."""
    run = subprocess.run(
        [os.environ["PALPATE_COMMAND"], *map(str, arguments)], capture_output=True, text=True
    )
    assert run.returncode == 2, run.stderr
    return run.stderr.removeprefix("palpate: ").rstrip("\n")


def expect_refused(
    call: Callable[[], object], *arguments: object, spelled: Mapping[str, str] = {}
) -> None:
    """The call is refused as the command with the arguments is, but for how each spells options.
    `spelled` has how Python spells each option that the command's words name."""
    with pytest.raises(palpate.Error) as refused:
        call()
    words = refusal(*arguments)
    for flag, keyword in spelled.items():
        assert flag in words
        words = words.replace(flag, keyword)
    said = str(refused.value)
    assert "--" not in said
    assert said == words if spelled else OPTION.sub("OPTION", said) == OPTION.sub("OPTION", words)
    assert refused.value.fault == "input"


class Files:
    """Maps and an unknown that the command has written."""

    def __init__(self, folder: pathlib.Path) -> None:
        self.maps = folder / "maps"
        self.unknown = folder / "E.h5"
        train = []
        for seed, letter in enumerate("AE", start=1):
            train.append(folder / f"{letter}.train.h5")
            command("simulate", letter, "-o", train[-1], "--seed", seed)
        flags = ("--prior", "0.2", "--sensor-model", "none")
        command("map", *train, "-o", f"{self.maps}/", *flags)
        self.train = train
        command(
            "simulate", "E", "-o", self.unknown, "--object-pose", "random", "--touches", 9,
            "--seed", 4,
        )  # fmt: skip

    def recognized(self, *flags: object) -> list[dict[str, Any]]:
        output = command("recognize", self.unknown, "--maps", self.maps, "--json", "-", *flags)
        records: list[dict[str, Any]] = json.loads(output)
        return records


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    return Files(tmp_path_factory.mktemp("files"))


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
