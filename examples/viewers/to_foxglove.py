"""Shows the lines of `palpate live --json -` in Foxglove: python to_foxglove.py [--save FILE.mcap]"""

import argparse
import json
import math
import sys

import foxglove
from foxglove.channels import SceneUpdateChannel
from foxglove.messages import (
    ArrowPrimitive, Color, CylinderPrimitive, Duration, Pose, Quaternion, SceneEntity, SceneUpdate,
    Timestamp, Vector3,
)  # fmt: skip

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--save", metavar="FILE.mcap", help="write a file instead of serving")
arguments = parser.parse_args()
sink = foxglove.open_mcap(arguments.save) if arguments.save else foxglove.start_server()
scene = SceneUpdateChannel("/palpate/belief")


def placed(x_mm: float, y_mm: float, theta_rad: float) -> Pose:
    """A pose of the robot's plane, in m."""
    turn = Quaternion(x=0.0, y=0.0, z=math.sin(theta_rad / 2), w=math.cos(theta_rad / 2))
    return Pose(position=Vector3(x=x_mm / 1000, y=y_mm / 1000, z=0.0), orientation=turn)


for line in sys.stdin:
    record = json.loads(line)
    if "next" in record:
        continue
    time_ns = round(1e9 * record["time"])
    pose = record.get("refined", record)["T_robot_object"]
    blue = Color(r=0.0, g=0.45, b=0.7, a=1.0)
    arrow = ArrowPrimitive(pose=placed(*pose), shaft_length=0.01, shaft_diameter=0.001,
                           head_length=0.003, head_diameter=0.002, color=blue)
    ellipses = []
    for mode in record.get("modes", []):
        (xx, xy, _), (_, yy, _), _ = mode["covariance"]
        middle, spread = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
        x, y, _ = mode["T_robot_object"]
        # Twice the radius that holds 95 % of a Gaussian over the plane.
        size = [2e-3 * math.sqrt(-2 * math.log(0.05) * max(v, 0.0))
                for v in (middle + spread, middle - spread)]
        ellipses.append(CylinderPrimitive(
            pose=placed(x, y, 0.5 * math.atan2(2 * xy, xx - yy)),
            size=Vector3(x=size[0], y=size[1], z=1e-4),
            color=Color(r=0.8, g=0.4, b=0.0, a=0.7 * mode["probability"])))
    entity = SceneEntity(timestamp=Timestamp.from_epoch_secs(record["time"]), frame_id="robot",
                         id="belief", lifetime=Duration(sec=0), arrows=[arrow], cylinders=ellipses)
    scene.log(SceneUpdate(entities=[entity]), log_time=time_ns)
    foxglove.log("/palpate/record", record, log_time=time_ns)
if arguments.save:
    sink.close()
