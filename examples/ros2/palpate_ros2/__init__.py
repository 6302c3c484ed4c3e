"""Recognises by touch which known object lies where, and tells ROS 2."""
