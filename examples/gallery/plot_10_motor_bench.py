"""
My motor bench has friction. Does it look like damping?
=======================================================

To J, B and K alone, yes: dry friction opposes the motion as damping does, so B comes out too high.
`estimate` finds the friction and gives J, B and K beside it; a model with a term for it gives the
friction, too.

The bench of this example is a motor that moves a spring, a flywheel and a damper through a
multisine, with a dry friction of 0.05 N·m in the bearing.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np

import rigidimeter as rm

J, B, K, FRICTION_NM = 0.0045, 0.1368, 1.751, 0.05
RATE_HZ = 500.0

rng = np.random.default_rng(8)
time_s = np.arange(0, 60, 1 / RATE_HZ)
angle, velocity, acceleration = np.zeros((3, time_s.size))
for hz in np.arange(0.1, 10, 0.1):
    omega, phase = 2 * np.pi * hz, rng.uniform(0, 2 * np.pi)
    size = 0.03 / (1 + hz**1.5)
    angle += size * np.cos(omega * time_s + phase)
    velocity -= size * omega * np.sin(omega * time_s + phase)
    acceleration -= size * omega**2 * np.cos(omega * time_s + phase)
torque = J * acceleration + B * velocity + K * angle + FRICTION_NM * np.sign(velocity)
torque += 0.005 * rng.standard_normal(time_s.size)
path = Path(mkdtemp()) / "bench.npz"
np.savez(path, torque_nm=torque, angle_rad=angle, rate_hz=RATE_HZ)

# %%
# J, B and K beside what is found
# -------------------------------

recording = rm.read(path)
estimates = rm.estimate(recording)
(fit,) = estimates.fits
print(fit)
for found in estimates.findings:
    print(found)

# %%
# Without friction and with it
# ----------------------------
#
# From 0 Hz on, since a friction has a part of any frequency.

plain = rm.fit_terms(recording, "inertia,damping,stiffness").table().set_index("parameter")
models = rm.fit_terms(recording, "inertia,damping,stiffness,offset,coulomb", high_hz=20.0)
table = models.table().set_index("parameter")
table[["value", "se", "unit", "vaf_percent"]]

# %%
# The figure
# ----------
#
# What inertia and spring leave of the torque, against the velocity: the damping is the slope, the
# friction the step at zero. A line through both is too steep.

rest = torque - J * acceleration - K * angle
figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
axis.plot(velocity[::10], rest[::10], ".", ms=2, color="0.6", label="measured")
speeds = np.array([velocity.min(), 0.0])
alone, beside = plain.loc["damping", "value"], table.loc["damping", "value"]
step = table.loc["coulomb", "value"]
axis.plot([speeds[0], -speeds[0]], [alone * speeds[0], -alone * speeds[0]], color="tab:red",
          label=f"J, B, K: B {alone:.3f} N·m·s/rad")  # fmt: skip
label = f"with friction: B {beside:.3f} N·m·s/rad, {step:.3f} N·m"
for sign in (1, -1):
    axis.plot(sign * speeds, sign * (beside * speeds - step), color="tab:blue", label=label)
    label = None
axis.set(xlabel="Velocity (rad/s)", ylabel="Torque less inertia and spring (N·m)")
axis.legend(frameon=False)

assert alone > 1.3 * B
assert np.all((fit.low < [J, B, K]) & (fit.high > [J, B, K]))
assert np.allclose(table.loc["inertia":"stiffness", "value"], [J, B, K], rtol=0.01)
assert np.isclose(step, FRICTION_NM, rtol=0.02)
