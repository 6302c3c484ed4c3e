"""Writes bags, as robots do."""

import math
import pathlib
from typing import Any

import numpy
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_S = 1_700_000_000.0
#: A custom type, which only the bag knows: taxels in fingers, and a list that is no pressure.
CUSTOM = """
std_msgs/Header header
int32[2] serial
lab_msgs/Finger[] fingers
================================================================================
MSG: lab_msgs/Finger
string name
uint16[] taxels
"""


#: Types that are known by their names, as their packages define them, shortened.
KNOWN = {
    "tactile_msgs/msg/TactileState": """
std_msgs/Header header
sensor_msgs/ChannelFloat32[] sensors
""",
    "lab_msgs/msg/State": """
std_msgs/Header header
float64[16] O_T_EE
geometry_msgs/Pose tool
lab_msgs/Pad[] pads
================================================================================
MSG: lab_msgs/Pad
string name
float32[] values
bool[] valid
""",
    "takktile_ros/msg/Touch": "float32[] pressure\nfloat32[] temp\n",
    "xela_server_ros2/msg/SensStream": """
xela_server_ros2/SensorFull[] sensors
================================================================================
MSG: xela_server_ros2/SensorFull
float64 time
xela_server_ros2/Taxel[] taxels
int32[] other
================================================================================
MSG: xela_server_ros2/Taxel
uint16 x
uint16 y
uint16 z
""",
}


class Bag:
    """Writes a bag of ROS 1, or of ROS 2 in either storage."""

    def __init__(self, path: pathlib.Path, storage: str) -> None:
        self.ros1 = storage == "bag"
        store = Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE
        self.types = get_typestore(store)
        self.types.register(get_types_from_msg(CUSTOM, "lab_msgs/msg/Hand"))
        for name, text in KNOWN.items():
            self.types.register(get_types_from_msg(text, name))
        if self.ros1:
            tree = "geometry_msgs/TransformStamped[] transforms"
            self.types.register(get_types_from_msg(tree, "tf2_msgs/msg/TFMessage"))
        self.path = path / ("log.bag" if self.ros1 else storage)
        if self.ros1:
            self.writer: Any = Writer1(self.path)
        else:
            plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
            self.writer = Writer2(self.path, version=9, storage_plugin=plugin)
        self.writer.open()
        self.connections: dict[str, Any] = {}

    def of(self, name: str, *values: Any, **named: Any) -> Any:
        return self.types.types[name](*values, **named)

    def stamp(self, time_s: float) -> Any:
        return self.of("builtin_interfaces/msg/Time", int(time_s), round(1e9 * (time_s - int(time_s))))

    def header(self, time_s: float, frame: str = "") -> Any:
        extra = {"seq": 0} if self.ros1 else {}
        return self.of("std_msgs/msg/Header", stamp=self.stamp(time_s), frame_id=frame, **extra)

    def pose(self, kind: str, x: float, y: float, z: float, turn: numpy.ndarray) -> Any:
        q = self.of("geometry_msgs/msg/Quaternion", *turn)
        if kind == "Pose":
            return self.of("geometry_msgs/msg/Pose", self.of("geometry_msgs/msg/Point", x, y, z), q)
        vector = self.of("geometry_msgs/msg/Vector3", x, y, z)
        return self.of("geometry_msgs/msg/Transform", vector, q)

    def plain(self, topic: str, values: Any, received_s: float) -> None:
        """Writes readings without a time of their own."""
        layout = self.of("std_msgs/msg/MultiArrayLayout", [], 0)
        row = numpy.array(values, dtype=numpy.float32)
        self.write(topic, self.of("std_msgs/msg/Float32MultiArray", layout, row), received_s)

    def edge(self, parent: str, child: str, stamp_s: float, *place: Any) -> Any:
        """T_parent_child: x, y, z in m, and a rotation."""
        header, transform = self.header(stamp_s, parent), self.pose("Transform", *place)
        return self.of("geometry_msgs/msg/TransformStamped", header, child, transform)

    def frames(self, topic: str, edges: list[Any], received_s: float) -> None:
        self.write(topic, self.of("tf2_msgs/msg/TFMessage", edges), received_s)

    def stamped_pose(self, topic: str, stamp_s: float, received_s: float, *place: Any) -> None:
        header, pose = self.header(stamp_s, "base"), self.pose("Pose", *place)
        self.write(topic, self.of("geometry_msgs/msg/PoseStamped", header, pose), received_s)

    def write(self, topic: str, message: Any, received_s: float) -> None:
        name = message.__msgtype__
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(topic, name, typestore=self.types)
        serialize = self.types.serialize_ros1 if self.ros1 else self.types.serialize_cdr
        self.writer.write(self.connections[topic], round(1e9 * received_s), serialize(message, name))

    def close(self) -> pathlib.Path:
        self.writer.close()
        return self.path


def about_z(theta: float) -> numpy.ndarray:
    return numpy.array([0.0, 0.0, math.sin(theta / 2), math.cos(theta / 2)])


#: A tool that points down: half a turn about x, then theta about the robot's z.
def pointing_down(theta: float) -> numpy.ndarray:
    return numpy.array([math.cos(theta / 2), math.sin(theta / 2), 0.0, 0.0])
