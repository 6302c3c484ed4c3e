"""Many recordings, on a Dask cluster: dask.distributed hands chunks of them to its workers.

What follows from all recordings together is settled by one worker before the chunks are handed out,
by the code of `palpate batch`. Queues, placement, and the repetition of what a dead worker had in hand
are Dask's.
"""

import errno
import functools
import importlib
import itertools
import json
import os
import socket
import threading
import warnings
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, cast

from . import _palpate
from ._error import Error
from ._palpate import Device, DeviceInfo
from .recognition import RecognitionOptions, _Path, request_of, warn
from .results import Record

if TYPE_CHECKING:
    from distributed import Client


class Task(RecognitionOptions, total=False):
    """What recognize_many() recognises, and how: arguments of recognize() by their names.

    `recognize(path, **task)` gives the records of one recording. Maps are files or folders, which all
    workers must be able to read. `budget_ms` is missing, since its results depend on the clock; so are
    open devices, since each worker opens its own: `device` is a name or an index.
    """

    maps: _Path | Sequence[_Path]
    particles: int
    resampling: Literal["multinomial", "systematic"]
    augmented: bool
    seed: int
    each_frame: bool
    trace: bool
    device: str | int


@dataclass(frozen=True)
class Recognized:
    """An unknown that recognize_many() has recognised.

    `record` and `line` depend on nothing but the recordings, the task, and the kind of the device;
    how they came about stands beside them.
    """

    #: Place of the unknown among all, in the order of the recordings.
    index: int
    #: The record; of a recording that cannot be recognised, one with its `error`.
    record: Record
    #: The record as a line of JSON: the bytes that `palpate batch` writes, with options as flags.
    line: bytes
    #: Wall time, s.
    seconds: float
    #: Name of the device.
    device: str
    #: Name of the computer.
    host: str


def recognize_many(
    paths: _Path | Iterable[_Path],
    task: Task,
    *,
    client: "Client | str | None" = None,
    chunk: int = 100,
    ordered: bool = False,
) -> Generator[Recognized, None, None]:
    """Recognises many recordings, on the workers of a Dask cluster, and yields results as they come.

    paths: recordings, folders of them, manifests (*.csv) and patterns, as `palpate batch` takes them,
    on a file system that all workers share; task: the maps and other arguments of recognize(); client:
    a dask.distributed Client or a scheduler's address; without it, this process recognises one
    recording after the other, and Dask is not needed; chunk: recordings that are handed to a worker at
    once; ordered: whether results come in the order of the recordings, where one that is late holds
    up those after it.

    A worker process opens one device, once; where its computer has several of one kind, the workers
    of that computer take different ones. A recording that cannot be recognised becomes a record with
    its error. Lines are byte for byte those of `palpate batch`, whatever the workers, the chunks and
    the order, on the same kind of device with the same driver. close() of the result cancels what is
    left.

    Raises Error at once where the task or a path is wrong, where Dask is missing, or where a worker
    cannot read the files under the paths given; while iterating, where a recording has changed since,
    where a worker has another kind of device, palpate or maps, or where a chunk's workers die again
    and again. What the command would say on standard error becomes a UserWarning.
    """
    if chunk < 1:
        raise Error(f"chunk {chunk}: give at least 1")
    recordings = _paths(paths)
    asked = _asked(recordings, task)
    asked.request()  # refuses here what no worker could read
    if client is None:
        batch, entries, sentences = _settle(recordings, asked, _cores())
    else:
        with _connected(client) as cluster:
            batch, entries, sentences = cluster.submit(_settle, recordings, asked, pure=False).result()
    warn(sentences)
    chunks = [entries[begin : begin + chunk] for begin in range(0, len(entries), chunk)]
    return _results(
        chunks, _here(batch, chunks) if client is None else _there(client, batch, chunks, ordered)
    )


@dataclass(frozen=True)
class _Asked:
    """The task, as workers receive it."""

    task: dict[str, Any]
    folder: str  #: where relative paths begin
    relative: str  #: the first relative path, or ""

    def maps(self) -> list[str]:
        return _paths(self.task.get("maps", ()))

    def request(self) -> _palpate.Request:
        return request_of({name: value for name, value in self.task.items() if name != "maps"})

    def require_folder(self) -> None:
        """Refuses relative paths where they would lead elsewhere."""
        if self.relative and os.path.realpath(self.folder) != os.path.realpath(os.getcwd()):
            raise Error(
                f"{self.relative}: is relative to {self.folder}, but a worker on "
                f"{socket.gethostname()} runs in {os.getcwd()}; give absolute paths, or start the "
                "workers in that folder"
            )


def _asked(recordings: list[str], task: Task) -> _Asked:
    options = cast(dict[str, Any], task)
    for name in options:
        if name not in Task.__annotations__:
            raise Error(f"task: '{name}' is not known; give {', '.join(Task.__annotations__)}")
    if isinstance(options.get("device"), Device):
        raise TypeError("device: each worker opens its own; give a name or an index")
    files = [*recordings, *_paths(options.get("maps", ()))]
    given = [options.get(name) for name in ("scene", "sensor_model")]
    files += [os.fsdecode(file) for file in given if file and file != "none"]
    relative = [path for path in files if not os.path.isabs(path)]
    return _Asked(options, os.getcwd(), relative[0] if relative else "")


def _paths(given: _Path | Iterable[_Path]) -> list[str]:
    if isinstance(given, (str, bytes, os.PathLike)):
        given = [given]
    return [os.fsdecode(path) for path in given]


@dataclass(frozen=True)
class _Batch:
    """A settled batch, as workers receive it."""

    head: str
    device: str  #: name of the device that it was settled on
    asked: _Asked


