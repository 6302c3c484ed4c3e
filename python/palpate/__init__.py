"""Recognise objects by touch and find their planar poses, on Vulkan.

Poses are arrays (x_mm, y_mm, theta_rad); T_a_b maps coordinates in frame b to frame a. Lengths are in
mm, angles in rad, times in s, log quantities in nats; pressures are in kPa or the sensor's raw unit.
Frames: robot, sensor, object. What is wrong with data, files or the machine raises `Error`; misuse
raises TypeError, ValueError or IndexError.

Arrays of float64 with C layout are read in place and results are views of the memory that C++ filled,
where nothing else is said. Long calls release the GIL, call `progress(fraction)` where they take it,
and end with KeyboardInterrupt on Ctrl-C.
"""

from importlib import metadata

from ._error import Error as Error
from ._palpate import (
    Axis as Axis,
    BoundedPosterior as BoundedPosterior,
    Certificate as Certificate,
    ContactClassifier as ContactClassifier,
    ContactModel as ContactModel,
    DetectedTouch as DetectedTouch,
    Device as Device,
    DeviceInfo as DeviceInfo,
    DisplacementSd as DisplacementSd,
    Estimate as Estimate,
    Frame as Frame,
    Hypothesis as Hypothesis,
    InverseSensorModel as InverseSensorModel,
    LearnedSensor as LearnedSensor,
    MapBuilder as MapBuilder,
    Marginals as Marginals,
    Mode as Mode,
    OccupancyGrid as OccupancyGrid,
    ParticleFilter as ParticleFilter,
    PoseHistogram as PoseHistogram,
    PoseLattice as PoseLattice,
    PoseSample as PoseSample,
    RefinedPose as RefinedPose,
    Resampling as Resampling,
    Sensor as Sensor,
    SensorModel as SensorModel,
    TouchDetector as TouchDetector,
    TouchGains as TouchGains,
    Truth as Truth,
    balanced_lattice as balanced_lattice,
    baseline_of as baseline_of,
    compose as compose,
    digitacts_array as digitacts_array,
    estimate_prior as estimate_prior,
    grid_array as grid_array,
    inverse as inverse,
    measure_symmetry as measure_symmetry,
    open_sensor as open_sensor,
    pose_error_mm as pose_error_mm,
    random_object_pose as random_object_pose,
    random_poses as random_poses,
    read_map as read_map,
    read_recording as read_recording,
    simulate as simulate,
    touch_region as touch_region,
    training_grid as training_grid,
    transform as transform,
)
from ._bag import read_bag as read_bag
from ._recording import Recording as Recording, Touch as Touch
from .commands import (
    LearnedMaps as LearnedMaps,
    calibrate as calibrate,
    check_setup as check_setup,
    evaluate as evaluate,
    import_tables as import_tables,
    learn_maps as learn_maps,
    plan as plan,
)
from .many import (
    Recognized as Recognized,
    Task as Task,
    recognize_many as recognize_many,
)
from .recognition import (
    RecognitionOptions as RecognitionOptions,
    recognize as recognize,
)
from .results import (
    Evaluation as Evaluation,
    GroupScores as GroupScores,
    Plan as Plan,
    Record as Record,
    Scores as Scores,
    SensorCalibration as SensorCalibration,
    SetupCheck as SetupCheck,
)
from .show import Page as Page, show as show
from .streams import touches as touches

try:
    __version__ = metadata.version("palpate")
except metadata.PackageNotFoundError:  # in the build folder
    __version__ = "0"

__all__ = sorted(name for name, value in globals().items() if name[0] != "_" and callable(value))
