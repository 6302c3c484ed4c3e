"""Long calls leave the interpreter to others, and stop."""

import os
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy
import pytest
import tqdm
from conftest import Maps, python

import palpate

# Updates by nine touches of this lattice take a tenth of a second and more.
LARGE = palpate.PoseLattice(x_mm=(-20, 20, 60), y_mm=(-20, 20, 60), theta_rad=(0, 6.28, 30))


def test_threads_share_a_device_and_a_belief(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording
) -> None:
    shared = palpate.PoseHistogram(device, maps)

    def work(_: int) -> None:
        palpate.PoseHistogram(device, maps).update(unknown)
        for _ in range(5):
            shared.update(unknown[0])
            shared.estimate()

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))  # raises what a thread does
    twenty = palpate.PoseHistogram(device, maps)
    for _ in range(20):
        twenty.update(unknown[0])
    assert numpy.array_equal(shared.log_likelihood(0), twenty.log_likelihood(0))


def test_progress_comes_on_the_calling_thread(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording
) -> None:
    belief = palpate.PoseHistogram(device, maps, LARGE)
    fractions: list[float] = []
    threads: set[int] = set()

    def show(fraction: float) -> None:
        fractions.append(fraction)
        threads.add(threading.get_ident())

    belief.update(unknown, progress=show)
    assert fractions[-1] == 1.0 and fractions == sorted(fractions)
    assert threads == {threading.get_ident()}
    with tqdm.tqdm(total=1.0, disable=False, file=open(os.devnull, "w")) as bar:
        palpate.recognize(unknown, maps, bins=(10, 10, 8), device=device,
                          progress=lambda fraction: bar.update(fraction - bar.n))  # fmt: skip
        assert bar.n == pytest.approx(1.0)


def test_what_progress_raises_ends_the_call(
    device: palpate.Device, belief: palpate.PoseHistogram, unknown: palpate.Recording
) -> None:
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


# Calls, each of which would take many seconds, one after the other. Another thread sends SIGINT when a call
# shows progress, or at once where it shows none, and again until the call ends. It must end with the
# KeyboardInterrupt within some seconds of the processor, and what it worked on must work on.
INTERRUPTED = """
import os, signal, threading, time
import palpate

device = palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))
training = palpate.simulate("E", seed=1)
builder = palpate.MapBuilder(device)
builder.add(training)
grid = builder.build("E")
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it

def interrupted(call, **options):
    running, ended, sent = threading.Event(), threading.Event(), []
    if not options:
        running.set()

    def interrupt():
        running.wait()
        while not ended.wait(0.2):
            sent.append(time.process_time())
            os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    try:
        call(**({"progress": lambda fraction: running.set()} if options else {}))
    except KeyboardInterrupt:
        seconds = time.process_time() - sent[0]
        ended.set()
        thread.join()
        # One submission to a CPU device may take some seconds.
        return "interrupted" if seconds < (20 if options else 4) else f"interrupted after {seconds} s"
    return "ended by itself"

lattice = palpate.PoseLattice((-40, 40, 80), (-40, 40, 80), (0, 6.28, 30))
belief = palpate.PoseHistogram(device, [grid], lattice)
print("histogram", interrupted(lambda **o: belief.update([*training] * 20, **o), progress=True))
try:
    belief.estimate()
except palpate.Error as error:
    print("reset" in str(error))
belief.reset()
belief.update(training[0])
print(belief.estimate().identity[0])

# One touch leaves most of a billion bins to look at: the search takes many seconds.
large = palpate.PoseLattice((-40, 40, 1600), (-40, 40, 1600), (0, 6.28, 400))
bounded = palpate.BoundedPosterior(device, [grid], large, tolerance=1e-7)
for name, ask in (("bounds", bounded.estimate), ("marginals", lambda: bounded.marginals(0, lattice))):
    bounded.reset()
    bounded.update(training[0])
    print(name, interrupted(ask))
bounded.reset()
bounded.update(training[100:109])
print(bounded.estimate().identity[0])

fine = {"bins": (80, 80, 30), "filter": "histogram", "device": device}
print("recognize", interrupted(lambda **o: palpate.recognize([training] * 20, grid, **fine, **o), progress=True))
wide = {"bins": (1600, 1600, 390), "filter": "bounded", "x_mm": (-40, 40), "y_mm": (-40, 40), "device": device}
print("recognize by bounds", interrupted(lambda: palpate.recognize(training[:1], grid, **wide)))
print("map", interrupted(lambda **o: builder.add([*training] * 200, **o), progress=True))
with palpate.open_sensor("simulate:E,rate=1") as sensor:
    print("sensor", interrupted(lambda: [sensor.next() for _ in range(100)]))
"""


def test_ctrl_c_ends_a_call() -> None:
    done = python(INTERRUPTED)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [
        "histogram interrupted", "True", "1.0", "bounds interrupted", "marginals interrupted", "1.0",
        "recognize interrupted", "recognize by bounds interrupted", "map interrupted", "sensor interrupted",
    ]  # fmt: skip
