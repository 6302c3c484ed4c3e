"""Recognises what a stream of frames touches, after every touch."""

import math

import palpate
from matplotlib import pyplot

device = palpate.Device.open()
maps = []
for letter in "AEIOU":
    builder = palpate.MapBuilder(device)
    builder.add(palpate.simulate(letter))
    maps.append(builder.build(letter))

lattice = palpate.PoseLattice((-10, 10, 40), (-10, 10, 40), (0, 2 * math.pi, 90))
belief = palpate.PoseHistogram(device, maps, lattice)
# A board is opened by its name, such as "takktile"; this simulation runs as fast as it is read.
with palpate.open_sensor("simulate:U,object=random,touches=9,seed=3,speed=max") as sensor:
    for number, touch in enumerate(palpate.touches(sensor), start=1):
        belief.update(touch)
        estimate = belief.estimate()
        best = maps[estimate.mode.object].label
        print(f"touch {number}: {best} with probability {estimate.identity.max():.3f}")
print(belief.refine(estimate.mode))

belief.marginals(estimate.mode.object).plot()
pyplot.title(f"belief over the position of the {best}")
pyplot.savefig("stream.png")
