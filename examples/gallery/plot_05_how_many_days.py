"""
How many days and epochs does my study need?
============================================

Days count, not epochs: the joint differs from day to day, and more epochs on one day do not
average that out. ``rm.design`` computes the numbers before the first subject comes.
"""

import matplotlib.pyplot as plt

import rigidimeter as rm

DIFFERENCES = ["stiffness=10%", "stiffness=20%", "stiffness=30%"]

# %%
# The plan
# --------
#
# Assumed is a scatter between epochs and between days as in Table 2 of the paper. ``scatter=``
# takes that of your own recordings. The power is 80 %, the level 5 %, with stiffness and damping
# as primary measures (Holm).

plan = rm.design(differences=DIFFERENCES)
needed = plan.days()["days_needed"].dropna().unstack("epochs_a_day")
needed

# %%
# The figure
# ----------
#
# Each line is a difference of K between two conditions, both measured on each day. From five epochs
# a day on there is little to gain; a difference half as large needs about three times the days.

figure, axis = plt.subplots(figsize=(7, 4.2), layout="constrained")
stiffness = plan.settings.subject["OFF"].stiffness_nm_rad
for difference, days in needed.iterrows():
    percent = 100 * difference[1] / stiffness
    axis.plot(days.index, days.astype(float), "o-", label=f"{percent:.0f} %")
axis.set_xscale("log")
axis.set_yscale("log")
axis.set_xticks(days.index, [f"{count}" for count in days.index], minor=False)
axis.set_yticks(ticks := [3, 5, 10, 20, 50], [f"{count}" for count in ticks])
axis.minorticks_off()
axis.set(xlabel="Epochs a day and condition (number)", ylabel="Days needed (number)")
axis.grid(color="0.9")
axis.legend(title="Difference of K", frameon=False)

few, many = needed.iloc[1].iloc[[0, -1]]
assert few > many > 1
assert needed.iloc[0].iloc[2] > 2 * needed.iloc[1].iloc[2]
