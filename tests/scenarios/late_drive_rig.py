"""A rig whose drive is late and whose tachometer is noisy, solved exactly; numpy and scipy alone.

Angles in rad, torques in N·m, positive toward positive angle. M is the torque between rig and limb,
m the subject's own:

    joint       J θ'' + B θ' + K θ = M + m
    controller  J_c c' + B_c c = r − F M, at each tick, forward Euler; F is of first order
    drive       θ''' = ω² (c(t − τ) − θ') − 2 ζ ω θ'', or of first order θ'' = ω (c(t − τ) − θ')
    torque      M and noise of first order beside white noise
    encoder     rounded to its step
    tachometer  θ' and white noise

The command of a tick reaches the drive τ later and is held, so between two ticks the drive has two
commands, each for a known time: the state of a linear system under a constant, by the matrix
exponential. Torque and motion are sampled at the tick, before its command is made. All epochs are
advanced at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import butter, lfilter, sosfilt

from rigidimeter.core.records import Channel, Epoch

Array = NDArray[np.float64]


class Limb(NamedTuple):
    """A joint, and the loop and perturbation that fit it; SI units.

    Attributes
    ----------
    joint : (float, float, float)
        J in kg·m², B in N·m·s/rad, K in N·m/rad.
    controller : (float, float)
        J_c in kg·m², B_c in N·m·s/rad.
    perturbation_nm : float
        Amplitude of the random binary r.
    pushing_nm : float
        SD of m of a subject who pushes.
    """

    joint: tuple[float, float, float]
    controller: tuple[float, float]
    perturbation_nm: float
    pushing_nm: float


LIMBS = {
    "human": Limb((0.075, 0.9, 11.0), (0.15, 3.0), 2.5, 0.8),
    "small": Limb((0.0015, 0.03, 0.5), (0.01, 0.25), 0.25, 0.06),
}


@dataclass(frozen=True)
class LateRig:
    """A rig.

    Attributes
    ----------
    limb : str
        A name in `LIMBS`.
    pushing : bool
    order : {1, 2}
        Of the drive.
    drive_hz, damping_ratio, late_s : float
        ω / 2π, ζ, τ.
    tick_hz, cutoff_hz, chip_s : float
        Of the loop, of F, and how long r is held.
    torque_noise_nm, coloured_nm, coloured_hz : float
        White noise of the torque; SD and corner of that of first order. For a perturbation of
        1 N·m.
    encoder_counts : int
        Per turn.
    tachometer_rad_s : float
        SD of its noise.
    """

    limb: str = "human"
    pushing: bool = False
    order: int = 2
    drive_hz: float = 25.0
    damping_ratio: float = 0.7
    late_s: float = 0.0023
    tick_hz: float = 1000.0
    cutoff_hz: float = 20.0
    chip_s: float = 0.04
    torque_noise_nm: float = 0.004
    coloured_nm: float = 0.004
    coloured_hz: float = 5.0
    encoder_counts: int = 2**17
    tachometer_rad_s: float = 0.01

    @property
    def truth(self) -> Array:
        """J, B and K."""
        return np.array(LIMBS[self.limb].joint)

    def settings(self) -> dict[str, dict[str, float]]:
        """Return what the settings of the package say of this rig's controller."""
        inertia, damping = LIMBS[self.limb].controller
        return {"controller": {"inertia_kg_m2": inertia, "damping_nm_s_rad": damping,
                               "torque_cutoff_hz": self.cutoff_hz}}  # fmt: skip


