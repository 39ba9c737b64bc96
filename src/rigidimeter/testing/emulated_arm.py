"""The arm and drive behind the emulators, at any time.

Emulators are read at any time, not at fixed ticks. At each call the state is advanced exactly to
the present time, under the command in force since the last call. The equations are those of
`rigidimeter.model.velocity_drive`, `joint` and `drive_side`.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import numpy as np

from rigidimeter.core.settings import DriveSideSettings
from rigidimeter.model import (
    DriveSideState,
    DriveState,
    JointDynamics,
    arm_torque_nm,
    drive,
    drive_side_step,
    drive_step,
    reported_torque_nm,
)
from rigidimeter.model import drive_side as make_drive_side

LONGEST_STEP_S = 0.5
DAMPING_RATIO = 0.7071
"""Of the drive."""


class EmulatedArm:
    """A joint on a velocity drive, shared by several emulators; thread-safe.

    Parameters
    ----------
    joint : JointDynamics
        The true joint, which an estimate should recover.
    bandwidth_hz : float
        Of the drive.
    noise_sd_nm : float
        Standard deviation of each torque reading.
    voluntary_nm : callable
        Voluntary torque in N·m as a function of the time in s since the start.
    seed : int
        Of the noise.
    now : callable
        Monotonic time in s.
    drive_side : DriveSideSettings, optional
        Motor and gear of the drive, and how it reports its torque; by default a small joint's.
    """

    def __init__(
        self,
        joint: JointDynamics,
        *,
        bandwidth_hz: float = 50.0,
        noise_sd_nm: float = 0.005,
        voluntary_nm: Callable[[float], float] = lambda _: 0.0,
        seed: int = 1,
        now: Callable[[], float] = time.monotonic,
        drive_side: DriveSideSettings | None = None,
    ) -> None:
        self.joint = joint
        self.drive_side = side = drive_side or DriveSideSettings()
        self.voluntary_nm = voluntary_nm
        self._bandwidth_hz = bandwidth_hz
        self._noise_sd_nm = noise_sd_nm
        self._rng = np.random.default_rng(seed)
        self._now = now
        self._start_s = self._at_s = now()
        self._state = DriveState()
        self._side, self._side_state = make_drive_side(side), DriveSideState()
        self._target_rad_s = 0.0
        self._command_rad_s = 0.0
        self._ramp_rad_s2 = np.inf
        self.torque_limit_nm = np.inf
        """The largest torque of the motor, by the drive's own scale."""
        self.saturated = False
        """Whether the drive wanted more than that in the last step."""
        self._lock = threading.RLock()

    def command(self, velocity_rad_s: float, ramp_rad_s2: float = np.inf) -> None:
        """Set the target velocity; the command changes toward it at `ramp_rad_s2` at most."""
        with self._lock:
            self._advance()
            self._target_rad_s, self._ramp_rad_s2 = velocity_rad_s, ramp_rad_s2

    def release(self) -> None:
        """Remove the power: the brake stops the arm as fast as the drive's bandwidth allows."""
        self.command(0.0)

    def motion(self) -> tuple[float, float]:
        """Return the present angle in rad and velocity in rad/s."""
        with self._lock:
            self._advance()
            return self._state.angle_rad, self._state.velocity_rad_s

    def lag_rad_s(self) -> float:
        """Return by how much the velocity is behind the command as it is after its ramp."""
        with self._lock:
            self._advance()
            return self._command_rad_s - self._state.velocity_rad_s

    def torque_nm(self) -> float:
        """Return the present torque from the drive on the joint, plus sensor noise, in N·m."""
        with self._lock:
            self._advance()
            return self._torque_nm() + self._noise_sd_nm * float(self._rng.standard_normal())

    def drive_torque_nm(self) -> float:
        """Return the present torque of the motor, by the drive's own scale and in its steps."""
        with self._lock:
            self._advance()
            return reported_torque_nm(self._side, self._side_state)

    def _torque_nm(self) -> float:
        joint = self.joint
        return arm_torque_nm(
            joint.inertia_kg_m2,
            joint.damping_nm_s_rad,
            joint.stiffness_nm_rad,
            *self._state,
            self.voluntary_nm(self._at_s - self._start_s),
        )

    def place(self, angle_rad: float) -> None:
        """Put the arm at an angle, at rest, as if moved by hand."""
        with self._lock:
            self._advance()
            self._state = DriveState(angle_rad)
            self._side_state = self._side_state._replace(angle_rad=angle_rad)
            self._command_rad_s = self._target_rad_s = 0.0

    def _advance(self) -> None:
        now_s = self._now()
        elapsed_s = min(now_s - self._at_s, LONGEST_STEP_S)
        self._at_s = now_s
        # A ramp changes the command during the step, so it is divided into short steps.
        while elapsed_s > 1e-9:
            ramping = self._command_rad_s != self._target_rad_s
            fine = ramping or np.isfinite(self.torque_limit_nm)
            step_s = min(elapsed_s, 1e-3) if fine else elapsed_s
            if ramping:
                change = self._ramp_rad_s2 * step_s
                missing = self._target_rad_s - self._command_rad_s
                self._command_rad_s += max(-change, min(change, missing))
            coefficients = drive(self._bandwidth_hz, DAMPING_RATIO, step_s)
            wanted = drive_step(coefficients, self._state, self._command_rad_s)
            self._state = self._as_limited(wanted, step_s)
            elapsed_s -= step_s
        angle, _, acceleration = self._state
        self._side_state = drive_side_step(
            self._side, self._side_state, angle, acceleration, self._torque_nm()
        )

    def _as_limited(self, wanted: DriveState, step_s: float) -> DriveState:
        """Return the state after a step in which the motor gives its torque limit at most.

        A drive that cannot give what its loop asks for gives its limit L, so the joint accelerates
        by θ″ = (±L − F − (M − J θ″)) / (J + J_d), with the friction F against the motion.
        """
        limit_nm = self.drive_side.torque_scale * self.torque_limit_nm
        self.saturated = False
        if not np.isfinite(limit_nm):
            return wanted
        joint, before = self.joint, self._state
        inertia = joint.inertia_kg_m2 + self.drive_side.reflected_inertia_kg_m2
        velocity = before.velocity_rad_s
        pull_nm = arm_torque_nm(
            *(0.0, joint.damping_nm_s_rad, joint.stiffness_nm_rad),
            *(before.angle_rad, velocity, 0.0, self.voluntary_nm(self._at_s - self._start_s)),
        )
        friction_nm = self.drive_side.friction_nm
        change = wanted.velocity_rad_s - velocity
        moving = velocity if velocity else change
        drag_nm = np.copysign(friction_nm, moving) if moving else 0.0
        asked_nm = inertia * change / step_s + pull_nm + drag_nm
        if abs(asked_nm) <= limit_nm:
            return wanted
        self.saturated = True
        given_nm = float(np.copysign(limit_nm, asked_nm))
        if not velocity and abs(given_nm - pull_nm) <= friction_nm:
            return DriveState(before.angle_rad)
        left_nm = given_nm - pull_nm
        drag_nm = np.copysign(friction_nm, velocity if velocity else left_nm)
        after = velocity + float(left_nm - drag_nm) / inertia * step_s
        if velocity * after < 0.0 and abs(left_nm) <= friction_nm:
            after = 0.0  # friction stops a motion and does not turn it
        angle = before.angle_rad + 0.5 * (velocity + after) * step_s
        return DriveState(angle, after, (after - velocity) / step_s)
