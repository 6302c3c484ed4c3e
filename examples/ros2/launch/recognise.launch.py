"""ros2 launch palpate_ros2 recognise.launch.py maps:=maps recording:=E.h5 pressure_topic:=/taxels ..."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

TEXTS = {
    "maps": "maps",
    "recording": "recording.h5",
    "pressure_topic": "pressure",
    "pressure_type": "std_msgs/msg/Float32MultiArray",
    "pressure_field": "",
    "base_frame": "base_link",
    "array_frame": "array",
}
NUMBERS = {"onset": "2.0", "tare_s": "0.5", "threshold": "0.0", "least_probability": "0.99"}


def generate_launch_description() -> LaunchDescription:
    """The node, its parameters as arguments of the launch."""
    arguments = [
        DeclareLaunchArgument(name, default_value=value) for name, value in {**TEXTS, **NUMBERS}.items()
    ]
    values = {name: ParameterValue(LaunchConfiguration(name), value_type=str) for name in TEXTS}
    values |= {name: ParameterValue(LaunchConfiguration(name), value_type=float) for name in NUMBERS}
    node = Node(package="palpate_ros2", executable="recognise", output="screen", parameters=[values])
    return LaunchDescription([*arguments, node])
