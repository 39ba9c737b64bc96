"""What one sample of the live estimate costs, beside a call that does nothing.

`python -m benchmarks.online` prints the rows; `rows` gives them to a table of others.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, MutableSequence, Sequence

import numpy as np

from benchmarks.paired import Row
from rigidimeter.core.settings import OnlineSettings
from rigidimeter.model import STATE_SIZE, online_design, online_step

REPEATS = 7
SAMPLES = 20_000
RATE_HZ = 1000.0

Step = Callable[[Sequence[float], MutableSequence[float], float, float, float], float]


def nothing(
    design: Sequence[float],
    state: MutableSequence[float],
    torque_nm: float,
    angle_rad: float,
    velocity_rad_s: float,
) -> float:
    """Be called like a step."""
    return torque_nm


def run(
    step: Step,
    design: Sequence[float],
    state: MutableSequence[float],
    samples: list[list[float]],
) -> float:
    """Return the seconds that a call took, on average over all samples."""
    start = time.perf_counter()
    for torque_nm, angle_rad, velocity_rad_s in samples:
        step(design, state, torque_nm, angle_rad, velocity_rad_s)
    return (time.perf_counter() - start) / len(samples)


def rows() -> list[Row]:
    """Return what was measured: a call of ours, and one that does nothing."""
    t = np.arange(SAMPLES) / RATE_HZ
    rng = np.random.default_rng(0)
    angle, velocity = 0.1 * np.sin(6.0 * t), 0.6 * np.cos(6.0 * t)
    torque = 0.14 * velocity + 1.7 * angle + 0.01 * rng.standard_normal(SAMPLES)
    samples = np.column_stack([torque, angle, velocity]).tolist()
    design = online_design(OnlineSettings(), RATE_HZ)
    times = []
    for _ in range(REPEATS + 1):
        ours = run(online_step, design, [0.0] * STATE_SIZE, samples)
        times.append((ours, run(nothing, design, [0.0] * STATE_SIZE, samples)))
    ours, bare = (statistics.median(column) for column in zip(*times[1:], strict=True))
    return [Row("a sample of the live estimate / an empty call", 1e6 * ours, 1e6 * bare, "µs")]


if __name__ == "__main__":
    for row in rows():
        print(row)
