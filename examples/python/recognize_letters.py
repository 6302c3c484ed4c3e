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

unknown = palpate.simulate(  # an E, somewhere
    "E", palpate.random_poses(9, seed=2), T_object_robot=palpate.random_object_pose(seed=2)
)
[record] = palpate.recognize(unknown, maps, device=device, trace=True)
print(f"{record}, {record.refined_error_mm:.2f} mm off; the touches {record.fit['verdict']}")

figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 4), layout="constrained")
maps[letters.index(record.best)].plot(left)
for letter in letters:
    right.plot(range(1, 10), [step["identity"][letter] for step in record.trace], label=letter)
right.set(xlabel="touches", ylabel="probability")
right.legend()
figure.savefig("recognize_letters.png")
