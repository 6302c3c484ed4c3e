"""Long calls leave the interpreter to others, and stop."""

import os
import pathlib
import signal
import subprocess
import sys
import threading
import time

import numpy
import pytest
import tqdm

import palpate

# Updates by nine touches of this lattice take about half a second on two cores.
LARGE = palpate.PoseLattice(x_mm=(-20, 20, 60), y_mm=(-20, 20, 60), theta_rad=(0, 6.28, 60))


def test_other_threads_run_during_an_update(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    belief = palpate.PoseHistogram(device, maps, LARGE)
    steps = 0
    done = threading.Event()

    def count() -> None:
        nonlocal steps
        while not done.is_set():
            steps += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    begin, before = time.monotonic(), steps
    belief.update(unknown)
    took, during = time.monotonic() - begin, steps - before
    done.set()
    counter.join()
    assert took > 0.05, "the update is too short to tell"
    assert during > 10


def test_threads_share_a_device_and_a_belief(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    alone = palpate.PoseHistogram(device, maps)
    alone.update(unknown)
    expected = alone.log_likelihood(1)
    shared = palpate.PoseHistogram(device, maps)
    own: list[numpy.typing.NDArray[numpy.float64]] = []
    failures: list[BaseException] = []

    def work() -> None:
        try:
            belief = palpate.PoseHistogram(device, maps)
            belief.update(unknown)
            own.append(belief.log_likelihood(1))
            for _ in range(5):
                shared.update(unknown[0])
                shared.estimate()
        except BaseException as failure:
            failures.append(failure)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert len(own) == 4
    assert all(numpy.array_equal(bins, expected) for bins in own)
    twenty = palpate.PoseHistogram(device, maps)
    for _ in range(20):
        twenty.update(unknown[0])
    assert numpy.array_equal(shared.log_likelihood(0), twenty.log_likelihood(0))


def test_progress_comes_on_the_calling_thread(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    belief = palpate.PoseHistogram(device, maps, LARGE)
    fractions: list[float] = []
    threads: set[int] = set()

    def show(fraction: float) -> None:
        fractions.append(fraction)
        threads.add(threading.get_ident())

    belief.update(unknown, progress=show)
    assert fractions[-1] == 1.0
    assert fractions == sorted(fractions)
    assert threads == {threading.get_ident()}
    with tqdm.tqdm(total=1.0, disable=False, file=open(os.devnull, "w")) as bar:
        palpate.recognize(unknown, maps, bins=(10, 10, 8), device=device,
                          progress=lambda fraction: bar.update(fraction - bar.n))  # fmt: skip
        assert bar.n == pytest.approx(1.0)


def test_what_progress_raises_ends_the_call(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    belief = palpate.PoseHistogram(device, maps)

    def refuse(fraction: float) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        belief.update(unknown, progress=refuse)
    builder = palpate.MapBuilder(device)
    with pytest.raises(palpate.Error, match="^progress: uses the object whose progress it is"):
        builder.add(palpate.simulate("E"), progress=lambda fraction: builder.clear())
    belief.reset()
    belief.update(unknown)
    assert belief.estimate().identity.argmax() == 1


# Sends SIGINT to itself when the call shows progress, or after a while where it shows none; prints how
# long the call took to end.
INTERRUPTED = """
import os, signal, sys, threading, time
import palpate

device = palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))
builder = palpate.MapBuilder(device)
training = palpate.simulate("E", seed=1)
builder.add(training)
grid = builder.build("E")
lattice = palpate.PoseLattice((-40, 40, 80), (-40, 40, 80), (0, 6.28, 30))
sent = []
running = threading.Event()

def interrupt(shows_progress):
    if shows_progress:
        running.wait()
    else:
        time.sleep(0.4)
    sent.append(time.monotonic())
    os.kill(os.getpid(), signal.SIGINT)

def timed(call, **options):
    threading.Thread(target=interrupt, args=["progress" in options]).start()
    try:
        call(**options)
    except KeyboardInterrupt:
        print(time.monotonic() - sent[0])
    else:
        print("ended by itself")

def show(fraction):
    running.set()

belief = palpate.PoseHistogram(device, [grid], lattice)
if sys.argv[1] == "histogram":
    timed(lambda **options: belief.update([*training] * 20, **options), progress=show)
    try:
        belief.estimate()
    except palpate.Error as error:
        print(error)
    belief.reset()
    belief.update(training[0])
    assert belief.estimate().identity[0] == 1.0
elif sys.argv[1].startswith("bounds"):
    # One touch leaves most of a billion bins to look at: the search takes many seconds.
    large = palpate.PoseLattice((-40, 40, 1600), (-40, 40, 1600), (0, 6.28, 400))
    bounded = palpate.BoundedPosterior(device, [grid], large, tolerance=1e-7)
    bounded.update(training[0])
    if sys.argv[1] == "bounds":
        timed(bounded.estimate)
    else:
        timed(lambda: bounded.marginals(0, lattice))
    bounded.reset()
    bounded.update(training[100:109])
    assert bounded.estimate().identity[0] == 1.0
elif sys.argv[1] == "recognize":
    timed(lambda **options: palpate.recognize([training] * 20, grid, bins=(80, 80, 30),
                                              filter="histogram", device=device, **options),
          progress=show)
elif sys.argv[1] == "recognize bounds":
    timed(lambda: palpate.recognize(training[:1], grid, bins=(1600, 1600, 390), filter="bounded",
                                    x_mm=(-40, 40), y_mm=(-40, 40), device=device))
elif sys.argv[1] == "map":
    many = [*training] * 200
    timed(lambda **options: builder.add(many, **options), progress=show)
elif sys.argv[1] == "sensor":
    with palpate.open_sensor("simulate:E,rate=1") as sensor:
        timed(lambda: [sensor.next() for _ in range(100)])
"""


@pytest.mark.parametrize(
    "call",
    ["histogram", "recognize", "map", "sensor", "bounds", "bounds' marginals", "recognize bounds"],
)
def test_ctrl_c_ends_a_call_at_once(call: str, tmp_path: pathlib.Path) -> None:
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED)
    run = subprocess.run([sys.executable, script, call], capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    lines = run.stdout.splitlines()
    assert lines[0] != "ended by itself"
    # 0.2 s is the aim, and half a second of a CPU device. On a busy machine it may take longer, but not
    # as long as the call would.
    assert float(lines[0]) < (20.0 if call in ("histogram", "recognize") else 2.0)
    if call == "histogram":
        assert "reset" in lines[1]


def test_a_signal_handler_that_does_not_raise_ends_nothing(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    seen: list[int] = []
    before = signal.signal(signal.SIGUSR1, lambda number, frame: seen.append(number))
    try:
        timer = threading.Timer(0.05, lambda: os.kill(os.getpid(), signal.SIGUSR1))
        timer.start()
        belief = palpate.PoseHistogram(device, maps, LARGE)
        belief.update(unknown)
        timer.join()
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert seen == [signal.SIGUSR1]
    assert belief.estimate().identity.argmax() == 1
