"""
What does a filter do to J, B and K?
====================================

Nothing, if torque, acceleration, velocity and angle all pass the same one. A high-pass on the angle
alone, against drift, makes all three too small: with 0.3 Hz K by a quarter.

Torque and motion of this example are written down in closed form, so that only the filter can make
an error.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import butter, sosfilt

import rigidimeter as rm

TRUE = np.array([0.0045, 0.1368, 1.751])
RATE_HZ = 500.0

rng = np.random.default_rng(2)
time_s = np.arange(0, 60, 1 / RATE_HZ)
angle, velocity, acceleration = np.zeros((3, time_s.size))
for hz in np.arange(0.15, 10, 0.05):
    omega, phase = 2 * np.pi * hz, rng.uniform(0, 2 * np.pi)
    size = 0.01 / (1 + hz**1.2)
    angle += size * np.cos(omega * time_s + phase)
    velocity -= size * omega * np.sin(omega * time_s + phase)
    acceleration -= size * omega**2 * np.cos(omega * time_s + phase)
torque = TRUE @ [acceleration, velocity, angle]

# %%
# Two ways to filter
# ------------------
#
# A causal Butterworth high-pass of second order, and plain least squares. The first 10 s, in which
# the filter settles, are not used.


def error_percent(cutoff_hz, alike):
    """Return the errors of J, B and K after a high-pass on everything or on the angle alone."""
    sos = butter(2, cutoff_hz, "highpass", fs=RATE_HZ, output="sos")
    signals = np.array([acceleration, velocity, angle, torque])
    filtered = [0, 1, 2, 3] if alike else [2]
    signals[filtered] = sosfilt(sos, signals[filtered])
    *motion, moment = signals[:, time_s > 10]
    found, *_ = np.linalg.lstsq(np.transpose(motion), moment)
    return 100 * (found / TRUE - 1)


cutoffs_hz = np.geomspace(0.01, 0.5, 15)
alone = np.array([error_percent(cutoff, alike=False) for cutoff in cutoffs_hz])
alike = np.array([error_percent(cutoff, alike=True) for cutoff in cutoffs_hz])

figure, axis = plt.subplots(figsize=(7, 4), layout="constrained")
for column, name in enumerate("JBK"):
    axis.plot(cutoffs_hz, alone[:, column], "o-", ms=4, label=f"{name}, angle alone filtered")
    label = "J, B, K, all filtered alike" if name == "K" else None
    axis.plot(cutoffs_hz, alike[:, column], "k:", lw=2, label=label)
axis.set(xscale="log", xlabel="Cut-off of the high-pass (Hz)", ylabel="Error (%)")
axis.set_xticks(ticks := [0.01, 0.02, 0.05, 0.1, 0.2, 0.5], [f"{hz:g}" for hz in ticks])
axis.minorticks_off()
axis.grid(color="0.9")
axis.legend(frameon=False)

# %%
# What the program does
# ---------------------
#
# It filters all signals alike, so a drift of the torque can be filtered away without harm.

drifting = torque + 0.3 * time_s / 60
fit = rm.identify(torque_nm=drifting, angle_rad=angle, rate_hz=RATE_HZ)
print(fit)
assert np.allclose(fit.value, TRUE, rtol=0.005)
assert np.all(np.abs(alike) < 0.1)
assert alone[-1, 2] < -30
