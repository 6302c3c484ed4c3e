"""Recognises by touch which known object lies where, and tells ROS 2."""

#: The node's parameters, which are arguments of the launch, too. README.md explains them.
PARAMETERS: dict[str, str | float] = {
    "maps": "maps",
    "recording": "recording.h5",
    "pressure_topic": "pressure",
    "pressure_type": "std_msgs/msg/Float32MultiArray",
    "pressure_field": "",
    "base_frame": "base_link",
    "array_frame": "array",
    "onset": 2.0,
    "tare_s": 0.5,
    "threshold": 0.0,
    "least_probability": 0.99,
}
