"""Learns five simulated letters, then recognises one of them from nine touches."""

import palpate
from matplotlib import pyplot

device = palpate.Device.open()
letters = "AEIOU"
touches = {letter: palpate.simulate(letter, seed=i) for i, letter in enumerate(letters)}
sensor = palpate.InverseSensorModel(prior=palpate.estimate_prior(device, touches))
maps = []
for letter in letters:  # each at the robot's origin, touched at known poses
    builder = palpate.MapBuilder(device, sensor=sensor)
    builder.add(touches[letter])
    maps.append(builder.build(letter))

poses, T_object_robot = palpate.random_poses(9, seed=5), palpate.random_object_pose(seed=5)
unknown = palpate.simulate("E", poses, T_object_robot=T_object_robot)  # an E, somewhere
[record] = palpate.recognize(unknown, maps, device=device, trace=True)
print(f"{record}, {record.refined_error_mm:.2f} mm off; fit: {record.fit['verdict']}")

figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 4), layout="constrained")
maps[letters.index(record.best)].plot(left)
estimate = [record.refined[key] for key in ("x_mm", "y_mm", "theta_rad")]  # T_object_robot
for touch in unknown:
    T_object_sensor = palpate.compose(estimate, touch.T_robot_sensor)
    pressed = palpate.transform(T_object_sensor, touch.elements_mm)[touch.pressure > 2]
    left.plot(*pressed.T, "w.", markersize=2)
for letter in letters:
    right.plot(range(1, 10), [step["identity"][letter] for step in record.trace], label=letter)
right.set(xlabel="touches", ylabel="probability")
right.legend()
figure.savefig("recognize_letters.png")
