"""
Do the numbers of the paper belong together?
============================================

Partly. For each row of Table 2 the printed p and number of epochs give an effect size r, which can
be compared with the printed one. Beside it stands Figure 5 (impulse and work, OFF and DBS), drawn
from a virtual study, since the recordings of the animal were never published.

``rigidimeter reproduce --out paper`` does this for every equation, figure and table of "Quantifying
Viscous Damping and Stiffness in Parkinsonism Using Data-Driven Model Estimation and Admittance
Control".
"""

import matplotlib.pyplot as plt
import numpy as np

import rigidimeter as rm
from rigidimeter.paper import Context, make_rows

# %%
# Table 2
# -------

rows = make_rows(
    Context(),
    [
        "table-2-mupdrs",
        "table-2-impulse",
        "table-2-work",
        "table-2-viscosity",
        "table-2-stiffness",
    ],
)
for row in rows:
    print(f"{row.verdict}: {row.paper}\n    {row.ours}\n    {row.reason}")

# %%
# Both in one figure
# ------------------
#
# The ratings and the stiffness have an r that does not follow from the p and the number printed
# beside it.

figure, axes = plt.subplot_mosaic(
    [["table", "impulse", "work"]], figsize=(10, 4), layout="constrained", width_ratios=[1.5, 1, 1]
)
for place, row in enumerate(rows):
    (check,) = row.checks
    colour = "tab:blue" if row.verdict == "agrees" else "tab:red"
    axes["table"].plot([check.paper, check.ours], [place, place], color=colour, lw=2)
    axes["table"].plot(check.paper, place, "o", ms=9, mfc="white", color=colour)
    axes["table"].plot(check.ours, place, "o", ms=5, color=colour)
axes["table"].plot([], [], "o", ms=9, mfc="white", color="black", label="printed")
axes["table"].plot([], [], "o", ms=5, color="black", label="from p and N")
axes["table"].set_yticks(range(len(rows)), [row.id.removeprefix("table-2-") for row in rows])
axes["table"].set(xlabel="Effect size r (1)", ylabel="Row of Table 2")
axes["table"].invert_yaxis()
axes["table"].legend(frameon=False, loc="center left")

study = rm.compare(rm.data("study"))
study.plot(["impulse_nm_s", "work_j"], axes=[axes["impulse"], axes["work"]])
figure.suptitle("Left: Table 2 of the paper. Right: its Figure 5, from virtual data", fontsize=10)

verdicts = [row.verdict for row in rows]
assert verdicts == ["differs", "agrees", "agrees", "agrees", "differs"]
medians = study.table().set_index("measure")
assert np.all(medians.loc[["impulse_nm_s", "work_j"], "difference"] < 0)
