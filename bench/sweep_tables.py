"""The tables of the sweep's document: their columns."""

from palpate._tables import (
    Column,
    count_text,
    difference_text,
    mean_text,
    number,
    plain,
    seconds_text,
)

_MIB = number(".1f", 1.0 / (1 << 20))
_MM = number(".3f")
_NATS = number(".1e")
_PERCENT = number(".0f", 100.0)

RUNS: list[Column] = [
    ("filter", "filter", plain),
    ("map cells, mm", "cell_mm", plain),
    ("bins per object, or particles", "count", count_text),
    ("bins", "bins", plain),
    ("trials", "trials", plain),
    ("in full", "full_trials", plain),
    ("time per touch", "seconds_per_touch", seconds_text),
    ("per unknown", "seconds_per_unknown", seconds_text),
    ("per refined pose", "seconds_refine", seconds_text),
    ("memory, MiB", "device_bytes", _MIB),
    ("recognised, %", "accuracy", _PERCENT),
    ("calibration error", "expected_calibration_error", _MM),
    ("located", "error_mm/trials", plain),
    ("mode: mean error, mm", "error_mm", mean_text),
    ("95 %", "error_mm/p95", _MM),
    ("refined: mean error, mm", "refined_error_mm", mean_text),
    ("95 %", "refined_error_mm/p95", _MM),
    ("nearest bin, mm", "nearest_bin_mm", _MM),
    ("largest deviation, nats", "deviation_nats/largest", _NATS),
    ("RMS", "deviation_nats/rms", _NATS),
]
BOUNDS: list[Column] = [
    ("bins per object", "count", count_text),
    ("bins in all", "bins_in_all", count_text),
    ("trials", "trials", plain),
    ("histogram, asked once", "histogram/once", seconds_text),
    ("bounded", "bounded/once", seconds_text),
    ("histogram, after each touch", "histogram/each_touch", seconds_text),
    ("bounded", "bounded/each_touch", seconds_text),
    ("bins evaluated", "bins_evaluated", count_text),
    ("of all, %", "share_evaluated", number(".3g", 100.0)),
    ("certificate", "certificate", _NATS),
    ("measured error", "measured_error", _NATS),
    ("certificates that hold", "certificates_hold", plain),
    ("same mode", "same_modes", plain),
    ("host memory, MiB", "host_bytes", _MIB),
    ("--filter auto takes", "auto", plain),
    ("the faster one", "auto_is_faster", plain),
]
LIMITS: list[Column] = [
    ("what is changed", "name", plain),
    ("elements", "elements", plain),
    ("bins per object", "count", count_text),
    ("mode: mean error, mm", "error_mm", mean_text),
    ("refined: mean error, mm", "refined_error_mm", mean_text),
    ("compared with", "against", plain),
    ("mode: difference, mm", "difference_mm", difference_text),
    ("refined: difference, mm", "refined_difference_mm", difference_text),
]


def _step_text(step: dict[str, float]) -> str:
    change = 100.0 * (step["to"] / step["from"] - 1.0) if step["from"] > 0.0 else 0.0
    return f"{step['from']:.3f} to {step['to']:.3f} ({change:+.0f} %)"


STEPS: list[Column] = [
    ("map cells, mm", "cell_mm", plain),
    ("from bins", "from", count_text),
    ("to bins", "to", count_text),
    ("trials", "trials", plain),
    ("mode: mean error, mm", "error_mm", _step_text),
    ("difference, mm", "error_mm", difference_text),
    ("refined: mean error, mm", "refined_error_mm", _step_text),
    ("difference, mm", "refined_error_mm", difference_text),
]
VERDICTS: list[Column] = [
    ("goal", "name", plain),
    ("measured, mm", "value", _MM),
    ("at most", "at_most", plain),
    ("reached", "reached", plain),
]
