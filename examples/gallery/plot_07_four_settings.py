"""
Which of several stimulation settings lowers the rigidity?
==========================================================

Each setting is compared with OFF over the days, and the p-values of all comparisons are adjusted
together (Holm), since with more settings a small p by chance is more likely.

The study is virtual: six days, each with OFF and three amplitudes of stimulation.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rigidimeter as rm

STIFFNESS = {"OFF": 1.75, "1 mA": 1.72, "2 mA": 1.45, "3 mA": 1.25}

# %%
# Six days
# --------
#
# The joint of a day differs from that of another by 10 % (SD), and that of an epoch by 8 %.

rng = np.random.default_rng(4)
days = []
for day in range(1, 7):
    of_day = np.exp(0.10 * rng.standard_normal())
    estimates = rm.estimate(
        rm.simulate(
            {
                "seed": day,
                "rig": {
                    "tick_rate_hz": 125.0,
                    "torque": {"rate_hz": 125.0},
                    "motion": {"rate_hz": 125.0},
                },
                "prbs": {"duration_s": 10.0},
                "subject": {
                    name: {"stiffness_nm_rad": of_day * value, "stiffness_cv_percent": 8.0}
                    for name, value in STIFFNESS.items()
                },
                "protocol": {
                    "rests_s": [1.0],
                    "blocks": [
                        {"task": "prbs", "condition": name, "epochs": 2} for name in STIFFNESS
                    ],
                },
            }
        )
    )
    days.append(estimates.table().assign(day=day))
table = pd.concat(days, ignore_index=True)
table.groupby("condition")["stiffness_nm_rad"].describe().loc[list(STIFFNESS)]

# %%
# Each setting against OFF
# ------------------------
#
# The test is a paired t-test of the days: each day gives one difference, however many its epochs.

result = rm.compare(table, value="stiffness_nm_rad", session="day", reference="OFF")
differences = result.table().set_index("other")
differences[["difference", "difference_low", "difference_high", "p_holm", "verdict"]]

# %%
# The figure
# ----------
#
# Left: the mean K of each day. Right: the difference from OFF with its 95 % interval.

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.8), layout="constrained")
by_day = table.groupby(["day", "condition"])["stiffness_nm_rad"].mean().unstack()
for day, values in by_day[list(STIFFNESS)].iterrows():
    left.plot(values.index, values, "o-", ms=4, lw=0.8, label=f"day {day}")
left.set(xlabel="Setting (amplitude)", ylabel="Stiffness K (N·m/rad)")
left.legend(fontsize=8, frameon=False, loc="upper right", ncols=2)

middle, low = differences["difference"], differences["difference_low"]
right.errorbar(differences.index, middle, middle - low, fmt="o", color="black", capsize=4)
for x, (_, row) in enumerate(differences.iterrows()):
    right.annotate(
        f"p = {row['p_holm']:.2g}", (x, row["difference_high"]), (0, 6),
        textcoords="offset points", ha="center", fontsize=9,
    )  # fmt: skip
right.axhline(0, color="0.6", lw=1)
right.margins(x=0.2, y=0.15)
right.set(xlabel="Setting (amplitude)", ylabel="K less K in OFF (N·m/rad)")

assert list(differences["verdict"]) == ["no difference shown", "lower", "lower"]
for name, row in differences.iterrows():
    true = STIFFNESS[name] - STIFFNESS["OFF"]
    assert row["difference_low"] < true < row["difference_high"]
