"""
My subject tenses now and then. Can the EMG show where?
=======================================================

With raw EMG beside torque and motion, the program finds the bursts, leaves these stretches out and
says how much is left. They are chosen by the EMG alone: a choice by torque or motion would bias B
and K.

Here a robot imposes the motion. Three times in 30 s the subject tenses for a second or more: a push
of 0.4 N·m, and three times the stiffness.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import butter, sosfilt

import rigidimeter as rm

J, B, K = 0.0045, 0.1368, 1.751
RATE_HZ = 2000.0
TRIM_S = 1.0
BURSTS_S = [(5.0, 6.0), (13.2, 14.6), (22.0, 23.2)]

rng = np.random.default_rng(1)
time_s = np.arange(0, 30, 1 / RATE_HZ)
angle = np.zeros((3, time_s.size))  # angle, velocity, acceleration
for hz in np.arange(0.2, 12, 0.2):
    phase, omega = rng.uniform(0, 2 * np.pi), 2 * np.pi * hz
    for order in range(3):
        wave = np.cos(omega * time_s + phase + order * np.pi / 2)
        angle[order] += 0.02 / (1 + hz) * omega**order * wave

tense = np.zeros(time_s.size)
for start_s, stop_s in BURSTS_S:
    tense += np.clip(np.minimum(time_s - start_s, stop_s - time_s) / 0.2, 0, 1)
torque = J * angle[2] + B * angle[1] + K * (1 + 2 * tense) * angle[0] - 0.4 * tense
torque += 0.005 * rng.standard_normal(time_s.size)
band = butter(2, (20, 450), "bandpass", fs=RATE_HZ, output="sos")
noise = sosfilt(band, rng.standard_normal((2, time_s.size)))
emg_v = 1e-6 * (4 * noise[0] + 80 * tense * noise[1])

path = Path(mkdtemp()) / "tensing.npz"
np.savez(path, torque_nm=torque, angle_rad=angle[0], emg_v=emg_v, rate_hz=RATE_HZ)

# %%
# With and without the active stretches
# -------------------------------------

recording = rm.read(path)
left_out = rm.estimate(recording)
fitted_all = rm.estimate(recording, settings={"estimation": {"leave_out_active": False}})
print("left out:  ", left_out.fits[0])
print("all fitted:", fitted_all.fits[0])
for found in left_out.findings:
    print(found)

# %%
# The figure
# ----------
#
# Shaded: what is left out, until 0.2 s after the EMG, since the muscle still pulls, and 1 s on each
# side, which the filters need. The torque that J, B and K do not explain lies there.

figure, axes = plt.subplots(3, 1, figsize=(8, 5.5), sharex=True, layout="constrained")
residual = torque - np.array([J, B, left_out.fits[0].stiffness_nm_rad]) @ angle[::-1]
for axis, values, label in zip(
    axes,
    (1e6 * emg_v, torque, residual),
    ("EMG (µV)", "Torque (N·m)", "Torque beyond\nJ, B, K (N·m)"),
    strict=True,
):
    axis.plot(time_s, values, lw=0.6, color="black")
    axis.set_ylabel(label)
    for stretch in left_out.fits[0].activity.stretches:
        out_s = stretch.start_s - TRIM_S, stretch.stop_s + 0.2 + TRIM_S
        axis.axvspan(*out_s, color="tab:orange", alpha=0.3, lw=0)
axes[-1].set_xlabel("Time (s)")
axes[-1].set_xlim(0, 30)

relaxed, mixed = left_out.fits[0], fitted_all.fits[0]
print(f"K {relaxed.stiffness_nm_rad:.3f} without, {mixed.stiffness_nm_rad:.3f} with; true {K}")
assert relaxed.low[2] < K < relaxed.high[2]
assert mixed.low[2] > K
