"""The node `recognise`: pressures and /tf in, the touched object and its pose out."""

import pathlib
from typing import Any

import palpate
import rclpy
from palpate.bag import readings, stamp_s
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosidl_runtime_py.utilities import get_message
from std_srvs.srv import Trigger
from tf2_ros import Buffer, TransformException, TransformListener

from . import PARAMETERS
from .conversion import map_message, marker_messages, nanoseconds_of, pose_message
from .session import Session, planar_pose


def new(name: str) -> Any:
    """An empty message of a type such as "nav_msgs/msg/OccupancyGrid"."""
    return get_message(name)()


class Recognise(Node):  # type: ignore[misc]  # of rclpy, which mypy may not find
    """Recognises after every touch. README.md lists the parameters."""

    def __init__(self) -> None:
        super().__init__("recognise")
        given: dict[str, Any] = {
            name: self.declare_parameter(name, default).value for name, default in PARAMETERS.items()
        }
        self.base, self.sensor_frame = given["base_frame"], given["array_frame"]
        self.type, self.field = given["pressure_type"], given["pressure_field"]
        self.least_probability = given["least_probability"]
        maps = sorted(pathlib.Path(given["maps"]).glob("*.map.h5"))
        if not maps:
            raise palpate.Error("maps: holds no *.map.h5; give a folder that `palpate map` has written")
        self.session = Session(
            palpate.read_recording(given["recording"]),
            [palpate.read_map(path) for path in maps],
            onset=given["onset"],
            tare_s=given["tare_s"],
            options={"none": "auto", "threshold": given["threshold"] or None},
        )
        self.tf = Buffer()
        self.listener = TransformListener(self.tf, self)
        latest = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.pose = self._publisher("geometry_msgs/msg/PoseWithCovarianceStamped", "~/pose", 10)
        self.map = self._publisher("nav_msgs/msg/OccupancyGrid", "~/map", latest)
        self.markers = self._publisher("visualization_msgs/msg/MarkerArray", "~/markers", latest)
        # Frames wait here while an estimate is under way.
        waiting = QoSProfile(depth=2000, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.create_subscription(get_message(self.type), given["pressure_topic"], self.take, waiting)
        self.create_service(Trigger, "~/next_unknown", self.next_unknown)

    def _publisher(self, kind: str, topic: str, qos: Any) -> Any:
        return self.create_publisher(get_message(kind), topic, qos)

    def next_unknown(self, _: Any, response: Any) -> Any:
        """The touches to come are of another object."""
        response.success, response.message = True, f"forgot {self.session.touches} touches"
        self.session.next_unknown()
        return response

    def take(self, message: Any) -> None:
        """Takes a frame, and recognises where a touch ends with it."""
        time_s = stamp_s(message.header.stamp) if hasattr(message, "header") else 0.0
        if time_s <= 0.0:
            time_s = 1e-9 * self.get_clock().now().nanoseconds
        try:
            touch = self.session.add(time_s, readings(message, self.type, self.field))
            if touch is not None:
                self.recognise(touch)
        except (palpate.Error, TransformException) as error:
            self.get_logger().warning(str(error), throttle_duration_sec=1.0)

    def recognise(self, touch: palpate.DetectedTouch) -> None:
        """Recognises with the pose in the middle of the touch's steady phase, and publishes."""
        middle = Time(nanoseconds=nanoseconds_of((touch.begin_s + touch.end_s) / 2))
        patience = Duration(seconds=0.2)
        transform = self.tf.lookup_transform(self.base, self.sensor_frame, middle, patience)
        T_robot_sensor, z_m = planar_pose(transform.transform)
        record = self.session.recognise(touch, T_robot_sensor)
        if "fit" not in record:
            raise palpate.Error("no touch has an element in contact; press harder, or give a lower threshold")
        probability = record.identity[record.best]
        self.get_logger().info(
            f"touch {self.session.touches}: {record.best} with probability {probability:.3f}, "
            f"{record.fit.verdict}"
        )
        for warning in record.get("warnings", ()):
            self.get_logger().warning(warning)
        grid = self.session.map_of(record.best)
        if grid is None:
            return  # "(none)": a stranger has neither a map nor a pose
        where = (self.base, touch.end_s, z_m)
        elements_mm = self.session.array.elements_mm
        self.map.publish(map_message(new, grid, record, *where))
        self.markers.publish(marker_messages(new, record, elements_mm, T_robot_sensor, *where))
        if probability >= self.least_probability and record.fit.verdict == "fits":
            self.pose.publish(pose_message(new, record, *where))


def main() -> None:
    """Runs the node until Ctrl-C."""
    rclpy.init()
    try:
        # A second thread hears /tf while the first one recognises.
        rclpy.spin(Recognise(), MultiThreadedExecutor(num_threads=2))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except (palpate.Error, OSError) as error:
        raise SystemExit(f"recognise: {error}") from None
    finally:
        rclpy.try_shutdown()
