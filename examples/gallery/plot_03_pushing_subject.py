"""
My subject pushes. Are J, B and K still right?
==============================================

With least squares they are not: an admittance-controlled robot gives way to the subject, so the
subject's torque and the motion are correlated. With the recorded perturbation as instrument they
are right, and the intervals say how exactly they are known.

The virtual subject pushes with 0.5 N·m (SD, 0.3 to 4 Hz), half the amplitude of the perturbation.
"""

# sphinx_gallery_thumbnail_number = 2

import matplotlib.pyplot as plt
import numpy as np

import rigidimeter as rm

TRUE = np.array([0.0045, 0.1368, 1.751])

recording = rm.simulate(
    {
        "seed": 3,
        "rig": {
            "tick_rate_hz": 250.0,
            "torque": {"rate_hz": 250.0},
            "motion": {"rate_hz": 250.0},
        },
        "subject": {"OFF": {"voluntary_sd_nm": 0.5}},
        "protocol": {"rests_s": [2.0], "blocks": [{"task": "prbs", "epochs": 10}]},
    }
)
recording.plot(epoch=0)

# %%
# Least squares and instrumental variables
# ----------------------------------------
#
# ``published`` is least squares, as printed in the paper that this program follows. ``iv`` is what
# ``rm.estimate`` chooses by itself where the perturbation was recorded.

published = rm.estimate(recording, method="published")
iv = rm.estimate(recording)
print(published.pooled[0])
print(iv.pooled[0])

# %%
# The program reports it: of least squares the checks say how large the bias is, of ``iv`` only that
# the subject pushed.

for found in (*published.findings, *iv.findings):
    if found.finding.name in ("loop_bias", "voluntary_torque"):
        print(found.fits[0].method, found)

# %%
# Every epoch with its 95 % interval, in % of the true value. Least squares even finds a negative
# inertia and damping, and its intervals do not show it.

figure, axes = plt.subplots(1, 3, figsize=(8, 3.6), layout="constrained", sharex=True)
for column, (axis, name) in enumerate(zip(axes, "JBK", strict=True)):
    for estimates, label, colour, shift in (
        (published, "least squares", "tab:red", -0.15),
        (iv, "instrumental variables", "tab:blue", 0.15),
    ):
        value = np.array([fit.value[column] for fit in estimates.fits])
        half = 1.96 * np.array([fit.se[column] for fit in estimates.fits])
        x = np.arange(1, len(value) + 1) + shift
        percent = 100 / TRUE[column]
        axis.errorbar(x, percent * value, percent * half, fmt="o", ms=4, color=colour, label=label)
    axis.axhline(100, color="black", lw=1)
    axis.set(title=name, xlabel="Epoch", ylabel=f"{name} (% of the true value)")
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)

assert np.all(published.pooled[0].value < 0.8 * TRUE)
assert np.all(np.abs(iv.pooled[0].value - TRUE) < 2.5 * iv.pooled[0].se)
