"""
How do I get J, B and K from my CSV file?
=========================================

A file with columns for the time, the force at a handle, the angle and the trial is read, checked
and estimated in three lines.

The file of this example is made from example data of a virtual joint, whose J, B and K are known.
The handle is 0.25 m from the axis; the force is in newtons, the angle in degrees, the time in
milliseconds.
"""

from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pandas as pd

import rigidimeter as rm

TRUE = {"J": 0.0045, "B": 0.1368, "K": 1.751}
LEVER_M = 0.25

epochs = [epoch for epoch in rm.data("elbow").epochs if epoch.condition == "OFF"]
trials = [
    pd.DataFrame(
        {
            "t_ms": np.arange(len(epoch.channels["torque_nm"])),
            "handle": epoch.channels["torque_nm"].values / LEVER_M,
            "angle": np.degrees(epoch.channels["angle_rad"].values),
            "trial": epoch.label,
        }
    )
    for epoch in epochs
]
path = Path(mkdtemp()) / "elbow.csv"
pd.concat(trials).to_csv(path, index=False, float_format="%.6g")
print(path.read_text()[:120])

# %%
# Read the file
# -------------
#
# ``column`` says which column is which where the name does not say it. A unit that is stated
# nowhere is never guessed: the program asks for it. The lever arm makes a torque of the force.

recording = rm.read(
    path,
    column={"torque": "handle", "epoch": "trial"},
    unit={"torque": "N", "angle": "deg"},
    scale={"torque": f"{LEVER_M} m"},
)
recording

# %%
# Estimate
# --------
#
# Each trial has its own J, B and K with a standard error, and the mean has one too.

estimates = rm.estimate(recording)
estimates

# %%
# The checks say what to keep in mind. Here the perturbation was not in the file.

for found in estimates.findings:
    print(found)

# %%
# The figure compares the measured torque of the first trial with the sum of the three terms, shows
# what they leave, and each of them. The estimates are those of the virtual joint.

estimates.plot_torque(recording, epoch=0)

mean = estimates.pooled[0]
print(f"K {mean.stiffness_nm_rad:.3f} N·m/rad, true {TRUE['K']}")
assert np.allclose(mean.value, list(TRUE.values()), rtol=0.02)
