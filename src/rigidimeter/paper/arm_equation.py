"""Eq. 3: the arm that is moved, and the arm that moves, are the same arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from rigidimeter.dynamics import arm_response
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import AGREES, Row, within_percent
from rigidimeter.paper.context import Workshop
from rigidimeter.reporting.numbers import number

__all__ = ["ROWS"]

_FREQUENCY_HZ = 2.0
_CYCLES = 20
_RATE_HZ = 1000.0


def equation_3(workshop: Workshop) -> Row:
    """Make the row: the arm under a sinusoidal torque settles on the compliance of Eq. 3."""
    joint = printed.SEC_34
    count = round(_CYCLES * _RATE_HZ / _FREQUENCY_HZ)
    phase = 2.0 * math.pi * _FREQUENCY_HZ * np.arange(count) / _RATE_HZ
    angles, _ = arm_response(joint, np.sin(phase), 1.0 / _RATE_HZ)
    last = slice(count // 2, None)  # the beginning has died out by then
    found = 2.0 * abs(np.mean(angles[last] * np.exp(-1j * phase[last])))
    wanted = float(abs(joint.compliance_rad_nm(_FREQUENCY_HZ)))
    return Row(
        id="eq-3",
        source="Eq. 3",
        paper="J_p θ″ + B_p θ′ + K_p θ = M_meas",
        ours=f"|θ/M| at {_FREQUENCY_HZ:g} Hz {number(found)} rad/N·m stepped through time, "
        f"{number(wanted)} rad/N·m from the transfer function",
        reading="M is the torque applied to the arm, positive with θ.",
        checks=(within_percent("|θ/M| at 2 Hz", "rad/N·m", wanted, float(found), 0.5),),
        because={AGREES: "The simulated arm is Eq. 3."},
    )


ROWS: Mapping[str, Callable[[Workshop], Row]] = {"eq-3": equation_3}
