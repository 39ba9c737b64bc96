from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from rigidimeter.estimation import fit_epochs
from rigidimeter.records import Channel


def softened(epoch, cutoff_hz):
    """Pass the torque through a low-pass that its stamps do not know of."""
    torque = epoch.channels["torque_nm"]
    sos = signal.butter(1, cutoff_hz, fs=torque.rate_hz, output="sos")
    smooth = Channel("torque_nm", torque.time_s, signal.sosfilt(sos, torque.values))
    return replace(epoch, channels={**epoch.channels, "torque_nm": smooth})


@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.2])
def test_a_joint_of_three_parameters_leaves_noise(simulated, voluntary_sd_nm):
    settings, epochs = simulated(8, voluntary_sd_nm=voluntary_sd_nm, seed=4)
    (pooled,) = fit_epochs(epochs, "iv", settings)[1]
    assert pooled.findings == ()


@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.2])
def test_what_follows_the_perturbation_beyond_them_is_found(simulated, voluntary_sd_nm):
    settings, epochs = simulated(8, voluntary_sd_nm=voluntary_sd_nm, seed=4)
    (pooled,) = fit_epochs([softened(epoch, 12.0) for epoch in epochs], "iv", settings)[1]
    (finding,) = pooled.findings
    assert finding.name == "lack_of_fit"
    assert finding.value > finding.threshold
    assert "is not J, B and K" in finding.text


def test_two_epochs_are_too_few(simulated):
    settings, epochs = simulated(2)
    (pooled,) = fit_epochs([softened(epoch, 12.0) for epoch in epochs], "iv", settings)[1]
    assert pooled.findings == ()


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
