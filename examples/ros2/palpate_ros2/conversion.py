"""Messages of ROS from Palpate's results. Knows no ROS: new(type) makes an empty message of a type.

Poses are in the robot's base frame; messages are in metres, Palpate's results in mm.
"""

import math
from array import array
from collections.abc import Callable
from typing import Any

import numpy
import palpate
from numpy.typing import NDArray

from .session import covariance_of

New = Callable[[str], Any]

#: So many standard deviations about its mean hold 95 % of a normal distribution over a plane.
_SD_OF_95 = math.sqrt(-2 * math.log(0.05))


def nanoseconds_of(time_s: float) -> int:
    """A time since 1970, whose nanoseconds alone float64 cannot count, but whose seconds it can."""
    return int(time_s) * 10**9 + round(1e9 * (time_s % 1.0))


def _fill_header(header: Any, frame_id: str, time_s: float) -> None:
    header.frame_id = frame_id
    header.stamp.sec, header.stamp.nanosec = divmod(nanoseconds_of(time_s), 10**9)


def _fill_pose(pose: Any, x_mm: float, y_mm: float, theta_rad: float, z_m: float) -> None:
    pose.position.x, pose.position.y, pose.position.z = 1e-3 * x_mm, 1e-3 * y_mm, z_m
    pose.orientation.x = pose.orientation.y = 0.0
    pose.orientation.z, pose.orientation.w = math.sin(theta_rad / 2), math.cos(theta_rad / 2)


def pose_message(new: New, record: palpate.Record, frame_id: str, time_s: float, z_m: float) -> Any:
    """geometry_msgs/PoseWithCovarianceStamped of the object's frame, T_robot_object.

    The covariance is of (x, y, z, roll, pitch, yaw), row by row, in m and rad. z, roll and pitch are
    those of the plane of the touches; their entries are 0.
    """
    message = new("geometry_msgs/msg/PoseWithCovarianceStamped")
    _fill_header(message.header, frame_id, time_s)
    x_mm, y_mm, theta_rad = map(float, record.refined.T_robot_object)
    _fill_pose(message.pose.pose, x_mm, y_mm, theta_rad, z_m)
    planar = (0, 1, 5)  # x, y, yaw
    unit = numpy.array([1e-3, 1e-3, 1.0])
    covariance = numpy.zeros((6, 6))
    covariance[numpy.ix_(planar, planar)] = covariance_of(record) * numpy.outer(unit, unit)
    message.pose.covariance = covariance.ravel()
    return message


def map_message(
    new: New, grid: palpate.OccupancyGrid, record: palpate.Record, frame_id: str, time_s: float, z_m: float
) -> Any:
    """nav_msgs/OccupancyGrid: the map of the object where the object lies.

    A cell has the probability in % that the object is there, and -1 where the map holds no more than
    its prior. Rows of cells follow each other in y, from the corner of the first cell, `info.origin`.
    """
    message = new("nav_msgs/msg/OccupancyGrid")
    _fill_header(message.header, frame_id, time_s)
    log_odds = numpy.asarray(grid.log_odds, dtype=numpy.float64)
    corner = numpy.asarray(grid.origin_mm) - grid.cell_mm / 2
    if record.mode.get("mirrored", False):  # x -> -x in the object's frame
        log_odds = log_odds[:, ::-1]
        corner = numpy.array([-corner[0] - grid.cell_mm * grid.nx, corner[1]])
    pose = record.refined.T_robot_object
    x_mm, y_mm = palpate.transform(pose, [corner])[0]
    _fill_pose(message.info.origin, float(x_mm), float(y_mm), float(pose[2]), z_m)
    message.info.map_load_time = message.header.stamp
    message.info.resolution = 1e-3 * grid.cell_mm
    message.info.height, message.info.width = log_odds.shape
    prior = math.log(grid.prior / (1 - grid.prior))
    percent = numpy.rint(100 / (1 + numpy.exp(-log_odds)))
    percent[numpy.abs(log_odds - prior) < 1e-3] = -1
    message.data = array("b", percent.astype(numpy.int8).ravel().tobytes())
    return message


def _marker(new: New, kind: str, number: int, frame_id: str, time_s: float, rgba: tuple[float, ...]) -> Any:
    marker = new("visualization_msgs/msg/Marker")
    _fill_header(marker.header, frame_id, time_s)
    marker.ns, marker.id = "palpate", number
    marker.type, marker.action = getattr(marker, kind), marker.ADD
    marker.pose.orientation.w = 1.0
    marker.color.r, marker.color.g, marker.color.b, marker.color.a = rgba
    return marker


def _outline(elements_mm: NDArray[numpy.float64], T_robot_sensor: Any) -> NDArray[numpy.float64]:
    """The corners [5, 2] of the rectangle about the elements' centres, in mm; the last is the first."""
    (left, bottom), (right, top) = elements_mm.min(axis=0), elements_mm.max(axis=0)
    corners = [(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)]
    return palpate.transform(T_robot_sensor, corners)


def marker_messages(
    new: New,
    record: palpate.Record,
    elements_mm: NDArray[numpy.float64],
    T_robot_sensor: Any,
    frame_id: str,
    time_s: float,
    z_m: float,
) -> Any:
    """visualization_msgs/MarkerArray: the array's outline at the last touch, the ellipse that holds the
    object's origin with 95 %, and the object's label with its probability."""
    outline = _marker(new, "LINE_STRIP", 0, frame_id, time_s, (0.1, 0.1, 0.1, 1.0))
    outline.scale.x = 0.001
    for x_mm, y_mm in _outline(elements_mm, T_robot_sensor):
        point = new("geometry_msgs/msg/Point")
        point.x, point.y, point.z = 1e-3 * float(x_mm), 1e-3 * float(y_mm), z_m
        outline.points.append(point)

    x_mm, y_mm, _ = map(float, record.refined.T_robot_object)
    variances, axes = numpy.linalg.eigh(covariance_of(record)[:2, :2])
    ellipse = _marker(new, "CYLINDER", 1, frame_id, time_s, (0.8, 0.1, 0.1, 0.5))
    _fill_pose(ellipse.pose, x_mm, y_mm, math.atan2(axes[1, 1], axes[0, 1]), z_m)
    diameters = 2e-3 * _SD_OF_95 * numpy.sqrt(numpy.maximum(variances, 1e-6))
    ellipse.scale.x, ellipse.scale.y, ellipse.scale.z = float(diameters[1]), float(diameters[0]), 0.001

    label = _marker(new, "TEXT_VIEW_FACING", 2, frame_id, time_s, (0.1, 0.1, 0.1, 1.0))
    _fill_pose(label.pose, x_mm, y_mm, 0.0, z_m + 0.02)
    label.scale.z = 0.01
    label.text = f"{record.best} {record.identity[record.best]:.1%}, {record.fit.verdict}"

    markers = new("visualization_msgs/msg/MarkerArray")
    markers.markers = [outline, ellipse, label]
    return markers
