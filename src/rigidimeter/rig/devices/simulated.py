"""The virtual rig: simulated drive, arm, subject and sensors behind the protocol of a rig."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rigidimeter.core.settings import RigSettings, SubjectSettings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model import (
    SAME_TIME_S,
    DriveSideState,
    DriveState,
    JointDynamics,
    SubjectTorque,
    arm_torque_nm,
    between,
    draw_joint,
    drive,
    drive_side,
    drive_side_step,
    drive_step,
    moment,
    one_by_one,
    quantised,
    reported_torque_nm,
    rig_streams,
    sample_times_s,
)
from rigidimeter.rig.devices.base import Reading


class SimulatedRig:
    """Drive, arm, subject and sensors, one tick for each `read`.

    The arm follows the velocity command that was in force since the last tick. Its state at the
    time of each sensor sample is exact, also between ticks. The drive measures its own torque once
    a tick, 0 without power, and sends it with angle and velocity.

    Parameters
    ----------
    settings : RigSettings
    subject : SubjectSettings
        Used until `new_epoch` changes it.
    rng : numpy.random.Generator
        Source of independent streams for sensors, jitter and subject.
    """

    def __init__(
        self, settings: RigSettings, subject: SubjectSettings, rng: np.random.Generator
    ) -> None:
        self._settings = settings
        self._interval_s = 1.0 / settings.tick_rate_hz
        self._full_tick = drive(
            settings.drive_bandwidth_hz, settings.drive_damping_ratio, self._interval_s
        )
        streams = rig_streams(rng)
        self._subject_rng, self._joint_rng = streams.subject, streams.joint
        t, m = settings.torque, settings.motion
        self._torque_sensor = _Sensor(t.latency_s, t.stamp_latency_s, t.resolution_nm)
        self._motion_sensor = _Sensor(
            m.latency_s,
            m.stamp_latency_s,
            rad_from_deg(m.angle_resolution_deg),
            rad_from_deg(m.velocity_resolution_deg_s),
        )
        self._noise = one_by_one(lambda n: t.noise_sd_nm * streams.noise.standard_normal(n))
        self._torque_times = sample_times_s(
            t.rate_hz, t.latency_s, t.jitter_s, streams.torque_jitter
        )
        self._motion_times = sample_times_s(
            m.rate_hz, m.latency_s, m.jitter_s, streams.motion_jitter
        )
        self._torque_next_s = next(self._torque_times)
        self._motion_next_s = next(self._motion_times)
        self._torque_queue: deque[tuple[float, float, float]] = deque()
        self._motion_queue: deque[tuple[float, float, float, float, float]] = deque()
        self._side, self._side_state = drive_side(settings.drive_side), DriveSideState()
        reported = 0.0 if settings.drive_side.reports_torque else math.nan
        self._drive_torques_nm = deque([reported], settings.drive_side.torque_latency_ticks + 1)
        self._reading = Reading(0.0, -t.latency_s, 0.0, 0.0, -m.latency_s)
        self._tick = 0
        self._state = DriveState()
        self._command = 0.0
        self._enabled = False
        self._bias_nm = 0.0
        self.load_nm = 0.0  # what hands or a weight put on the joint, toward positive angles
        self._voluntary_before = self._voluntary_now = 0.0
        self._set_subject(subject)

    def _set_subject(self, subject: SubjectSettings) -> None:
        self._subject = subject
        self._voluntary = one_by_one(
            SubjectTorque(subject, self._settings.tick_rate_hz, self._subject_rng.spawn(1)[0]).block
        )
        self.joint = draw_joint(subject, self._joint_rng)

    @property
    def joint(self) -> JointDynamics:
        """The true joint, which an estimate should recover."""
        return self._joint

    @joint.setter
    def joint(self, joint: JointDynamics) -> None:
        self._joint = joint
        self._J = joint.inertia_kg_m2
        self._B = joint.damping_nm_s_rad
        self._K = joint.stiffness_nm_rad

    def new_epoch(self, subject: SubjectSettings) -> JointDynamics:
        """Draw the joint of the next epoch; call while the arm is at rest."""
        if subject is not self._subject:
            self._set_subject(subject)
        else:
            self.joint = draw_joint(subject, self._joint_rng)
        return self._joint

    def connect(self) -> None:
        """Do nothing: there is no connection."""

    def configure(self) -> Mapping[str, Any]:
        """Return facts that say the rig is simulated."""
        side = self._settings.drive_side
        values = {"rated_torque_nm": side.rated_torque_nm} if side.reports_torque else {}
        return {
            "torque_sensor": {"model": "simulated"},
            "drive": {"model": "simulated", "values": values},
        }

    def zero(self, bias_nm: float) -> None:
        """Subtract `bias_nm` from every torque from now on."""
        self._bias_nm = bias_nm

    @property
    def origin_rad(self) -> float:
        """The arm starts at its initial position."""
        return 0.0

    @property
    def counts(self) -> Mapping[str, int]:
        """No messages, no counts."""
        return {}

    @property
    def powered(self) -> bool:
        """Whether it takes commands."""
        return self._enabled

    def stop(self) -> None:
        """Stop the drive."""
        self._command = 0.0

    def close(self) -> None:
        """Stop the drive and refuse commands."""
        self.disable()

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

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Advance by so many ticks and return the newest samples that have arrived."""
        for _ in range(elapsed_ticks - 1):
            self._advance()
        reading = self._advance()
        if self._bias_nm:
            return reading._replace(torque_nm=reading.torque_nm - self._bias_nm)
        return reading

    def _advance(self) -> Reading:
        """Advance by one tick."""
        now_s = self._tick * self._interval_s
        before = self._state
        if self._tick > 0:
            self._voluntary_before = self._voluntary_now
            self._voluntary_now = next(self._voluntary) + self.load_nm
            self._state = drive_step(self._full_tick, before, self._command)
        if self._settings.drive_side.reports_torque:
            self._drive_torques_nm.append(self._drive_torque_nm())
        until_s = now_s + SAME_TIME_S
        while self._torque_next_s <= until_s:
            self._take_torque(self._torque_next_s, now_s, before)
            self._torque_next_s = next(self._torque_times)
        while self._motion_next_s <= until_s:
            self._take_motion(self._motion_next_s, now_s, before)
            self._motion_next_s = next(self._motion_times)
        self._tick += 1
        torque_nm, torque_s, angle, velocity, motion_s, *_, drive_nm, drive_s = self._reading
        queue = self._torque_queue
        while queue and queue[0][0] <= until_s:
            _, torque_s, torque_nm = queue.popleft()
        samples = self._motion_queue
        while samples and samples[0][0] <= until_s:
            _, motion_s, angle, velocity, drive_nm = samples.popleft()
            drive_s = motion_s if self._settings.drive_side.reports_torque else math.nan
        self._reading = Reading(
            torque_nm,
            torque_s,
            angle,
            velocity,
            motion_s,
            drive_torque_nm=drive_nm,
            drive_torque_time_s=drive_s,
        )
        return self._reading

    def _drive_torque_nm(self) -> float:
        """Advance the drive's side to this tick and return the torque that it reports."""
        angle, velocity, acceleration = self._state
        torque_nm = arm_torque_nm(
            self._J, self._B, self._K, angle, velocity, acceleration, self._voluntary_now
        )
        self._side_state = drive_side_step(
            self._side, self._side_state, angle, acceleration, torque_nm
        )
        return reported_torque_nm(self._side, self._side_state) if self._enabled else 0.0

    def _take_torque(self, taken_s: float, now_s: float, before: DriveState) -> None:
        """Measure the torque at a time since the last tick."""
        elapsed_s, left = moment(taken_s, now_s, self._interval_s)
        angle, velocity, acceleration = self._state_after(elapsed_s, before)
        voluntary = between(self._voluntary_now, self._voluntary_before, left)
        torque_nm = next(self._noise) + arm_torque_nm(
            self._J, self._B, self._K, angle, velocity, acceleration, voluntary
        )
        sensor = self._torque_sensor
        arrives_s = taken_s + sensor.latency_s
        stamp_s = arrives_s - sensor.stamp_latency_s
        self._torque_queue.append((arrives_s, stamp_s, quantised(torque_nm, sensor.resolution)))

    def _take_motion(self, taken_s: float, now_s: float, before: DriveState) -> None:
        """Measure angle and velocity at a time since the last tick."""
        elapsed_s, _ = moment(taken_s, now_s, self._interval_s)
        angle, velocity, _ = self._state_after(elapsed_s, before)
        sensor = self._motion_sensor
        arrives_s = taken_s + sensor.latency_s
        self._motion_queue.append(
            (
                arrives_s,
                arrives_s - sensor.stamp_latency_s,
                quantised(angle, sensor.resolution),
                quantised(velocity, sensor.velocity_resolution),
                self._drive_torques_nm[0],
            )
        )

    def _state_after(self, elapsed_s: float, before: DriveState) -> DriveState:
        """Return the exact state at a time between the tick before and this one."""
        if elapsed_s == self._interval_s:
            return self._state
        if elapsed_s == 0.0:
            return before
        part = drive(
            self._settings.drive_bandwidth_hz, self._settings.drive_damping_ratio, elapsed_s
        )
        return drive_step(part, before, self._command)


class _Sensor(NamedTuple):
    latency_s: float
    stamp_latency_s: float
    resolution: float
    velocity_resolution: float = 0.0
