"""
How do I bring recordings from MATLAB, and estimates back?
==========================================================

Save the signals under names with their units, read the MAT file, and write the estimates as a MAT
file. Here Octave stands for MATLAB: the lines are the same in both.

``make gallery`` runs this script; it needs Octave (``apt install octave``).
"""

import subprocess
from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np
import scipy.io

import rigidimeter as rm

TRUE = np.array([0.005, 0.14, 1.8])
folder = Path(mkdtemp())


def octave(lines):
    """Run lines of MATLAB in the folder and print what they print."""
    words = ["octave-cli", "--quiet", "--eval", lines]
    run = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True)
    print(run.stdout, end="")
    return run.stdout


# %%
# From MATLAB
# -----------
#
# A joint is simulated there: a torque that jumps between two values, as of a perturbation, moves
# it, each value for 50 ms, and torque and angle have the noise of their sensors.

octave("""
  rand('seed', 1); randn('seed', 2);
  J = 0.005; B = 0.14; K = 1.8; dt = 0.001; n = 30000;
  time_s = (0:n-1)' * dt;
  torque_nm = 0.3 * repelem(sign(rand(n/50, 1) - 0.5), 50);
  step = expm([0 1 0; -K/J -B/J 1/J; 0 0 0] * dt);
  x = [0; 0];
  angle_rad = zeros(n, 1);
  for k = 2:n
    x = step(1:2, :) * [x; torque_nm(k-1)];
    angle_rad(k) = x(1);
  end
  torque_nm = torque_nm + 0.005 * randn(n, 1);
  angle_rad = angle_rad + 1e-5 * randn(n, 1);
  save('-v7', 'mine.mat', 'time_s', 'torque_nm', 'angle_rad')
  fprintf('%d samples, angle SD %.1f deg\\n', n, std(angle_rad) * 180 / pi)
""")

# %%
# In Python
# ---------
#
# Nothing but the file is needed: the names state quantity and unit.

recording = rm.read(folder / "mine.mat")
recording

# %%

estimates = rm.estimate(recording)
fit = estimates.fits[0]
print(fit)

# %%
# Back to MATLAB
# --------------
#
# Each column of the table becomes a field.

table = estimates.table().select_dtypes("number")
columns = {name: column.to_numpy() for name, column in table.items()}
scipy.io.savemat(folder / "estimates.mat", {"estimates": columns})
printed = octave("""
  load('estimates.mat')
  fprintf('J %.5f kg m^2, B %.4f N m s/rad, K %.3f N m/rad\\n', ...
         estimates.inertia_kg_m2, estimates.damping_nm_s_rad, estimates.stiffness_nm_rad)
""")

# %%
# The first three seconds of what MATLAB saved, and what was estimated from all 30.

epoch = recording.epochs[0]
angle, torque = epoch.channels["angle_rad"], epoch.channels["torque_nm"]
figure, axes = plt.subplots(2, figsize=(7, 4), layout="constrained", sharex=True)
part = slice(0, 3000)
axes[0].plot(torque.time_s[part], torque.values[part], lw=0.9)
axes[0].set(ylabel="Torque (N·m)")
axes[1].plot(angle.time_s[part], np.degrees(angle.values[part]), lw=1.2)
axes[1].set(xlabel="Time (s)", ylabel="Angle (°)")
inertia, damping, stiffness = fit.value
title = f"J {inertia:.5f} kg·m², B {damping:.4f} N·m·s/rad, K {stiffness:.3f} N·m/rad"
axes[0].set_title(title, fontsize=11)

assert np.allclose(fit.value, TRUE, rtol=0.02)
assert f"K {fit.stiffness_nm_rad:.3f}" in printed