_Entry = tuple[str, int]  # a recording, and how many unknowns it holds
#: Lines, again in Python's words where these differ, and seconds; a sentence, device, host.
_Lines = tuple[list[tuple[str, str, float]], str, str, str]
_Done = Generator[tuple[int, _Lines], None, None]  # chunks by their index


def _cores() -> int:
    return len(os.sched_getaffinity(0))


def _distributed() -> Any:
    try:
        return importlib.import_module("distributed")
    except ImportError as missing:
        raise Error(
            "recognize_many: dask.distributed is missing; pip install 'palpate[dask]', or leave client "
            "out"
        ) from missing


def _connected(client: "Client | str") -> AbstractContextManager[Any]:
    if isinstance(client, str):
        connected: AbstractContextManager[Any] = _distributed().Client(client, set_as_default=False)
        return connected
    return nullcontext(client)


def _here(batch: _Batch, chunks: Sequence[list[_Entry]]) -> _Done:
    for index, chunk in enumerate(chunks):
        yield index, _recognize([entry for entry, _ in chunk], batch, _cores())


def _there(
    client: "Client | str", batch: _Batch, chunks: Sequence[list[_Entry]], ordered: bool
) -> _Done:
    """Chunks as the workers finish them, or in order; results wait at their workers."""
    distributed = _distributed()
    with _connected(client) as cluster:
        futures = cluster.map(
            _recognize, [[entry for entry, _ in chunk] for chunk in chunks], batch=batch, pure=False
        )
        left = {future.key: (index, future) for index, future in enumerate(futures)}
        del futures
        try:
            coming = [future for _, future in left.values()]
            done = coming if ordered else distributed.as_completed(coming, loop=cluster.loop)
            del coming
            for future in done:
                index = left[future.key][0]
                try:
                    lines = future.result()
                except distributed.KilledWorker as killed:
                    raise Error(
                        f"{json.loads(chunks[index][0][0])['path']}: workers died again and again "
                        f"while they recognised it and {len(chunks[index]) - 1} others; look at them "
                        "with palpate info, and at the workers' logs and memory"
                    ) from killed
                future.release()
                del left[future.key]
                yield index, lines
        finally:
            if left and cluster.status == "running":
                cluster.cancel([future for _, future in left.values()])


def _results(chunks: Sequence[list[_Entry]], done: _Done) -> Generator[Recognized, None, None]:
    first = [0, *itertools.accumulate(sum(count for _, count in chunk) for chunk in chunks)]
    warned = False
    with closing(done):
        for index, (lines, sentence, device, host) in done:
            if sentence and not warned:
                warned = True
                warnings.warn(sentence, stacklevel=2)
            for i, (line, own, seconds) in enumerate(lines, start=first[index]):
                record = Record(json.loads(own or line))
                yield Recognized(i, record, line.encode(), seconds, device, host)


# What follows runs in the workers.

#: One thread at a time opens a device or a batch; the next one finds it open.
_opening = threading.Lock()
#: The open batch. Only one, since it takes the device's memory.
_opened: tuple[_Batch, _palpate.OpenBatch] | None = None
#: Keeps this process's place among those of its computer.
_place: socket.socket | None = None


def _settle(
    recordings: list[str], asked: _Asked, threads: int | None = None
) -> tuple[_Batch, list[_Entry], list[str]]:
    asked.require_folder()
    request = asked.request()
    with _opening:
        device = _open_device(_palpate.device_of(request))
    head, entries, sentences = _palpate.settle_batch(
        recordings, asked.maps(), request, device, threads or _threads()
    )
    return _Batch(head, device.name, asked), entries, sentences


def _recognize(entries: list[str], batch: _Batch, threads: int | None = None) -> _Lines:
    global _opened
    batch.asked.require_folder()
    with _opening:
        device = _open_device(_palpate.device_of(batch.asked.request()))
        if _opened is None or _opened[0] != batch:
            _opened = None  # gives its memory back first
            _opened = batch, _palpate.OpenBatch.open(batch.head, device, threads or _threads())
        opened = _opened[1]
    if device.name != batch.device and not opened.on_host:
        raise Error(
            f"{socket.gethostname()}: has the device {device.name}, but the batch was settled on "
            f"{batch.device}; name a device in the task that all workers have, or use workers alike"
        )
    lines, sentence = opened.recognize(entries)
    return lines, sentence, device.name, socket.gethostname()


def _threads() -> int:
    """The threads that Dask gives this worker."""
    return int(_distributed().get_worker().state.nthreads)


@functools.cache
def _open_device(name: str) -> Device:
    """The device of this process's place among those like the one that Device.open() takes."""
    index = _index_of(Device.list(name), name or os.environ.get("PALPATE_DEVICE", ""), _place_on_host)
    return Device.open(name if index is None else index)


def _index_of(
    listed: Sequence[DeviceInfo], name: str, place_on_host: Callable[[], int]
) -> int | None:
    """The device to open; None leaves it to Device.open(). A name that is an index settles it."""
    chosen = next((info.name for info in listed if info.chosen), None)
    alike = [info.index for info in listed if info.usable and info.name == chosen]
    return None if name.isdecimal() or len(alike) < 2 else alike[place_on_host() % len(alike)]


def _place_on_host() -> int:
    """The least number that no other process of this user has taken on this computer.

    It is held by a name of the kernel's (an abstract Unix socket) that ends with the process, however
    it ends: the worker that takes the place of a dead one takes its number, too.
    """
    global _place
    place = socket.socket(socket.AF_UNIX)
    for number in itertools.count():
        try:
            place.bind(f"\0palpate.{os.getuid()}.{number}")
            break
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                place.close()
                raise
    _place = place
    return number
