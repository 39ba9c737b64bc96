"""What dry friction in the drive does between the samples of the motion.

Friction acts on the drive as −F sgn(v), so its part of the velocity follows from the times at which
the velocity changes its sign, with the poles of the drive and residues ρ of its own
(`drive_terms`). Of that part the torque sees the acceleration at its own samples, and those of the
velocity its mean, as with the command. With X the window's transform and * what is sampled, the
torque sees beyond the samples

    X[a_ρ(t_torque)] − jω X[v_ρ*],   X[v_ρ(t_torque)] − X[v_ρ*],   X[θ_ρ(t_torque)] − X[θ_ρ*]

That holds for a sign that changes at once. While a drive sticks, friction takes any value between
−F and F, and the arm rests where the sharp law has it accelerate, so what the torque truly saw lies
between nothing of this and all of it, and the samples do not show where. Half of it is taken, and
the interval reaches from nothing to all.
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.closedloop.between_samples import (
    TorqueFilter,
    driven_behind,
    filtered,
)
from rigidimeter.analysis.estimation.closedloop.drive_fit import FoundDrive, velocity_sign
from rigidimeter.analysis.estimation.closedloop.drive_motion import DrivenAt
from rigidimeter.analysis.estimation.closedloop.spectral_lines import (
    SAME_TIME,
    Complex,
    Grid,
    spectra,
)
from rigidimeter.analysis.estimation.signals import Array, values_at
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.model import DriveModel


def half_of_friction(
    epoch: Epoch, grid: Grid, found: FoundDrive | None, torque_filter: TorqueFilter | None
) -> Complex:
    """Return half of what stands above at the lines, shape (m, 3); 0 without friction.

    Parameters
    ----------
    epoch : Epoch
        With command and velocity.
    grid : Grid
    found : FoundDrive or None
    torque_filter : TorqueFilter or None
        That the torque went through.
    """
    sign = None if found is None else velocity_sign(epoch, found.fitted)
    if found is None or sign is None:
        return np.zeros((grid.line.size, 3), dtype=np.complex128)
    driven_at = DrivenAt(DriveModel(found.model.poles_rad_s, found.fitted.rubbing), sign)
    sampled = driven_at(epoch.channels["velocity_rad_s"].time_s)
    torque, velocity = epoch.channels["torque_nm"], epoch.channels["velocity_rad_s"]

    def at_lines(like: Channel, values: Array) -> Array:
        return values_at(Channel(like.name, like.time_s, values), grid.time_s, SAME_TIME)

    seen = [at_lines(torque, part) for part in driven_behind(driven_at, torque_filter, torque)]
    beside, _ = filtered(torque_filter, grid.omega_rad_s) * spectra(
        grid, at_lines(velocity, sampled.angle_rad), at_lines(velocity, sampled.velocity_rad_s)
    )
    there = np.stack([grid.transform(part) for part in seen], axis=1)
    return np.asarray(0.5 * (there - beside))
