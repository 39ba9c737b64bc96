from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation import fit_epochs
from rigidimeter.core.records import Channel


def test_a_joint_that_varies_widens_the_interval_of_few_epochs(simulated):
    settings, epochs = simulated(5, seed=6)
    same = fit_epochs(epochs, "iv", settings)[1][0]
    # A torque that is 10 % larger or smaller in each epoch is a joint that is.
    rng = np.random.default_rng(0)
    varied = []
    for epoch in epochs:
        torque = epoch.channels["torque_nm"]
        factor = 1 + 0.1 * rng.standard_normal()
        changed = Channel("torque_nm", torque.time_s, factor * torque.values)
        varied.append(replace(epoch, channels={**epoch.channels, "torque_nm": changed}))
    other = fit_epochs(varied, "iv", settings)[1][0]
    assert other.stiffness_nm_rad_se > 10 * same.stiffness_nm_rad_se
