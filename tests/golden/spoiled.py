"""One epoch of a relaxed joint, and what spoils it: the input of the checks on an epoch."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from tests.scenarios.catalogue import SCENARIOS

Columns = dict[str, NDArray[np.float64]]
RATE_HZ = 1000.0


@cache
def _recorded(name: str) -> Mapping[str, NDArray[np.float64]]:
    (epoch,), _ = SCENARIOS[name].simulated(0, 1)
    time_s = epoch.channels["torque_nm"].time_s
    columns = {
        name: np.interp(time_s, one.time_s, one.values) for name, one in epoch.channels.items()
    }
    return {"time_s": time_s - time_s[0]} | columns


def relaxed() -> Columns:
    """Return the columns of a relaxed joint, 20 s at 1000 samples/s."""
    return {name: values.copy() for name, values in _recorded("relaxed").items()}


def write(path: Path, change: Callable[[Columns], object]) -> None:
    """Write the epoch as `change` leaves it."""
    columns = relaxed()
    change(columns)
    np.savez(path, **columns)


def _alone(columns: Columns, *kept: str) -> None:
    for name in set(columns) - {"time_s", *kept}:
        del columns[name]


def clipped(columns: Columns) -> None:
    columns["torque_nm"] = np.clip(columns["torque_nm"], -0.2, 0.2)


def frozen(columns: Columns) -> None:
    columns["torque_nm"][9000:10500] = columns["torque_nm"][9000]


def velocity_too_large(columns: Columns) -> None:
    columns["velocity_rad_s"] = 1.25 * columns["velocity_rad_s"]


def velocity_late(columns: Columns) -> None:
    columns["velocity_rad_s"] = np.roll(columns["velocity_rad_s"], 12)


def velocity_of_another_joint(columns: Columns) -> None:
    columns["velocity_rad_s"] = columns["velocity_rad_s"] + 0.3 * np.roll(
        columns["velocity_rad_s"], 7777
    )


def imposed_sinusoid(columns: Columns) -> None:
    drift = np.cumsum(np.random.default_rng(5).normal(0.0, 3e-4, columns["time_s"].size))
    _follow(columns, 0.3 * np.sin(2 * np.pi * columns["time_s"]) + drift)


def _follow(columns: Columns, angle: NDArray[np.float64]) -> None:
    """Leave a joint that is moved along an angle, and its torque with noise."""
    t = columns["time_s"]
    velocity = np.gradient(angle, t)
    noise = np.random.default_rng(1).normal(0.0, 0.01, t.size)
    torque = 0.0045 * np.gradient(velocity, t) + 0.137 * velocity + 1.75 * angle + noise
    columns |= {"torque_nm": torque, "angle_rad": angle}
    _alone(columns, "torque_nm", "angle_rad")


def narrow(columns: Columns) -> None:
    noise = np.random.default_rng(6).normal(size=columns["time_s"].size)
    band = signal.butter(2, [0.95, 1.05], "bandpass", fs=RATE_HZ, output="sos")
    _follow(columns, 2.0 * signal.sosfiltfilt(band, noise))


def noise_of_the_angle(columns: Columns) -> None:
    """White noise of 3 mrad beside motion of 30 mrad below 1 Hz, in which J hardly shows."""
    _noise_beside_slow_motion(columns, 1.0, lambda noise: noise)


def filtered_noise_of_the_angle(columns: Columns) -> None:
    """Noise of 3 mrad that went through a filter of 50 Hz, beside slow motion of 30 mrad."""
    _noise_beside_slow_motion(
        columns, 8.0, lambda noise: signal.lfilter(*signal.butter(2, 50.0, fs=RATE_HZ), noise)
    )


def _noise_beside_slow_motion(
    columns: Columns, below_hz: float, through: Callable[[object], object]
) -> None:
    noise = np.random.default_rng(8).normal(size=(2, columns["time_s"].size))
    slow = signal.butter(2, [0.3, below_hz], "bandpass", fs=RATE_HZ, output="sos")
    angle = signal.sosfiltfilt(slow, noise[0])
    _follow(columns, 0.03 * angle / angle.std())
    added = through(noise[1])
    columns["angle_rad"] = columns["angle_rad"] + 3e-3 * added / added.std()


def computed_torque(columns: Columns) -> None:
    columns["torque_nm"] = 0.137 * columns["velocity_rad_s"] + 1.75 * columns["angle_rad"]
    _alone(columns, "torque_nm", "angle_rad", "velocity_rad_s")


def torque_of_the_angle(columns: Columns) -> None:
    columns["torque_nm"] = 1.75 * columns["angle_rad"] + 40.0 * columns["angle_rad"] ** 3
    _alone(columns, "torque_nm", "angle_rad")


def torque_of_nothing(columns: Columns) -> None:
    noise = np.random.default_rng(3).normal(size=columns["time_s"].size)
    columns["torque_nm"] = 0.5 * signal.lfilter([0.05], [1, -0.95], noise)
    _alone(columns, "torque_nm", "angle_rad", "velocity_rad_s")


def reaction(columns: Columns) -> None:
    columns["torque_nm"] = -columns["torque_nm"]


def three_hundred_times(columns: Columns) -> None:
    columns["torque_nm"] = 300.0 * columns["torque_nm"]
    columns["perturbation_nm"] = 300.0 * columns["perturbation_nm"]


def late_torque(columns: Columns) -> None:
    columns["torque_nm"] = np.roll(columns["torque_nm"], 8)
    _alone(columns, "torque_nm", "angle_rad")


def friction(columns: Columns) -> None:
    columns["torque_nm"] = columns["torque_nm"] + 0.05 * np.sign(columns["velocity_rad_s"])
    _alone(columns, "torque_nm", "angle_rad")


def active_muscle(columns: Columns) -> None:
    noise = np.random.default_rng(4).normal(size=columns["time_s"].size)
    bursts = 1.0 + 20.0 * ((columns["time_s"] % 5.0) > 3.5)
    columns["emg_v"] = 1e-6 * bursts * noise


def as_it_is(columns: Columns) -> None:
    """Change nothing."""


def torque_and_angle(columns: Columns) -> None:
    _alone(columns, "torque_nm", "angle_rad")


SPOILED: Mapping[str, tuple[Callable[[Columns], object], Mapping[str, object]]] = {
    "as it is": (as_it_is, {}),
    "torque and angle alone": (torque_and_angle, {}),
    "noise of the angle": (noise_of_the_angle, {}),
    "noise of the angle behind a filter": (filtered_noise_of_the_angle, {}),
    "clipped torque": (clipped, {}),
    "frozen torque": (frozen, {}),
    "a stretch left out": (as_it_is, {"leave_out": "4:7 cough"}),
    "velocity 25 % too large": (velocity_too_large, {}),
    "velocity 12 ms late": (velocity_late, {}),
    "velocity of another shape": (velocity_of_another_joint, {}),
    "imposed sinusoid called prbs": (imposed_sinusoid, {"task": "prbs"}),
    "motion in a narrow band": (narrow, {"task": "prbs"}),
    "torque computed from the motion": (computed_torque, {}),
    "torque that follows the angle": (torque_of_the_angle, {}),
    "torque of nothing": (torque_of_nothing, {}),
    "reaction, not stated": (reaction, {}),
    "three hundred times the torque": (three_hundred_times, {}),
    "an active muscle": (active_muscle, {}),
    "torque 8 ms late": (late_torque, {}),
    "friction, torque and angle alone": (friction, {}),
    "a controller that is not the rig's": (as_it_is, {"controller": ("0.0005", "0.002")}),
    "another band": (as_it_is, {"band_hz": ("0.5", "12")}),
}
"""What is done to the epoch, and the options of the command."""
