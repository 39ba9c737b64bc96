"""
My drive is fast. How fast must I sample?
=========================================

Between two samples a fast drive moves the joint where nothing is measured, and the inertia comes
out too low; B and K do not suffer. Record the velocity command, and J is right again. If you have
only torque and angle, the interval of J is wider by what a drive of 50 Hz, commanded at each
sample, takes off it, and a caution says so; state your drive if it is faster.

The virtual rig samples 250 times a second; its drives have bandwidths of 35 to 100 Hz.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import rigidimeter as rm

TRUE = np.array([0.0045, 0.1368, 1.751])
BANDWIDTHS_HZ = np.array([35.0, 50.0, 70.0, 100.0])


def rig(bandwidth_hz):
    """Return the settings of a rig with a drive of this bandwidth."""
    return {
        "rig": {
            "tick_rate_hz": 250.0,
            "drive_bandwidth_hz": bandwidth_hz,
            "torque": {"rate_hz": 250.0},
            "motion": {"rate_hz": 250.0},
        }
    }


# %%
# Three ways to estimate the same epochs
# --------------------------------------

alone, stated, recorded = [], [], []
for bandwidth_hz in BANDWIDTHS_HZ:
    blocks = [{"task": "prbs", "epochs": 2}]
    protocol = {"protocol": {"rests_s": [1.0], "blocks": blocks}}
    session = rm.simulate(rig(bandwidth_hz) | protocol)
    two_channels = [
        replace(epoch, channels={name: epoch.channels[name] for name in ("torque_nm", "angle_rad")})
        for epoch in session.epochs
    ]
    alone.append(rm.estimate(two_channels).pooled[0])
    stated.append(rm.estimate(two_channels, settings=rig(bandwidth_hz)).pooled[0])
    recorded.append(rm.estimate(session).pooled[0])
    print(
        f"{bandwidth_hz:5.0f} Hz: J {1000 * alone[-1].inertia_kg_m2:.2f}",
        end=" with two channels, ",
    )
    print(f"{1000 * recorded[-1].inertia_kg_m2:.2f}·10⁻³ kg·m² with the command")

# %%
# The figure
# ----------
#
# The error of J with its 95 % interval. Nothing stated, the program assumes a drive of 50 Hz that
# is commanded at each sample.

figure, (upper, lower) = plt.subplots(
    2, 1, figsize=(7, 6), layout="constrained", sharex=True, height_ratios=[2, 1]
)
for fits, label, colour, shift in (
    (stated, "torque and angle, drive stated", "tab:green", 1.2),
    (alone, "torque and angle, nothing stated", "tab:orange", 0.0),
    (recorded, "with the velocity command", "tab:blue", -1.2),
):
    low, value, high = (
        np.array([100 * (getattr(fit, which) / TRUE - 1) for fit in fits]).T
        for which in ("low", "value", "high")
    )
    for axis, column in ((upper, 0), (lower, 2)):
        bars = [value[column] - low[column], high[column] - value[column]]
        axis.errorbar(
            BANDWIDTHS_HZ + shift, value[column], bars, fmt="o", ms=4, capsize=3, color=colour,
            label=label,
        )  # fmt: skip
for axis, name in ((upper, "J"), (lower, "K")):
    axis.axhline(0, color="black", lw=1)
    axis.set_ylabel(f"Error of {name} (%)")
lower.set_xlabel("Bandwidth of the drive (Hz)")
upper.legend(loc="upper left", frameon=False)

assert alone[-1].inertia_kg_m2 < 0.95 * TRUE[0]
for fit in (*alone, *stated, *recorded):
    assert fit.low[0] < TRUE[0] < fit.high[0]
