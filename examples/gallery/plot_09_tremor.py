"""
My subject has tremor. Does it spoil J, B and K?
================================================

Not with the perturbation recorded: tremor widens the intervals, most of all that of J, and biases
nothing. The program finds the tremor, with its frequency and its amplitude.

The virtual subject has a tremor of 0.3 N·m at 5 Hz, against a perturbation of 1 N·m.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import welch

import rigidimeter as rm

TRUE = np.array([0.0045, 0.1368, 1.751])

trembling = rm.data("tremor")
relaxed = [epoch for epoch in rm.data("elbow").epochs if epoch.condition == "OFF"]
of_tremor, of_relaxed = rm.estimate(trembling), rm.estimate(relaxed)
for found in of_tremor.findings:
    print(found)

# %%
# Instrumental variables and least squares
# ----------------------------------------
#
# Least squares, as printed in the paper, takes the tremor for the joint's answer.

published = rm.estimate(trembling, method="published")
for name, estimates in (("relaxed", of_relaxed), ("tremor", of_tremor), ("published", published)):
    print(f"{name:10}", estimates.pooled[0])

# %%
# The figure
# ----------
#
# Left: the spectrum of the torque. Right: the errors with their 95 % intervals.

figure, (left, right) = plt.subplots(1, 2, figsize=(8.5, 4), layout="constrained")
for epochs, label, colour in (
    (relaxed, "relaxed", "tab:blue"),
    (trembling.epochs, "tremor", "tab:orange"),
):
    power = 0.0
    for epoch in epochs:
        torque = epoch.channels["torque_nm"]
        hz, one = welch(torque.values, torque.rate_hz, nperseg=4096)
        power = power + one / len(epochs)
    shown = (hz > 0.3) & (hz < 15)
    left.semilogy(hz[shown], power[shown], color=colour, label=label)
left.set(xlabel="Frequency (Hz)", ylabel="Power of the torque (N²·m²/Hz)", xlim=(0, 15))
left.legend(frameon=False)

for shift, estimates, label, colour in (
    (-0.15, of_relaxed, "relaxed", "tab:blue"),
    (0.0, of_tremor, "tremor", "tab:orange"),
    (0.15, published, "tremor, least squares", "tab:red"),
):
    fit = estimates.pooled[0]
    value, low, high = (100 * (numbers / TRUE - 1) for numbers in (fit.value, fit.low, fit.high))
    bars = [value - low, high - value]
    right.errorbar(np.arange(3) + shift, value, bars, fmt="o", color=colour, capsize=3, label=label)
right.axhline(0, color="black", lw=1)
right.set_xticks(range(3), "JBK")
right.set(xlabel="Parameter (of all epochs)", ylabel="Error (%)")
right.legend(frameon=False)

tremor = next(group.finding for group in of_tremor.findings if group.finding.name == "tremor")
print(tremor.headline)
assert np.all((of_tremor.pooled[0].low < TRUE) & (of_tremor.pooled[0].high > TRUE))
assert published.pooled[0].inertia_kg_m2 < 0.5 * TRUE[0]
