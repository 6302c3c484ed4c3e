"""Objects keep what they need, and leave nothing behind; what a child of fork() has of its parent's objects
does not hang."""

import gc
import os

import numpy
import pytest
from conftest import Maps, python

import palpate

# What scripts of this file begin with.
BEGIN = """
import multiprocessing, os, sys, threading
import palpate

name = os.environ.get("PALPATE_DEVICE", "llvmpipe")
touches = palpate.simulate("E", seed=1)

def begun(device):
    builder = palpate.MapBuilder(device)
    builder.add(touches)
    grid = builder.build("E")
    return builder, grid, palpate.PoseHistogram(device, [grid])
"""


def resident_kib() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


def test_objects_outlive_their_device_and_their_arrays(maps: Maps, unknown: palpate.Recording) -> None:
    device = palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))
    builder = palpate.MapBuilder(device)
    beliefs = [
        palpate.PoseHistogram(device, list(maps)),
        palpate.ParticleFilter(device, maps, particles=200),
        palpate.BoundedPosterior(device, maps),
    ]
    del device
    gc.collect()
    arrays = (unknown[0].T_robot_sensor.copy(), unknown.elements_mm.copy(), unknown.pressure[0].copy())
    touch = palpate.Touch(*arrays)
    del arrays
    gc.collect()
    for belief in beliefs:
        belief.update(touch)
        assert belief.estimate().identity.sum() == pytest.approx(1.0, abs=1e-9)
    builder.add(unknown)
    assert builder.build("E").nx > 10


def test_a_thousand_constructions_take_no_memory(
    device: palpate.Device, maps: Maps, unknown: palpate.Recording
) -> None:
    lattice = palpate.PoseLattice((-5, 5, 10), (-5, 5, 10), (0, 6.28, 8))

    def construct(times: int) -> None:
        for i in range(times):
            recording = palpate.Recording(
                numpy.zeros((9, 36)), unknown.T_robot_sensor.copy(), unknown.elements_mm
            )
            touch = recording[3]
            palpate.PoseLattice((-5, 5, touch.pressure.size), (-5, 5, 10), (0, 6.28, 8))
            palpate.OccupancyGrid("A", maps[0].log_odds, cell_mm=0.5, origin_mm=(0, 0))
            if i % 20 == 0:  # these take long to make
                palpate.PoseHistogram(device, maps[:1], lattice).update(touch)
            with pytest.raises(palpate.Error):
                palpate.Touch((0, 0), unknown.elements_mm, unknown.pressure[0])

    construct(200)  # pools and caches fill
    gc.collect()
    before = resident_kib()
    construct(1000)
    gc.collect()
    # A leak of the array of a recording would take 2,600 KiB, of a map 26,000 KiB.
    assert resident_kib() - before < 2000


def test_a_call_keeps_what_it_reads(device: palpate.Device) -> None:
    given = [*palpate.simulate("E", seed=1)] * 10
    builder, undisturbed = palpate.MapBuilder(device), palpate.MapBuilder(device)
    undisturbed.add(given)
    shown: list[float] = []

    def show(fraction: float) -> None:
        shown.append(fraction)
        given.clear()

    builder.add(given, progress=show)
    assert len(shown) > 1
    assert numpy.array_equal(builder.build("E").log_odds, undisturbed.build("E").log_odds)


# A daemon thread is in a call when the interpreter ends.
ENDING = """
device = palpate.Device.open(name)
_, grid, _ = begun(device)
sensor = palpate.open_sensor("simulate:E,rate=1")
sensor.start()
at_work = threading.Event()

def recognize():
    palpate.recognize([touches] * 20, grid, bins=(60, 60, 60), filter="histogram", device=device,
                      progress=lambda fraction: at_work.set())

def sense():
    at_work.set()
    while True:
        sensor.next()

threading.Thread(target={"recognize": recognize, "sense": sense}[sys.argv[1]], daemon=True).start()
at_work.wait()
"""


