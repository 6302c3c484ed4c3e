"""A machine without Vulkan: all that needs no device works."""

import os
import subprocess
import sys

SCRIPT = """
import palpate

touches = palpate.simulate("A", palpate.random_poses(3, seed=1))
assert len(touches) == 3
try:
    palpate.open_sensor("tsf85:none").start()
except palpate.Error as error:
    print(error)
for use in (palpate.Device.open, palpate.Device.list):
    try:
        use()
    except palpate.Error as error:
        assert error.fault == "system"
        print(error)
"""


def test_a_missing_loader_is_an_error_that_names_the_packages() -> None:
    library = "/nonexistent/libvulkan.so.1"
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env={**os.environ, "PALPATE_VULKAN_LIBRARY": library},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert run.returncode == 0, run.stderr
    board, *vulkan = run.stdout.splitlines()
    assert "not plugged in" in board
    assert len(vulkan) == 2
    for line in vulkan:
        assert line.startswith(f"Vulkan cannot be loaded: {library}: ")
        assert line.endswith("on Debian, install libvulkan1 and mesa-vulkan-drivers")
