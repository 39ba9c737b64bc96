"""Whether the claimed standard errors are the scatter that sensor noise really makes."""

import numpy as np
import pytest

from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.core.session import read_session
from rigidimeter.core.settings import Settings
from rigidimeter.virtual import PAPER_RATES

NAMES = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")


@pytest.mark.slow
@pytest.mark.parametrize("rig", [{}, PAPER_RATES], ids=["1 kHz", "paper's rates"])
def test_claimed_errors_are_within_a_third_of_the_scatter(simulate, rig):
    values, errors = [], []
    for seed in range(100):
        (epoch,), _ = read_session(simulate(seed=seed, name=f"s{seed}", rig=rig))
        fit = fit_epoch(epoch, "bandlimited", Settings())
        values.append([getattr(fit, name) for name in NAMES])
        errors.append([getattr(fit, f"{name}_se") for name in NAMES])
    scatter, claimed = np.std(values, axis=0, ddof=1), np.mean(errors, axis=0)
    print(f"claimed / scatter of J, B, K: {np.round(claimed / scatter, 2)}")
    np.testing.assert_allclose(claimed / scatter, 1.0, atol=1 / 3)
