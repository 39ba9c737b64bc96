from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

JOINT = JointDynamics(0.0045, 0.1368, 1.751)


@pytest.fixture
def truth() -> np.ndarray:
    return np.array([JOINT.inertia_kg_m2, JOINT.damping_nm_s_rad, JOINT.stiffness_nm_rad])


@pytest.fixture(scope="session")
def simulated() -> Callable[..., tuple[Settings, list[Epoch]]]:
    """Simulate epochs of a subject with a known joint; a voluntary torque and a rig may be set."""

    def run(
        n: int = 1, voluntary_sd_nm: float = 0.0, seed: int = 1, **rig: Any
    ) -> tuple[Settings, list[Epoch]]:
        settings = parse_settings(
            {
                "subject": {"OFF": {"voluntary_sd_nm": voluntary_sd_nm}},
                "protocol": {"blocks": [{"epochs": 1}]},
                "rig": rig,
            }
        )
        batch = simulate_epochs(settings, n, joints=[JOINT] * n, conditions="OFF", seed=seed)
        return settings, [batch.epoch(i) for i in range(n)]

    return run


@pytest.fixture
def quiet() -> dict[str, Any]:
    """A rig whose sensors have neither noise nor steps."""
    return {
        "torque": {"noise_sd_nm": 0.0, "resolution_nm": 0.0},
        "motion": {"angle_resolution_deg": 0.0, "velocity_resolution_deg_s": 0.0},
    }
