"""Makes a map from arrays: here from a CSV file with a touch in every row."""

import numpy
import palpate
from matplotlib import pyplot

example = palpate.simulate("ring")  # in place of a log of x_mm, y_mm, theta_rad, p0, p1, ...
rows = numpy.hstack([example.T_robot_sensor, example.pressure])
numpy.savetxt("touches.csv", rows, delimiter=",")

table = numpy.loadtxt("touches.csv", delimiter=",")
elements_mm = palpate.digitacts_array()  # [e, 2], or palpate.grid_array(columns, rows, pitch_mm)
recording = palpate.Recording(table[:, 3:], table[:, :3], elements_mm, object="ring")
recording.save("touches.h5")  # for the command: palpate map touches.h5 -o ring.map.h5
print(recording)

builder = palpate.MapBuilder(palpate.Device.open())
builder.add(recording)
ring = builder.build("ring")
ring.save("ring.map.h5")
ring.plot()
pyplot.savefig("own_data.png")
