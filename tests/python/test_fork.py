"""What a child of fork() has of its parent's objects: nothing that hangs."""

import os
import subprocess
import sys

import pytest

# What a child does, by the state of its parent: it prints what goes wrong, and leaves as Python does.
SCRIPT = """
import multiprocessing, os, sys, threading
import palpate

name = os.environ.get("PALPATE_DEVICE", "llvmpipe")
touches = palpate.simulate("E", seed=1)

def device_of_its_own(_=None):
    device = palpate.Device.open(name)
    builder = palpate.MapBuilder(device)
    builder.add(touches)
    belief = palpate.PoseHistogram(device, [builder.build("E")])
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
builder = palpate.MapBuilder(device)
builder.add(touches)
grid = builder.build("E")
belief = palpate.PoseHistogram(device, [grid])
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

if sys.argv[1] == "open":
    in_a_child(use_all)
elif sys.argv[1] == "at work":
    at_work = threading.Event()
    over = threading.Event()

    def show(fraction):
        at_work.set()
        if over.is_set():
            raise SystemExit

    thread = threading.Thread(target=lambda: builder.add([*touches] * 1000, progress=show))
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
        ("open", [*REFUSED, "child ended with 0", "[1.0]"]),
        ("at work", [*REFUSED, "child ended with 0", "[1.0]"]),
    ],
)
def test_a_child_of_fork_is_refused_at_once_or_works(state: str, lines: list[str]) -> None:
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, state],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},  # of forks beside threads
    )
    assert (run.returncode, run.stdout.splitlines(), run.stderr) == (0, lines, "")
