"""
Is my German export read correctly?
===================================

Semicolons, decimal commas, umlauts, ``°`` and a block of other lines above the names: such a file
is read without any option if its names state quantity and unit.

The file of this example is made from example data of a virtual joint and stored as Windows-1252,
the encoding that many German programs write.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import rigidimeter as rm

TRUE = [0.0045, 0.1368, 1.751]

parts, start_s = [], 0.0
for epoch in rm.data("elbow").epochs[:3]:
    torque, angle = epoch.channels["torque_nm"], epoch.channels["angle_rad"]
    part = {"Zeit [s]": start_s + np.arange(len(torque)) / 1000, "Drehmoment [Nm]": torque.values}
    parts.append(pd.DataFrame({**part, "Winkel [°]": np.degrees(angle.values)}))
    start_s += 15.0
path = Path(mkdtemp()) / "Prüfung.csv"
head = "Prüfstand: Ellbogen links\nPrüfer: Müller\nDatum: 12.03.2026\n\n"
body = pd.concat(parts).to_csv(sep=";", decimal=",", index=False, float_format="%.6f")
path.write_bytes((head + body).encode("cp1252"))
print((head + body)[:190])

# %%
# Read and compare
# ----------------
#
# Nothing but the file is needed: decimal commas, degrees and names are recognised. The rest between
# the epochs is missing from the file; it shows as gaps of the time.

recording = rm.read(path)
for notice in recording.notices:
    print(notice.level, notice.text)
recording

# %%
# J, B and K are those of the virtual joint.

estimates = rm.estimate(recording)
print(estimates.pooled[0])
assert np.allclose(estimates.pooled[0].value, TRUE, rtol=0.02)

figure, axis = plt.subplots(figsize=(7, 3.5), layout="constrained")
for epoch in recording.epochs:
    angle = epoch.channels["angle_rad"]
    axis.plot(angle.time_s, np.degrees(angle.values), label=f"epoch {epoch.label}", lw=0.9)
axis.set(xlabel="Time (s)", ylabel="Angle (°)", title="Cut where the file has gaps")
axis.legend(ncols=3, loc="upper right", frameon=False)
axis.margins(x=0.01)
axis.set_ylim(top=1.35 * axis.get_ylim()[1])
