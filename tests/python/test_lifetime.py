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


def test_a_call_keeps_what_it_reads(device: palpate.Device) -> None:
    touches = palpate.simulate("E", seed=1)
    built = []
    for clears in (False, True):
        given = [*touches] * 20
        shown: list[float] = []

        def show(fraction: float, given: list[palpate.Touch] = given, clears: bool = clears) -> None:
            shown.append(fraction)
            if clears:
                given.clear()

        builder = palpate.MapBuilder(device)
        builder.add(given, progress=show)
        assert len(shown) > 1 and len(given) == (0 if clears else 20 * len(touches))
        built.append(builder.build("E").log_odds)
    assert numpy.array_equal(*built)


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


# A daemon thread is in a call when the interpreter ends.
DAEMON = """
import os, sys, threading, time
import palpate
device = palpate.Device.open(os.environ.get("PALPATE_DEVICE", "llvmpipe"))
touches = palpate.simulate("E", seed=1)
builder = palpate.MapBuilder(device)
builder.add(touches)
belief = palpate.PoseHistogram(device, [builder.build("E")])
sensor = palpate.open_sensor("simulate:E,rate=1")
sensor.start()
work = {"update": lambda: belief.update(touches[0]), "sensor": sensor.next}[sys.argv[1]]
begun = threading.Event()

def work_on():
    begun.set()
    while True:
        work()

threading.Thread(target=work_on, daemon=True).start()
begun.wait()
time.sleep(0.1)
"""


@pytest.mark.parametrize("work", ["update", "sensor"])
def test_the_interpreter_ends_while_daemon_threads_are_in_calls(work: str) -> None:
    run = subprocess.run(
        [sys.executable, "-c", DAEMON, work], capture_output=True, text=True, timeout=120
    )
    assert (run.returncode, run.stderr) == (0, "")