# What is registered before palpate is imported runs after the interpreter's end has held its calls.
HELD = """
shown, begun_work, in_update = [], threading.Event(), threading.Event()

def recognize(progress):
    palpate.recognize([touches] * 5, grid, bins=(20, 20, 20), filter="bounded", progress=progress)

def show(fraction):
    shown.append(fraction)
    begun_work.set()

def for_ever():
    while True:
        recognize(show)

def end():
    recognize(lambda fraction: None)  # a callback that had begun goes on to its end meanwhile
    before = len(shown)
    for _ in range(5):
        recognize(lambda fraction: None)  # on the thread that ends the interpreter, which may
    print(len(shown) - before)
    try:
        belief.estimate()
    except palpate.Error as error:
        print(error)

_, grid, belief = begun(palpate.Device.open(name))
hold.append(end)
threading.Thread(target=for_ever, daemon=True).start()
threading.Thread(target=lambda: belief.update([*touches] * 200, progress=lambda fraction: in_update.set()),
                 daemon=True).start()
begun_work.wait()
in_update.wait()
"""


def test_the_interpreters_end_holds_calls_of_daemon_threads() -> None:
    before_palpate = "import atexit\nhold = []\natexit.register(lambda: hold[0]())\n"
    done = python(before_palpate + BEGIN + HELD)
    assert (done.returncode, done.stderr) == (0, "")
    went_on, refused = done.stdout.splitlines()
    assert went_on == "0"
    assert refused.startswith("a call of a daemon thread keeps this object")


@pytest.mark.parametrize("work", ["recognize", "sense"])
def test_the_interpreter_ends_while_daemon_threads_are_in_calls(work: str) -> None:
    done = python(BEGIN + ENDING, work)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


# What a child does, by the state of its parent: it prints what goes wrong, and leaves as Python does.
FORKED = """
def device_of_its_own(_=None):
    belief = begun(palpate.Device.open(name))[2]
    belief.update(touches[:3])
    return belief.estimate().identity.tolist()

def refused(*uses):
    for use in uses:
        try:
            print("not refused:", use())
        except palpate.Error as error:
            assert error.fault == "input"
            print(str(error).replace(" belongs to the parent process, whose devices do not survive "
                "fork(); open devices in the child alone, or start processes without fork (in "
                "Python with the start method \\"spawn\\")", ""))

def in_a_child(work):
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        work()
        sys.exit()
    print("child ended with", os.waitpid(child, 0)[1])

if sys.argv[1] == "closed":
    device_of_its_own()
    palpate.Device.list()
    in_a_child(lambda: print(device_of_its_own()))
    with multiprocessing.get_context("fork").Pool(2) as pool:
        print(pool.map(device_of_its_own, range(2)))
    sys.exit()

device = palpate.Device.open(name)
builder, grid, belief = begun(device)
particles = palpate.ParticleFilter(device, [grid], particles=100)
bounded = palpate.BoundedPosterior(device, [grid])
sensor = palpate.open_sensor("simulate:E")
sensor.start()
for each in (belief, particles, bounded):
    each.update(touches[:3])
    each.estimate()

def use_all():
    refused(lambda: belief.update(touches[3]), belief.estimate, lambda: belief.lattice,
            lambda: particles.update(touches[3]), bounded.estimate, lambda: builder.add(touches),
            lambda: palpate.PoseHistogram(device, [grid]), sensor.next,
            lambda: palpate.recognize(touches[:3], grid, device=device),
            lambda: palpate.Device.open(name), palpate.Device.list)
    print(repr(belief) == f"PoseHistogram(E on '{device.name}')", len(palpate.simulate("A")))

at_work = threading.Event()
over = threading.Event()

def show(fraction):
    at_work.set()
    if over.is_set():
        raise SystemExit

thread = threading.Thread(target=lambda: builder.add([*touches] * 100, progress=show))
thread.start()
at_work.wait()
in_a_child(use_all)
over.set()
thread.join()
belief.update(touches[3])  # the parent goes on
print(belief.estimate().identity.tolist())
"""

REFUSED = ["device:"] * 7 + ["sensor:", "device:", "Vulkan:", "Vulkan:", "True 192"]


@pytest.mark.parametrize(
    ("state", "lines"),
    [
        ("closed", ["[1.0]", "child ended with 0", "[[1.0], [1.0]]"]),
        ("at work", [*REFUSED, "child ended with 0", "[1.0]"]),
    ],
)
def test_a_child_of_fork_is_refused_at_once_or_works(state: str, lines: list[str]) -> None:
    done = python(BEGIN + FORKED, state, PYTHONWARNINGS="ignore")  # of forks beside threads
    assert (done.returncode, done.stdout.splitlines(), done.stderr) == (0, lines, "")
