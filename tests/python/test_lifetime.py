"""Objects keep what they need, and leave nothing behind."""

import gc
import os
import subprocess
import sys

import numpy
import pytest

import palpate


def resident_kib() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


def test_objects_outlive_their_device_and_their_arrays(
    maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
) -> None:
    device = palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))
    belief = palpate.PoseHistogram(device, list(maps))
    builder = palpate.MapBuilder(device)
    particles = palpate.ParticleFilter(device, maps, particles=200)
    bounded = palpate.BoundedPosterior(device, maps)
    del device
    gc.collect()
    touch = palpate.Touch(unknown[0].T_robot_sensor.copy(), unknown.elements_mm.copy(),
                          unknown.pressure[0].copy())  # fmt: skip
    gc.collect()
    for belief_of in (belief, particles, bounded):
        belief_of.update(touch)
        assert belief_of.estimate().identity.sum() == pytest.approx(1.0, abs=1e-9)
    builder.add(unknown)
    assert builder.build("E").nx > 10


def test_a_view_outlives_its_object(device: palpate.Device) -> None:
    builder = palpate.MapBuilder(device)
    builder.add(palpate.simulate("A", seed=1))
    grid = builder.build("A")
    cells = grid.log_odds
    expected = cells.copy()
    del grid
    gc.collect()
    builder.build("A")
    assert numpy.array_equal(cells, expected)


def test_a_thousand_constructions_take_no_memory(
    device: palpate.Device, maps: list[palpate.OccupancyGrid], unknown: palpate.Recording
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


def test_a_call_keeps_what_it_reads_and_frees_what_was_dropped_meanwhile(
    device: palpate.Device, maps: list[palpate.OccupancyGrid]
) -> None:
    touches = palpate.simulate("E", seed=1)
    pressure = numpy.tile(touches.pressure, (100, 1))
    recording = palpate.Recording(pressure, numpy.tile(touches.T_robot_sensor, (100, 1)),
                                  touches.elements_mm, valid=pressure > -1)  # fmt: skip
    read = [recording.pressure, recording.T_robot_sensor, recording.elements_mm, recording.valid]
    before = [sys.getrefcount(array) for array in read]
    # 100 MiB, which nobody can free while the device works for another.
    large = [palpate.PoseHistogram(device, maps[:1], palpate.PoseLattice(
        (-5, 5, 512), (-5, 5, 512), (0, 6.28, 100)))]  # fmt: skip
    during: list[int] = []

    def drop(fraction: float) -> None:
        during.extend(sys.getrefcount(array) for array in read)
        large.clear()
        during.append(resident_kib())
        raise StopIteration

    builder = palpate.MapBuilder(device)
    with pytest.raises(StopIteration):
        builder.add(recording, progress=drop)
    builder.clear()  # waits for the end of the work
    held = during.pop()
    assert all(now > then for now, then in zip(during, before, strict=True))
    assert held - resident_kib() > 70_000


def test_the_interpreter_ends_during_work_and_with_live_objects() -> None:
    script = """
import _thread, os, threading, time
import palpate
device = palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))
builder = palpate.MapBuilder(device)
builder.add(palpate.simulate("A"))
belief = palpate.PoseHistogram(device, [builder.build("A")],
                               palpate.PoseLattice((-40, 40, 300), (-40, 40, 300), (0, 6.28, 60)))
threading.Timer(0.2, _thread.interrupt_main).start()
try:
    belief.update(palpate.simulate("A")[:20])
except KeyboardInterrupt:
    print("interrupted")
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert (run.returncode, run.stdout, run.stderr) == (0, "interrupted\n", "")


# What a daemon thread does over and over, by name.
DAEMON = """
import os, sys, threading, time
import numpy, palpate
from palpate import reference
device = palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))
touches = palpate.simulate("E", seed=1)
builder = palpate.MapBuilder(device)
builder.add(touches)
grid = builder.build("E")
lattice = palpate.PoseLattice((-20, 20, 40), (-20, 20, 40), (0, 6.28, 30))
belief = palpate.PoseHistogram(device, [grid], lattice)
# One touch leaves most of a billion bins to look at: the search takes many seconds.
bounded = palpate.BoundedPosterior(device, [grid], palpate.PoseLattice(
    (-40, 40, 1600), (-40, 40, 1600), (0, 6.28, 400)), tolerance=1e-7)
bounded.update(touches[0])
sensor = palpate.open_sensor("simulate:E,rate=1")
pressure = numpy.ma.masked_array(touches.pressure[0], mask=False)

def busy(fraction):
    end = time.monotonic() + 5
    while time.monotonic() < end:
        sum(range(100))

def made_in_python():
    while True:
        sum(range(1000))
        yield touches[0]

work = {
    "update": lambda: belief.update(touches),
    "short updates": lambda: belief.update(touches[0]),
    "busy progress": lambda: belief.update(touches, progress=busy),
    "sleeping progress": lambda: belief.update(touches, progress=lambda fraction: time.sleep(100)),
    "search": bounded.estimate,
    "recognize": lambda: palpate.recognize(touches, grid, bins=(40, 40, 30), device=device,
                                           filter="histogram"),
    "sensor": sensor.next,
    "touches of Python": lambda: belief.update(made_in_python()),
    "arrays": lambda: palpate.Touch((0, 0, 0), touches.elements_mm, pressure),
    "reference": lambda: reference.log_likelihoods(touches[:2], palpate.PoseLattice(), grid),
}[sys.argv[1]]
begun = threading.Semaphore(0)

def work_on():
    begun.release()
    while True:
        work()

sensor.start()
for _ in range(2):
    threading.Thread(target=work_on, daemon=True).start()
    begun.acquire()
time.sleep(0.1)
"""


@pytest.mark.parametrize(
    "work",
    ["update", "short updates", "busy progress", "sleeping progress", "search", "recognize", "sensor",
     "touches of Python", "arrays", "reference"],
)  # fmt: skip
def test_the_interpreter_ends_while_daemon_threads_are_in_calls(work: str) -> None:
    run = subprocess.run(
        [sys.executable, "-c", DAEMON, work], capture_output=True, text=True, timeout=120
    )
    assert (run.returncode, run.stderr) == (0, "")
