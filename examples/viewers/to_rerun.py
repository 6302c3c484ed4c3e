"""Shows the lines of `palpate live --json -` in rerun: python to_rerun.py [--save FILE.rrd]"""

import argparse
import json
import math
import sys

import numpy
import rerun

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--save", metavar="FILE.rrd", help="write a file instead of opening the viewer")
arguments = parser.parse_args()

rerun.init("palpate", spawn=arguments.save is None)
if arguments.save:
    rerun.save(arguments.save)


def ellipse(mode: dict, radius: float) -> numpy.ndarray:
    """The outline that holds 95 % of a mode's x and y, in mm in the robot frame, [65, 2]."""
    lengths, axes = numpy.linalg.eigh(numpy.array(mode["covariance"])[:2, :2])
    turn = numpy.linspace(0.0, 2.0 * math.pi, 65)
    circle = numpy.stack([numpy.cos(turn), numpy.sin(turn)])
    outline = axes @ (radius * numpy.sqrt(numpy.maximum(lengths, 0.0))[:, None] * circle)
    return outline.T + mode["T_robot_object"][:2]


for line in sys.stdin:
    record = json.loads(line)
    if "next" in record:
        continue
    rerun.set_time("time", timestamp=record["time"])
    pose = record.get("refined", record)["T_robot_object"]
    heading = [math.cos(pose[2]), math.sin(pose[2])]
    label = f"{record['best']} {record['identity'][record['best']]:.0%}"
    rerun.log(
        "robot/object",
        rerun.Arrows2D(origins=[pose[:2]], vectors=[numpy.multiply(10.0, heading)], labels=[label]),
    )
    rerun.log("robot/array", rerun.Points2D([[record["pose"]["x_mm"], record["pose"]["y_mm"]]]))
    modes = record.get("modes", [])
    rerun.log(
        "robot/modes",
        rerun.LineStrips2D(
            [ellipse(mode, math.sqrt(-2.0 * math.log(0.05))) for mode in modes],
            labels=[f"{mode['object']} {mode['probability']:.0%}" for mode in modes],
        ),
    )
    for name, probability in record["identity"].items():
        rerun.log(f"identity/{name}", rerun.Scalars(probability))
    rerun.log("decision", rerun.TextLog(record["decision"]["because"]))
