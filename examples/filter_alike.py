"""Show the bias of J, B and K from a high-pass on the position alone.

    rigidimeter simulate --out session --task prbs --epochs 10
    python examples/filter_alike.py session

The joint of a virtual session is known. Each row is the median error over the epochs, in percent.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfilt, sosfiltfilt

from rigidimeter.analysis.estimation import Signals, fit_inertia_damping_stiffness
from rigidimeter.core.records import Epoch
from rigidimeter.core.session import read_session, session_settings

Array = NDArray[np.float64]
Filter = Callable[[Array], Array]

TRUTH = np.array([0.0045, 0.1368, 1.751])
"""J, B, K of subject OFF in the default settings."""

HIGHPASS_HZ = 0.2


def measured(epoch: Epoch) -> Signals:
    """Return the measured signals on one grid, unfiltered."""
    channels = [epoch.channels[name] for name in ("torque_nm", "velocity_rad_s", "angle_rad")]
    rate_hz = channels[0].rate_hz
    start_s = max(one.time_s[0] for one in channels)
    time_s = np.arange(start_s, min(one.time_s[-1] for one in channels), 1 / rate_hz)
    torque, velocity, angle = (CubicSpline(one.time_s, one.values) for one in channels)
    motion = velocity.derivative()(time_s), velocity(time_s), angle(time_s)
    return Signals(time_s, torque(time_s), *motion, rate_hz, (0.0, rate_hz / 2))


def position_only(raw: Signals, high_pass: Filter) -> Signals:
    """Filter only the position."""
    return replace(raw, angle_rad=high_pass(raw.angle_rad))


def all_alike(raw: Signals, high_pass: Filter) -> Signals:
    """Apply the same filter to torque, acceleration, velocity and position."""
    return replace(
        raw,
        torque_nm=high_pass(raw.torque_nm),
        acceleration_rad_s2=high_pass(raw.acceleration_rad_s2),
        velocity_rad_s=high_pass(raw.velocity_rad_s),
        angle_rad=high_pass(raw.angle_rad),
    )


def main(folder: Path) -> None:
    """Print one row for each kind of filtering."""
    order = session_settings(folder).estimation.published_highpass_order
    raw = [measured(epoch) for epoch in read_session(folder)[0] if epoch.task == "prbs"]
    sos = butter(order, HIGHPASS_HZ, "highpass", fs=raw[0].rate_hz, output="sos")
    causal: Filter = lambda values: sosfilt(sos, values)  # noqa: E731
    memory = round(raw[0].rate_hz / HIGHPASS_HZ)  # mirror-image extension at both ends
    zero_phase: Filter = lambda values: sosfiltfilt(  # noqa: E731
        sos, values, padtype="even", padlen=memory
    )
    ways: dict[str, Callable[[Signals], Signals]] = {
        "no filter": lambda s: s,
        "position only, causal": lambda s: position_only(s, causal),
        "position only, zero phase": lambda s: position_only(s, zero_phase),
        "all four, causal": lambda s: all_alike(s, causal),
        "all four, zero phase": lambda s: all_alike(s, zero_phase),
    }
    print(f"{'high-pass at 0.2 Hz':26} {'J %':>7} {'B %':>7} {'K %':>7} {'R²':>7}")
    for name, way in ways.items():
        found = [fit_inertia_damping_stiffness(way(signals)) for signals in raw]
        error = 100 * (np.median([fit.value for fit in found], axis=0) / TRUTH - 1)
        r_squared = np.median([fit.r_squared for fit in found])
        print(f"{name:26} {error[0]:7.2f} {error[1]:7.2f} {error[2]:7.2f} {r_squared:7.3f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
