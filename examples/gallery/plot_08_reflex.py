"""
Is there a reflex beside J, B and K?
====================================

A stretch reflex answers the motion some 60 ms late. J, B and K alone absorb it: here B comes out a
third too low and K too high. The checks say so, and a model with the reflex gives the joint and the
reflex apart.

The virtual joint has a reflex of 0.3 N·m·s/rad, 60 ms late, in one direction of motion.
"""

import matplotlib.pyplot as plt
import numpy as np

import rigidimeter as rm

TRUE = np.array([0.0045, 0.1368, 1.751])

recording = rm.data("reflex")
estimates = rm.estimate(recording)
print(estimates.pooled[0])

# %%
# What the program says
# ---------------------

for found in estimates.findings:
    if found.finding.level == "caution":
        print(found)
        print("   ", found.finding.remedy)

# %%
# Which terms the torque needs
# ----------------------------
#
# Each model is fitted to the torque and predicts blocks of it that it has not seen. The + says that
# motion toward positive angles stretches the muscle.

JOINT = "inertia,damping,stiffness"
MODELS = {
    "J, B, K": JOINT,
    "with friction": f"{JOINT},coulomb",
    "with reflex−": f"{JOINT},reflex-",
    "with reflex+": f"{JOINT},reflex+",
}
models = rm.fit_terms(recording, list(MODELS.values()), compare=True)
print(models)
table = models.table()
shown = (table["model"] == MODELS["with reflex+"]) & (table["epoch"] == "0")
table.loc[shown, ["parameter", "value", "se", "unit", "vaf_percent"]]

# %%
# The figure
# ----------
#
# Left: what each model predicts of blocks that it has not seen, in the three epochs. Right: the
# errors of J, B and K as estimated alone, and as fitted beside the reflex.

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for place, terms in enumerate(MODELS.values()):
    share = table[table["model"] == terms].groupby("epoch")["held_out_vaf_percent"].first()
    left.plot([place] * len(share), share, "o", color="black", mfc="none")
left.set_xticks(range(len(MODELS)), MODELS, rotation=20)
left.set(xlabel="Model (terms)", ylabel="Torque predicted (% of its variance)")
left.margins(x=0.15)

beside = table[table["model"] == MODELS["with reflex+"]]
wanted = ["inertia", "damping", "stiffness"]
fitted = [beside[beside["epoch"] == label].set_index("parameter") for label in ("0", "1", "2")]
for label, shift, colour, values in (
    ("J, B, K alone", -0.08, "tab:red", [fit.value for fit in estimates.fits]),
    ("with reflex+", 0.08, "tab:blue", [one.loc[wanted, "value"] for one in fitted]),
):
    errors = 100 * (np.array(values) / TRUE - 1)
    right.plot(np.arange(3) + shift, errors.T, "o", color=colour)
    right.plot([], [], "o", color=colour, label=label)
right.axhline(0, color="black", lw=1)
right.set_xticks(range(3), "JBK")
right.set(xlabel="Parameter (each point an epoch)", ylabel="Error (%)")
right.legend(frameon=False)

assert set(models.recommended) == {MODELS["with reflex+"]}
gain = [one.loc["reflex+ gain", "value"] for one in fitted]
assert np.allclose(gain, 0.3, rtol=0.02)
assert np.all(np.abs(errors) < 2)
