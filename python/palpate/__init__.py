"""Recognise objects by touch and find their planar poses, on Vulkan.

Poses are arrays (x_mm, y_mm, theta_rad); T_a_b maps coordinates in frame b to frame a. Lengths are in
mm, angles in rad, times in s, log quantities in nats; pressures are in kPa or the sensor's raw unit.
Frames: robot, sensor, object. What is wrong with data, files or the machine raises `Error`; misuse
raises TypeError, ValueError or IndexError.

Arrays of float64 with C layout are read in place and results are views of the memory that C++ filled,
where nothing else is said. Long calls release the GIL, call `progress(fraction)` where they take it,
and end with KeyboardInterrupt on Ctrl-C.
"""

from importlib.metadata import PackageNotFoundError, version

from ._error import Error
from ._palpate import (
    Axis,
    BoundedPosterior,
    Certificate,
    ContactClassifier,
    ContactModel,
    DetectedTouch,
    Device,
    DeviceInfo,
    DisplacementSd,
    Estimate,
    Frame,
    Hypothesis,
    InverseSensorModel,
    MapBuilder,
    Marginals,
    Mode,
    OccupancyGrid,
    ParticleFilter,
    PoseHistogram,
    PoseLattice,
    PoseSample,
    Recording,
    RefinedPose,
    Resampling,
    Sensor,
    SensorModel,
    Touch,
    TouchDetector,
    TouchGains,
    Truth,
    balanced_lattice,
    baseline_of,
    compose,
    digitacts_array,
    estimate_prior,
    grid_array,
    inverse,
    measure_symmetry,
    open_sensor,
    pose_error_mm,
    random_object_pose,
    random_poses,
    read_map,
    read_recording,
    simulate,
    touch_region,
    training_grid,
    transform,
)
from .many import Recognized, Task, recognize_many
from .recognition import Record, recognize
from .streams import touches

try:
    __version__ = version("palpate")
except PackageNotFoundError:  # in the build folder
    __version__ = "0"

__all__ = [
    "Axis",
    "BoundedPosterior",
    "Certificate",
    "ContactClassifier",
    "ContactModel",
    "DetectedTouch",
    "Device",
    "DeviceInfo",
    "DisplacementSd",
    "Error",
    "Estimate",
    "Frame",
    "Hypothesis",
    "InverseSensorModel",
    "MapBuilder",
    "Marginals",
    "Mode",
    "OccupancyGrid",
    "ParticleFilter",
    "PoseHistogram",
    "PoseLattice",
    "PoseSample",
    "Recognized",
    "Record",
    "Recording",
    "RefinedPose",
    "Resampling",
    "Sensor",
    "SensorModel",
    "Task",
    "Touch",
    "TouchDetector",
    "TouchGains",
    "Truth",
    "balanced_lattice",
    "baseline_of",
    "compose",
    "digitacts_array",
    "estimate_prior",
    "grid_array",
    "inverse",
    "measure_symmetry",
    "open_sensor",
    "pose_error_mm",
    "random_object_pose",
    "random_poses",
    "read_map",
    "read_recording",
    "recognize",
    "recognize_many",
    "simulate",
    "touch_region",
    "touches",
    "training_grid",
    "transform",
]
