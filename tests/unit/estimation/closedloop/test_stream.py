from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.estimation import fit_epochs
from rigidimeter.estimation.closedloop.epoch_stream import EpochStream
from rigidimeter.records import Channel
from rigidimeter.virtual.study_design import PAPER_RATES

NAMES = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")


def test_a_stream_gives_what_the_epochs_give_together(simulated):
    settings, epochs = simulated(16, voluntary_sd_nm=0.1)
    stream = EpochStream(epochs, settings)
    values = np.vstack([stream.estimate(epochs[:5]), stream.estimate(epochs[5:])])
    fits, (pooled,) = fit_epochs(epochs, "iv", settings)
    single = np.array([[getattr(fit, name) for name in NAMES] for fit in fits])
    np.testing.assert_allclose(values, single, rtol=1e-6)
    together, covariance = stream.pooled()
    np.testing.assert_allclose(together, [getattr(pooled, name) for name in NAMES], rtol=1e-6)
    errors = [getattr(pooled, f"{name}_se") for name in NAMES]
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), errors, rtol=1e-4)


def test_other_stamps_are_refused(simulated):
    settings, epochs = simulated(2)
    stream = EpochStream(epochs, settings)
    torque = epochs[0].channels["torque_nm"]
    thinned = Channel("torque_nm", torque.time_s[::2], torque.values[::2])
    other = replace(epochs[0], channels={**epochs[0].channels, "torque_nm": thinned})
    with pytest.raises(ValueError, match="other stamps"):
        stream.estimate([other])
    with pytest.raises(ValueError, match="at least two"):
        stream.pooled()


def test_channels_that_were_not_sampled_together_are_refused(simulated):
    settings, epochs = simulated(2, **PAPER_RATES)
    with pytest.raises(ValueError, match="sampled together"):
        EpochStream(epochs, settings)
