"""ros2 launch palpate_ros2 recognise.launch.py maps:=maps recording:=E.h5 pressure_topic:=/taxels ..."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from palpate_ros2 import PARAMETERS


def generate_launch_description() -> LaunchDescription:
    """The node, its parameters as arguments of the launch."""
    arguments = [DeclareLaunchArgument(name, default_value=str(value)) for name, value in PARAMETERS.items()]
    values = {
        name: ParameterValue(LaunchConfiguration(name), value_type=type(value))
        for name, value in PARAMETERS.items()
    }
    node = Node(package="palpate_ros2", executable="recognise", output="screen", parameters=[values])
    return LaunchDescription([*arguments, node])
