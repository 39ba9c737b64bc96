"""How fast the paper's rig was sampled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["PAPER_RATES"]

PAPER_RATES: Mapping[str, Any] = {
    "torque": {"rate_hz": 100.0},
    "motion": {"rate_hz": 50.0, "jitter_s": 0.005},
}
"""Sec. 2.2: torque at 100 samples/s, angle and velocity at 50 with sporadic jitter."""
