"""recognize_many() gives the bytes of `palpate batch`, whatever happens to its workers."""

import dataclasses
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
from collections.abc import Iterable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from conftest import Files, command, comparable, error_of, run

import palpate
from palpate import many

REGION: Any = {"bins": (12, 12, 12), "x_mm": (-12, 12), "y_mm": (-12, 12)}
FLAGS = ["--bins", "12x12x12", "--x-mm=-12:12", "--y-mm=-12:12", "--filter", "bounded"]
#: Maps that bring no sensor model, of cells for which few bins do.
COARSE = ("--sensor-model", "none", "--prior", "0.2", "--cell-mm", 2)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A folder of eleven unknowns and a broken recording."""
    folder = tmp_path_factory.mktemp("unknowns")
    for seed in range(11):
        palpate.simulate(
            "AE"[seed % 2], palpate.random_poses(3, seed=seed), seed=seed,
            T_object_robot=palpate.random_object_pose(seed=seed),
        ).save(folder / f"{seed:02}.h5")  # fmt: skip
    (folder / "05b.h5").write_bytes(b"no recording")
    return folder


@pytest.fixture(scope="module")
def task(files: Files) -> palpate.Task:
    return {**REGION, "filter": "bounded", "maps": files.maps}


def batch(folder: pathlib.Path, inputs: pathlib.Path, maps: pathlib.Path, *flags: str) -> list[bytes]:
    """The lines of `palpate batch`."""
    done = run("batch", inputs, "-o", folder / "results", "--maps", maps, *flags)
    assert done.returncode in (0, 3), done.stderr
    command("merge", folder / "results", "-o", folder / "all.ndjson")
    return (folder / "all.ndjson").read_bytes().splitlines(keepends=True)


@pytest.fixture(scope="module")
def expected(files: Files, recordings: pathlib.Path, tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    lines = batch(tmp_path_factory.mktemp("batch"), recordings, files.maps, *FLAGS)
    assert len(lines) == 12
    return lines


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None,
        local_directory=tmp_path_factory.mktemp("dask"),
    ) as cluster:  # fmt: skip
        yield cluster


@pytest.fixture
def client(cluster: Any) -> Iterator[Any]:
    with cluster.get_client() as client:
        yield client


def lines_of(results: Iterable[palpate.Recognized]) -> list[bytes]:
    return [result.line for result in sorted(results, key=lambda result: result.index)]


def test_without_a_client_this_process_recognises(
    task: palpate.Task, recordings: pathlib.Path, expected: list[bytes]
) -> None:
    results = list(palpate.recognize_many(recordings, task, chunk=5))
    assert [result.line for result in results] == expected
    assert [result.index for result in results] == list(range(12))
    for result in results:
        assert comparable(result.record) == comparable(json.loads(result.line))
        assert not any("--" in text for text in result.record.get("warnings", []))
    assert results[0].device and results[0].host and results[0].seconds > 0
    [broken] = [result for result in results if "error" in result.record]
    assert broken.record.recording == str(recordings / "05b.h5")
    assert "05b.h5" in broken.record.error and "error" in repr(broken.record)


@pytest.mark.parametrize("each_frame", [False, True])
def test_what_all_recordings_tell_together_is_settled_once(
    each_frame: bool, files: Files, recordings: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    # The array of one recording reaches farther, which widens the region of all.
    wide = palpate.simulate("A", palpate.random_poses(2, seed=7), seed=7)
    palpate.Recording(
        wide.pressure, wide.T_robot_sensor, wide.elements_mm * 1.5
    ).save(tmp_path / "wide.h5")
    maps = tmp_path / "maps"
    command("map", *files.train, "-o", f"{maps}/", *COARSE)
    table = tmp_path / "list.csv"
    table.write_text(
        f"path,frames,label\n{recordings}/00.h5,0:2,A\n{recordings}/01.h5,,E\n"
        f"{recordings}/missing.h5,,E\nwide.h5,,\n"
    )
    task: palpate.Task = {"maps": maps, "each_frame": each_frame, "trace": each_frame, "filter": "bounded"}
    flags = ["--each-frame", "--trace"] if each_frame else []
    lines = batch(tmp_path, table, maps, "--filter", "bounded", *flags)
    results = list(palpate.recognize_many(table, task, chunk=1))
    assert [result.line for result in results] == lines
    assert len(lines) == (2 + 3 + 1 + 2 if each_frame else 4)
    alone = list(palpate.recognize_many(f"{recordings}/01.h5", task))
    assert alone[0].line != results[2 if each_frame else 1].line, "the list widens the region"


def test_workers_give_the_bytes_of_batch(
    client: Any, cluster: Any, task: palpate.Task, recordings: pathlib.Path, expected: list[bytes]
) -> None:
    assert lines_of(palpate.recognize_many(recordings, task, client=client, chunk=1)) == expected
    cluster.scale(4)
    client.wait_for_workers(4, timeout=120)
    in_order = palpate.recognize_many(recordings, task, client=client, chunk=2, ordered=True)
    assert [result.line for result in in_order] == expected
    by_address = palpate.recognize_many(
        [recordings], task, client=cluster.scheduler_address, chunk=5
    )
    assert lines_of(by_address) == expected
    # The histogram, too, which computes on the device.
    dense: palpate.Task = {**task, "filter": "histogram"}
    assert lines_of(palpate.recognize_many(recordings, dense, client=client, chunk=3)) == [
        result.line for result in palpate.recognize_many(recordings, dense)
    ]


def killed(client: Any, results: Iterator[palpate.Recognized]) -> tuple[palpate.Recognized, int]:
    """Kills a worker after another one's first result; returns both. Stopped, it keeps the chunks that it is
    handed."""
    victim = next(iter(client.run(os.getpid).values()))
    os.kill(victim, signal.SIGSTOP)
    first = next(results)
    os.kill(victim, signal.SIGKILL)
    return first, victim


def test_a_worker_that_dies_in_the_middle_changes_nothing(
    client: Any, task: palpate.Task, recordings: pathlib.Path, expected: list[bytes]
) -> None:
    results = palpate.recognize_many(recordings, task, client=client, chunk=1)
    first, victim = killed(client, results)
    everything = [first, *results]
    assert lines_of(everything) == expected
    assert len(everything) == 12
    assert victim not in client.run(os.getpid).values()


def test_recordings_that_kill_their_workers_are_named(
    client: Any, cluster: Any, task: palpate.Task, recordings: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster.scheduler, "allowed_failures", 0)
    results = palpate.recognize_many(recordings, task, client=client, chunk=1)
    killed(client, results)
    assert ".h5: workers died again and again" in error_of(list, results)


def test_an_iteration_that_ends_early_leaves_nothing_behind(
    client: Any, task: palpate.Task, recordings: pathlib.Path
) -> None:
    results = palpate.recognize_many(recordings, task, client=client, chunk=1)
    next(results)
    results.close()
    assert not [state for state in client.futures.values() if state.status == "pending"]


def test_errors_of_workers_arrive(
    client: Any, files: Files, task: palpate.Task, recordings: pathlib.Path, tmp_path: pathlib.Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    def begun(paths: Any, **changed: Any) -> Iterator[palpate.Recognized]:
        return palpate.recognize_many(paths, {**task, **changed}, client=client)  # type: ignore[typeddict-item]

    assert "nowhere: no such file" in error_of(begun, recordings, maps="/nowhere")
    changing = tmp_path / "changing.h5"
    changing.write_bytes((recordings / "00.h5").read_bytes())
    results = begun(changing)
    changing.write_bytes(b"")
    assert "changing.h5: has changed since the batch began" in error_of(list, results)
    maps = tmp_path / "maps"
    maps.mkdir()
    for map in files.maps.iterdir():
        (maps / map.name).write_bytes(map.read_bytes())
    results = begun(recordings, maps=maps)
    command("map", *files.train, "-o", f"{maps}/", *COARSE)
    assert "map.h5 has changed; give all workers the same" in error_of(list, results)
    monkeypatch.chdir(tmp_path)
    assert re.search("'?unknowns'?: is relative to .*give absolute paths", error_of(begun, "unknowns"))


@pytest.mark.parametrize(
    ("changed", "arguments", "message"),
    [
        ({"bin": 3}, {}, "task: 'bin' is not known; give bins, x_mm"),
        ({"budget_ms": 3.0}, {}, "task: 'budget_ms' is not known"),
        ({}, {"chunk": 0}, "chunk 0: give at least 1"),
        ({}, {"paths": []}, "paths: none"),
        ({"maps": []}, {}, "maps: missing"),
    ],
)
def test_a_wrong_call_is_refused_at_once(
    changed: Any, arguments: dict[str, Any], message: str, task: palpate.Task, recordings: pathlib.Path
) -> None:
    call = {"paths": recordings, "task": {**task, **changed}, **arguments}
    assert message in error_of(palpate.recognize_many, **call)


def test_an_open_device_is_no_part_of_a_task(
    device: palpate.Device, task: palpate.Task, recordings: pathlib.Path
) -> None:
    with pytest.raises(TypeError, match="^device: each worker opens its own; give a name"):
        palpate.recognize_many(recordings, {**task, "device": device})  # type: ignore[typeddict-item]


def test_what_every_recording_tells_is_told_once(task: palpate.Task, recordings: pathlib.Path) -> None:
    coarse: Any = {**task, "bins": (8, 8, 8), "filter": "histogram", "touch_sd_deg": 3}
    paths = [recordings / "00.h5", recordings / "01.h5"]
    with pytest.warns(UserWarning) as told:
        assert len(list(palpate.recognize_many(paths, coarse, chunk=1))) == 2
    assert len([each for each in told if "does not resolve" in str(each.message)]) == 1


@pytest.mark.parametrize("filter", ["bounded", "histogram"])
def test_another_device_is_refused_where_results_depend_on_it(
    filter: str, task: palpate.Task, recordings: pathlib.Path
) -> None:
    asked = many._asked([], {**task, "filter": filter})  # type: ignore[typeddict-item]
    settled, entries, _ = many._settle([str(recordings / "00.h5")], asked, 1)
    elsewhere = dataclasses.replace(settled, device="another device")
    lines = [entry for entry, _ in entries]
    if filter == "bounded":
        assert len(many._recognize(lines, elsewhere, 1)[0]) == 1
    else:
        said = error_of(many._recognize, lines, elsewhere, 1)
        assert "the batch was settled on another device" in said


def test_a_folder_is_the_same_under_another_name(
    tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    monkeypatch.chdir(tmp_path / "real")
    many._Asked({}, str(tmp_path / "link"), "a.h5").require_folder()
    assert "a.h5: is relative to" in error_of(many._Asked({}, str(tmp_path), "a.h5").require_folder)


def test_without_dask_an_error_says_what_to_install(
    task: palpate.Task, recordings: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    said = error_of(palpate.recognize_many, recordings, task, client="tcp://127.0.0.1:1")
    assert "pip install 'palpate[dask]'" in said
    assert list(palpate.recognize_many(recordings / "00.h5", task))


def test_workers_of_a_computer_take_different_devices_of_a_kind() -> None:
    names = ["CPU", "GPU", "GPU", "GPU", "GPU", "other GPU"]
    listed: Any = [
        SimpleNamespace(index=index, name=name, chosen=index == 1, usable=index != 3)
        for index, name in enumerate(names)
    ]
    taken = [many._index_of(listed, "", lambda place=place: place) for place in range(5)]
    assert taken == [1, 2, 4, 1, 2]
    unasked: Any = None  # no place is asked for
    assert many._index_of(listed, "2", unasked) is None
    assert many._index_of(listed[:2], "", unasked) is None
    assert many._index_of(listed[:1], "missing", unasked) is None


PLACE = "from palpate import many; print(many._place_on_host(), flush=True); input()"


def test_a_dead_worker_gives_its_place_back() -> None:
    def begin() -> tuple["subprocess.Popen[str]", int]:
        process = subprocess.Popen(
            [sys.executable, "-c", PLACE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        return process, int(process.stdout.readline())

    first, place = begin()
    second, other = begin()
    try:
        assert other != place
        first.kill()
        first.wait()
        first, again = begin()
        assert again == place
    finally:
        for process in (first, second):
            process.kill()
            process.communicate()


def test_the_program_of_the_guide_runs(
    files: Files, recordings: pathlib.Path, tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (pathlib.Path(__file__).parents[2] / "docs" / "batch.md").read_text()
    [program] = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (tmp_path / "unknowns").mkdir()
    (tmp_path / "unknowns" / "00.h5").write_bytes((recordings / "00.h5").read_bytes())
    command("map", *files.train, "-o", f"{tmp_path}/maps/", *COARSE)
    monkeypatch.chdir(tmp_path)
    exec(program, {"__name__": "__main__"})
    maps = pathlib.Path("maps")
    lines = batch(tmp_path / "batch", pathlib.Path("unknowns"), maps, "--filter", "bounded")
    assert (tmp_path / "dask.ndjson").read_bytes() == b"".join(lines)
