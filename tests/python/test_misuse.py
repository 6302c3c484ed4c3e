"""What is misused raises the exception that Python has for it, and no call ends the process; without Vulkan, all
that needs no device works."""

import gc
import inspect
import pathlib
import weakref
from typing import Any

import numpy
import pytest
from conftest import Maps, error_of, python

import palpate
from palpate import _palpate, reference
from palpate.recognition import RecognitionOptions


class Raising:
    """Raises where Python asks it what it stands for."""

    def __fspath__(self) -> str:
        raise ZeroDivisionError

    def __index__(self) -> int:
        raise ZeroDivisionError


RECORDING = palpate.simulate("E", palpate.random_poses(4, seed=2))


def test_keywords_are_the_options_of_the_table() -> None:
    table = set(_palpate.Request.options())
    own = inspect.signature(palpate.recognize).parameters.keys() - {"recordings", "maps", "progress", "options"}
    assert own | RecognitionOptions.__annotations__.keys() == table
    assert not own & RecognitionOptions.__annotations__.keys()


@pytest.mark.parametrize(
    ("index", "error", "message"),
    [
        (slice(0, 1.5), TypeError, "slice indices must be integers"),
        (slice(None, None, 0), ValueError, "slice step cannot be zero"),
        (slice(Raising(), None), ZeroDivisionError, None),
        (1.0, TypeError, "index: is a float; give a whole number or a slice"),
        (10**30, IndexError, None),
        (4, IndexError, "touch 4 of 4"),
        (Raising(), ZeroDivisionError, None),
    ],
)
def test_an_index_that_is_none_is_refused(index: int, error: type[Exception], message: str | None) -> None:
    with pytest.raises(error, match=message):
        RECORDING[index]


def test_indices_and_slices_are_those_of_lists() -> None:
    all_poses = RECORDING.T_robot_sensor
    for part in (slice(None), slice(-10**30, 10**30), slice(3, None, -1), slice(3, 0, -2),
                 slice(None, -1), slice(2, 2)):  # fmt: skip
        assert numpy.array_equal(RECORDING[part].T_robot_sensor, all_poses[part]), part
        assert len(RECORDING[part]) == len(range(4)[part])
    assert numpy.array_equal(RECORDING[numpy.int8(-4)].T_robot_sensor, all_poses[0])


def test_an_axis_or_a_displacement_of_another_form_is_refused_by_name(
    device: palpate.Device, maps: Maps
) -> None:
    for axis in ((0, 1), (0, 1, 2.5), "abc", (0, 1, 10**30)):
        for name in ("x_mm", "y_mm", "theta_rad"):
            with pytest.raises(TypeError, match=rf"^{name}: give an Axis or \(lower, upper, count\)"):
                palpate.PoseLattice(**{name: axis})
    histogram, bounded = palpate.PoseHistogram, palpate.BoundedPosterior
    for belief, name in ((histogram, "touch_sd"), (histogram, "slip_sd"), (bounded, "touch_sd")):
        with pytest.raises(TypeError, match=rf"^{name}: give a DisplacementSd or \(mm, rad\)"):
            belief(device, maps, **{name: (1,)})  # type: ignore[operator]


def test_what_a_path_raises_is_raised(tmp_path: pathlib.Path) -> None:
    for use in (palpate.read_map, palpate.read_recording, RECORDING.save, palpate.open_sensor,
                palpate.simulate, lambda path: palpate.recognize(RECORDING, path)):  # fmt: skip
        for path, error in ((Raising(), ZeroDivisionError), (f"{tmp_path}/a\0b", ValueError), (3, TypeError)):
            with pytest.raises(error):
                use(path)


def test_a_proxy_to_what_is_gone_is_refused(belief: palpate.PoseHistogram, maps: Maps) -> None:
    gone = weakref.proxy(RECORDING[:2])
    gc.collect()
    for use in (belief.update, lambda gone: palpate.recognize(gone, maps),
                lambda gone: _palpate.write_recording("none.h5", gone),
                lambda gone: reference.classify(gone, palpate.ContactClassifier())):  # fmt: skip
        with pytest.raises((ReferenceError, TypeError)):
            use(gone)


def test_a_flag_of_another_type_is_refused_by_name() -> None:
    flags: list[tuple[str, Any, str]] = [
        ("seed", -1, "int"), ("prior", "a", "float"), ("touches", 1.5, "int"), ("bins", 3, "tuple"),
        ("sensor_model", 3, "str"),
    ]  # fmt: skip
    for name, value, wanted in flags:
        with pytest.raises(TypeError, match=f"^{name}: {value!r}; give .*{wanted}"):
            palpate.recognize(RECORDING, (), **{name: value})


def test_a_bad_option_is_told_before_recordings_are_read(maps: Maps) -> None:
    assert error_of(palpate.recognize, "none.h5", maps, scene="none.yaml").startswith("none.yaml: ")


def test_progress_and_timeouts_are_checked_before_the_work(belief: palpate.PoseHistogram) -> None:
    with pytest.raises(TypeError):
        belief.update(RECORDING, progress=3)  # type: ignore[arg-type]
    assert belief.estimate().identity.max() == pytest.approx(1 / 3)  # nothing was taken in
    sensor = palpate.open_sensor("simulate:E")
    with pytest.raises(ValueError, match="timeout_s: is not a number"):
        sensor.next(numpy.nan)
    assert sensor.next(1e300) is not None
    assert "no frame came" in error_of(palpate.baseline_of, [], sensor)


WITHOUT_VULKAN = """
import palpate
print(len(palpate.simulate("A")))
try:
    palpate.Device.open()
except palpate.Error as error:
    print(f"{error.fault}: {error}")
"""


def test_a_missing_loader_of_vulkan_is_the_machines_fault_where_a_device_is_asked_for() -> None:
    library = "/nonexistent/libvulkan.so.1"
    done = python(WITHOUT_VULKAN, PALPATE_VULKAN_LIBRARY=library)
    assert done.stdout.startswith(f"192\nsystem: Vulkan cannot be loaded: {library}: "), done.stderr