def simulate(rig: LateRig, recording: int, epochs: int, duration_s: float = 20.0) -> list[Epoch]:
    """Return the epochs of a recording, all with its perturbation."""
    limb, tick_s = LIMBS[rig.limb], 1.0 / rig.tick_hz
    n = round(duration_s * rig.tick_hz)
    sources = [np.random.default_rng((recording, epoch)) for epoch in range(epochs)]
    perturbation = _binary(rig, np.random.default_rng(recording), n)
    own = np.stack([_pushed(rig, one, n) for one in sources], axis=1)
    noise = np.stack([_torque_noise(rig, one, n) for one in sources], axis=1)

    whole = int(rig.late_s // tick_s)
    first_s = rig.late_s - whole * tick_s
    before, after = _step(rig, first_s), _step(rig, tick_s - first_s)
    J, B, K = limb.joint
    J_c, B_c = limb.controller
    share = 1.0 - np.exp(-2 * np.pi * rig.cutoff_hz * tick_s)
    sent = np.zeros((n + whole + 2, epochs))  # the command of tick k in row k + whole + 2
    state, smooth, command = np.zeros((3, epochs)), np.zeros(epochs), np.zeros(epochs)
    torque, angle, velocity = (np.empty((n, epochs)) for _ in range(3))
    for k in range(n):
        acting = sent[k + 1]
        theta, speed = state[0], state[1]
        acceleration = state[2] if rig.order == 2 else _omega(rig) * (acting - speed)
        torque[k] = J * acceleration + B * speed + K * theta - own[k] + noise[k]
        angle[k], velocity[k] = theta, speed
        smooth = smooth + share * (torque[k] - smooth)
        command = command + tick_s / J_c * (perturbation[k] - smooth - B_c * command)
        sent[k + whole + 2] = command
        # Up to `first_s` the command before the one that acts next, which is this tick's if τ < T.
        state = before[0] @ state + before[1] * acting
        state = after[0] @ state + after[1] * sent[k + 2]
    step = 2 * np.pi / rig.encoder_counts
    angle = np.round(angle / step) * step
    velocity += rig.tachometer_rad_s * np.stack([one.standard_normal(n) for one in sources], axis=1)
    columns = {
        "torque_nm": torque,
        "angle_rad": angle,
        "velocity_rad_s": velocity,
        "velocity_command_rad_s": sent[whole + 2 :],
        "perturbation_nm": np.repeat(perturbation[:, None], epochs, axis=1),
    }
    time_s = np.arange(n) / rig.tick_hz
    return [
        Epoch(
            f"{rig.limb} {recording}",
            str(i + 1),
            {name: Channel(name, time_s, column[:, i].copy()) for name, column in columns.items()},
            task="prbs",
        )
        for i in range(epochs)
    ]


def _omega(rig: LateRig) -> float:
    return 2 * np.pi * rig.drive_hz


def _step(rig: LateRig, length_s: float) -> tuple[Array, Array]:
    """Return Φ and Γ, shape (3, 1), of x → Φ x + Γ c for x = (θ, θ', θ'')."""
    omega, system = _omega(rig), np.zeros((4, 4))
    system[0, 1] = 1.0
    if rig.order == 2:
        system[1, 2] = 1.0
        system[2] = 0.0, -(omega**2), -2 * rig.damping_ratio * omega, omega**2
    else:
        system[1, 1], system[1, 3] = -omega, omega
    made = expm(system * length_s)
    return made[:3, :3], made[:3, 3:]


def _binary(rig: LateRig, random: np.random.Generator, n: int) -> Array:
    held = round(rig.chip_s * rig.tick_hz)
    signs = 2.0 * random.integers(0, 2, n // held + 1) - 1.0
    return LIMBS[rig.limb].perturbation_nm * np.repeat(signs, held)[:n]


def _pushed(rig: LateRig, random: np.random.Generator, n: int) -> Array:
    if not rig.pushing:
        return np.zeros(n)
    white = random.standard_normal(n)
    band = butter(2, (0.3, 4.0), "bandpass", fs=rig.tick_hz, output="sos")
    torque = np.asarray(sosfilt(band, white))
    return LIMBS[rig.limb].pushing_nm * torque / np.std(torque)


def _torque_noise(rig: LateRig, random: np.random.Generator, n: int) -> Array:
    decay = np.exp(-2 * np.pi * rig.coloured_hz / rig.tick_hz)
    slow = np.asarray(lfilter([np.sqrt(1 - decay**2)], [1, -decay], random.standard_normal(n)))
    noise = rig.torque_noise_nm * random.standard_normal(n) + rig.coloured_nm * slow
    return LIMBS[rig.limb].perturbation_nm * noise
