"""Epochs of a virtual subject whose joint is known, and estimates of it as arrays."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rigidimeter.core.records import Epoch, Fit
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_chunks

NAMES = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
JOINT = JointDynamics(0.0045, 0.1368, 1.751)
TRUTH = np.array([JOINT.inertia_kg_m2, JOINT.damping_nm_s_rad, JOINT.stiffness_nm_rad])
SESSION = 25
"""Epochs that are fitted together, as those of a session would be."""


def settings_with(voluntary_sd_nm: float = 0.0, **rig: Any) -> Settings:
    """Return the defaults with a subject of known joint."""
    return parse_settings(
        {
            "subject": {"OFF": {"voluntary_sd_nm": voluntary_sd_nm}},
            "protocol": {"blocks": [{"epochs": 1}]},
            "rig": rig,
        }
    )


def sessions(settings: Settings, n: int, seed: int) -> Iterator[list[Epoch]]:
    """Yield epochs in sessions."""
    joints = [JOINT] * n
    for batch in simulate_chunks(
        settings, n, chunk=SESSION, joints=joints, conditions="OFF", seed=seed, workers=2
    ):
        yield [batch.epoch(i) for i in range(len(batch))]


def array(fits: Sequence[Fit], ending: str = "") -> np.ndarray:
    """Return one number of each parameter, shape (fits, 3)."""
    return np.array([[getattr(fit, name + ending) for name in NAMES] for fit in fits])
