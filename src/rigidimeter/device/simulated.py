"""The virtual rig: a device like any other, with a simulated drive, arm, subject and sensors."""

from __future__ import annotations

from collections import deque

import numpy as np

from rigidimeter.device.base import Reading
from rigidimeter.joint import JointDynamics
from rigidimeter.settings import RigSettings, SubjectSettings
from rigidimeter.simulation import (
    DriveState,
    SampleClock,
    SubjectTorque,
    arm_torque_nm,
    draw_joint,
    drive,
    drive_step,
    quantised,
)
from rigidimeter.units import rad_from_deg

__all__ = ["SimulatedRig"]

BLOCK_TICKS = 5000
"""Random numbers are drawn in blocks of this many ticks."""

SAME_TIME_S = 1e-9
"""Two times closer than this are the same: stamps are sums of rounded numbers."""


class SimulatedRig:
    """Drive, arm, subject and sensors, one tick for each `read`.

    The arm is driven by the velocity command in force since the last tick; its state at the time of
    each sensor sample is exact, also between ticks.

    Parameters
    ----------
    settings : RigSettings
    subject : SubjectSettings
        In force until `new_epoch` changes it.
    rng : numpy.random.Generator
        Gives independent streams to sensors, jitter and subject.
    """

    def __init__(
        self, settings: RigSettings, subject: SubjectSettings, rng: np.random.Generator
    ) -> None:
        self._settings = settings
        self._interval_s = 1.0 / settings.tick_rate_hz
        self._whole_tick = drive(
            settings.drive_bandwidth_hz, settings.drive_damping_ratio, self._interval_s
        )
        torque_rng, noise_rng, motion_rng, self._subject_rng, self._joint_rng = rng.spawn(5)
        self._noise_rng = noise_rng
        t, m = settings.torque, settings.motion
        self._torque_clock = SampleClock(t.rate_hz, t.latency_s, t.jitter_s, torque_rng)
        self._motion_clock = SampleClock(m.rate_hz, m.latency_s, m.jitter_s, motion_rng)
        self._angle_step_rad = rad_from_deg(m.angle_resolution_deg)
        self._velocity_step_rad_s = rad_from_deg(m.velocity_resolution_deg_s)
        self._torque_queue: deque[tuple[float, float, float]] = deque()
        self._motion_queue: deque[tuple[float, float, float, float]] = deque()
        self._reading = Reading(0.0, -t.latency_s, 0.0, 0.0, -m.latency_s)
        self._tick = 0
        self._state = DriveState()
        self._command = 0.0
        self._enabled = False
        self._noise: list[float] = noise_rng.standard_normal(BLOCK_TICKS).tolist()
        self._noise_sd_nm, self._torque_step_nm = t.noise_sd_nm, t.resolution_nm
        self._noise_used = 0
        self._voluntary_before = self._voluntary_now = 0.0
        self._set_subject(subject)

    def _set_subject(self, subject: SubjectSettings) -> None:
        self._subject = subject
        self._torque_source = SubjectTorque(
            subject, self._settings.tick_rate_hz, self._subject_rng.spawn(1)[0]
        )
        self._voluntary = self._torque_source.block(BLOCK_TICKS).tolist()
        self._voluntary_used = 0
        self.joint = draw_joint(subject, self._joint_rng)

    @property
    def joint(self) -> JointDynamics:
        """The joint as it is: what an estimate should give back."""
        return self._joint

    @joint.setter
    def joint(self, joint: JointDynamics) -> None:
        self._joint = joint
        self._J = joint.inertia_kg_m2
        self._B = joint.damping_nm_s_rad
        self._K = joint.stiffness_nm_rad

    def new_epoch(self, subject: SubjectSettings) -> JointDynamics:
        """Draw the joint of the next epoch; call while the arm rests."""
        if subject is not self._subject:
            self._set_subject(subject)
        else:
            self.joint = draw_joint(subject, self._joint_rng)
        return self._joint

    def enable(self) -> None:
        """Accept commands, from zero velocity."""
        self._command = 0.0
        self._enabled = True

    def write(self, velocity_rad_s: float) -> float:
        """Take a velocity command; a drive without power ignores it."""
        self._command = velocity_rad_s if self._enabled else 0.0
        return self._command

    def disable(self) -> None:
        """Stop the drive and refuse commands."""
        self._command = 0.0
        self._enabled = False

    def read(self) -> Reading:
        """Advance one tick and return the newest samples that have arrived."""
        if self._tick > 0:
            self._advance()
        else:
            self._sample(0.0, 0.0, self._state)
        now = self._tick * self._interval_s
        self._tick += 1
        torque, motion = self._torque_queue, self._motion_queue
        reading = self._reading
        fresh = False
        torque_nm, torque_s, angle, velocity, motion_s = reading
        while torque and torque[0][0] <= now + SAME_TIME_S:
            _, torque_s, torque_nm = torque.popleft()
            fresh = True
        while motion and motion[0][0] <= now + SAME_TIME_S:
            _, motion_s, angle, velocity = motion.popleft()
            fresh = True
        if fresh:
            reading = Reading(torque_nm, torque_s, angle, velocity, motion_s)
            self._reading = reading
        return reading

    def _advance(self) -> None:
        if self._voluntary_used == BLOCK_TICKS:
            self._voluntary = self._torque_source.block(BLOCK_TICKS).tolist()
            self._voluntary_used = 0
        self._voluntary_before = self._voluntary_now
        self._voluntary_now = self._voluntary[self._voluntary_used]
        self._voluntary_used += 1
        before = self._state
        self._state = drive_step(self._whole_tick, before, self._command)
        self._sample((self._tick - 1) * self._interval_s, self._tick * self._interval_s, before)

    def _sample(self, start_s: float, stop_s: float, before: DriveState) -> None:
        """Take the samples that fall between two ticks, the later one included."""
        until_s = stop_s + SAME_TIME_S
        clock = self._torque_clock
        while clock.next_s <= until_s:
            self._take_torque(clock.next_s, start_s, stop_s, before)
            clock.advance()
        clock = self._motion_clock
        while clock.next_s <= until_s:
            self._take_motion(clock.next_s, start_s, stop_s, before)
            clock.advance()

    def _take_torque(
        self, taken_s: float, start_s: float, stop_s: float, before: DriveState
    ) -> None:
        angle, velocity, acceleration = self._state_at(taken_s, start_s, stop_s, before)
        voluntary = self._voluntary_now
        if taken_s < stop_s - SAME_TIME_S:
            fraction = max((taken_s - start_s) / self._interval_s, 0.0)
            voluntary -= (1.0 - fraction) * (voluntary - self._voluntary_before)
        if self._noise_used == BLOCK_TICKS:
            self._noise = self._noise_rng.standard_normal(BLOCK_TICKS).tolist()
            self._noise_used = 0
        torque_nm = self._noise_sd_nm * self._noise[self._noise_used] + arm_torque_nm(
            self._J, self._B, self._K, angle, velocity, acceleration, voluntary
        )
        self._noise_used += 1
        arrives_s = taken_s + self._torque_clock.latency_s
        self._torque_queue.append(
            (
                arrives_s,
                arrives_s - self._settings.torque.stamp_latency_s,
                quantised(torque_nm, self._torque_step_nm),
            )
        )

    def _take_motion(
        self, taken_s: float, start_s: float, stop_s: float, before: DriveState
    ) -> None:
        angle, velocity, _ = self._state_at(taken_s, start_s, stop_s, before)
        arrives_s = taken_s + self._motion_clock.latency_s
        self._motion_queue.append(
            (
                arrives_s,
                arrives_s - self._settings.motion.stamp_latency_s,
                quantised(angle, self._angle_step_rad),
                quantised(velocity, self._velocity_step_rad_s),
            )
        )

    def _state_at(
        self, time_s: float, start_s: float, stop_s: float, before: DriveState
    ) -> DriveState:
        if time_s >= stop_s - SAME_TIME_S:
            return self._state
        if time_s <= start_s + SAME_TIME_S:
            return before
        part = drive(
            self._settings.drive_bandwidth_hz,
            self._settings.drive_damping_ratio,
            time_s - start_s,
        )
        return drive_step(part, before, self._command)
