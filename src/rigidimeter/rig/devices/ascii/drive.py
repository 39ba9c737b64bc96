"""A serial servo drive of the Copley type that stops by itself when commands cease.

In its velocity mode such a drive keeps the last velocity for ever: if the computer dies, the arm
moves on to the mechanical stop. So, in ``mode = "moves"``, every command is a move that ends: an
absolute target a short distance ahead, at the wanted velocity, renewed by each command. The drive
holds the velocity for `horizon_s` after the last command and then brakes with its own
deceleration. It is at rest within

    horizon_s + v / deceleration

even if the computer is dead. ``mode = "velocity"`` has no such end and is refused unless
`external_watchdog` says that a relay removes the power when the loop's pulses cease.

A cycle sends target, velocity and start, then reads position, velocity, the motor's current where
`torque_nm_per_a` says what torque that is, and in turn the event status or the desired state.
`read` and `write` only exchange batches with a thread (see `line`). A command during an unfinished
cycle is not sent, and `write` returns the one still in force. The velocity is the drive's own
register, computed at its control rate; differences of positions would contain the jitter of time
stamps from a serial line.

If the loop was held up for longer than the horizon, the drive has stopped by itself and must not be
started again: commands are zero from then on, as after any fault, until `enable`.

`language` lists what is from memory of the programmer's guide. A USB adapter adds its latency timer
to every reply; set it to 1 ms.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from rigidimeter.rig.devices.ascii.drive_bounds import write_bounds
from rigidimeter.rig.devices.ascii.language import Feedback, move_target, read_request, set_request
from rigidimeter.rig.devices.ascii.line import AsciiLine
from rigidimeter.rig.devices.ascii.setup import (
    OFF,
    PATIENCE,
    AsciiDriveSettings,
    AsciiTalk,
    open_port,
)
from rigidimeter.rig.devices.base import DeviceError, DeviceFacts, MotionSample, Now
from rigidimeter.rig.devices.bounds import BOUND_FACT, BoundFound, DriveBounds, Tight
from rigidimeter.rig.guard import Cause

VELOCITY, MOVES = 11, 21
CYCLES_IN_HORIZON = 3


class AsciiDrive:
    """A `VelocityDrive` on a serial line.

    Parameters
    ----------
    settings : AsciiDriveSettings
    now : callable
        Monotonic time in s.
    """

    Settings: ClassVar[type[AsciiDriveSettings]] = AsciiDriveSettings

    def __init__(self, settings: AsciiDriveSettings, now: Now) -> None:
        self._settings = settings
        self._now = now
        per_deg = settings.counts_per_turn / 360.0
        self._per_rad = settings.sign * settings.counts_per_turn / (2.0 * math.pi)
        self._offset_rad = math.radians(settings.angle_offset_deg)
        self._nm_per_a = settings.sign * settings.torque_nm_per_a
        self._fastest = settings.max_velocity_deg_s * per_deg
        self._acceleration = settings.acceleration_deg_s2 * per_deg
        self._braking = self._deceleration = settings.deceleration_deg_s2 * per_deg
        self._jump = settings.jump_deg * per_deg
        self._state_on = MOVES if settings.mode == "moves" else VELOCITY
        self._line: AsciiLine | None = None
        self._speaking = self._configured = False
        self._bounds: DriveBounds | None = None
        self._tight: Tight | None = None
        self.bounds: tuple[BoundFound, ...] = ()
        """What came of each bound when it was written last."""
        self._powered = self._commanding = False
        self._reported_off = True
        self._cycle_s = 0.0
        self._sent = 0  # in 0.1 counts/s, on the drive's side of the sign
        self._commanded_s = -math.inf
        self._cycle = 0
        self._asked_why = False
        self._feedback = Feedback(settings.baud, self._jump, self._fastest, self._state_on)

    def bound(self, bounds: DriveBounds) -> None:
        """Have these bounds written by the next `configure` and every `enable`."""
        self._bounds = bounds

    def tighten(self, tight: Tight | None) -> None:
        """Have one bound so tight from the next `enable` on that a move must hit it; None: none."""
        self._tight = tight

    # -- set-up -------------------------------------------------------------------------------

    def connect(self) -> None:
        """Open the port at the power-up baud rate; nothing is sent.

        Raises
        ------
        DeviceError
            If pyserial is missing or the port cannot be opened.
        """
        if self._line is not None:
            return
        self._line = AsciiLine(open_port(self._settings), self._now)

    def configure(self) -> DeviceFacts:
        """Set the baud rate, remove the power, set the profile and read everything back.

        Raises
        ------
        DeviceError
            If the drive does not answer, has a fault, does not accept a value, or is too slow
            for the horizon.
        """
        s = self._settings
        if s.mode == "velocity" and not s.external_watchdog:
            raise DeviceError(
                'drive: mode = "velocity" keeps its last velocity when the computer dies; use '
                'mode = "moves", or set external_watchdog = true if a relay cuts the power then'
            )
        self._configured = False
        talk = self._talking()
        talk.agree_on_baud()
        self._speaking = True
        talk.set(0x24, OFF)
        self._powered = self._commanding = False
        latched = talk.clear_faults()
        self._deceleration = talk.write_profile(self._acceleration, self._braking)
        self._write_bounds(talk, None)
        self._cycle_s = talk.measured_cycle_s(self._now)
        if s.mode == "moves" and s.horizon_s < CYCLES_IN_HORIZON * self._cycle_s:
            raise DeviceError(
                f"drive: horizon_s = {s.horizon_s:g} is too short for a cycle of "
                f"{1e3 * self._cycle_s:.1f} ms at {s.baud} baud; at least "
                f"{CYCLES_IN_HORIZON * self._cycle_s:.3f} would do, or a higher baud"
            )
        self._start_sampling()
        self._configured = True
        values: dict[str, str | float | int] = {
            "baud": s.baud,
            "mode": s.mode,
            "cycle_s": self._cycle_s,
            "latched_faults_before": latched,
            "counts_per_turn": s.counts_per_turn,
            "deceleration_counts_s2": self._deceleration,
            "braking_rad_s2": self._deceleration / abs(self._per_rad),
            "external_watchdog": int(s.external_watchdog),
        }
        values.update({f"{BOUND_FACT} {bound.name}": bound.words for bound in self.bounds})
        if s.torque_nm_per_a:
            values["rated_torque_nm"] = 0.01 * talk.value(0x22) * s.torque_nm_per_a
        else:
            values["drive's torque"] = "not read: torque_nm_per_a is 0"
        return DeviceFacts(
            model=talk.text(0x92),
            serial=talk.text(0x81),
            fastest_tick_rate_hz=1.0 / self._cycle_s,
            watchdog_s=s.horizon_s if s.mode == "moves" else None,
            values=values,
        )

    def enable(self) -> None:
        """Write zero velocity and the present position as target, read them back, then energise.

        Raises
        ------
        DeviceError
            If the drive was not configured, a target is not zero, or the drive does not start.
        """
        if not self._configured:
            raise DeviceError("drive: enable before configure; call connect and configure first")
        try:
            self._write_bounds(self._talking(), self._tight)
            self._powered, self._reported_off = True, False
            self._talking().energise(self._state_on, self._jump)
            self._sent = 0
            self._start_sampling()
            self._commanded_s = self._now()
            self._commanding = True
        except DeviceError:
            self.disable()
            raise

    # -- the loop -----------------------------------------------------------------------------

    def read(self) -> MotionSample:
        """Return the newest sample without waiting; the previous one if there is no new one."""
        line, feedback = self._line, self._feedback
        if line is not None and self._configured:
            while (exchange := line.take()) is not None:
                feedback.take(exchange, commanding=self._commanding)
            now_s = self._now()
            if feedback.unanswered_s(now_s) > self._settings.lost_s + self._cycle_s:
                feedback.latch(Cause.DRIVE_LOST)
            self._check_horizon(now_s)
            if not self._commanding and not line.busy:
                self._send()
        if feedback.sequence < 0:
            return MotionSample(math.nan, math.nan, -math.inf, cause=int(Cause.DRIVE_LOST))
        return MotionSample(
            feedback.position / self._per_rad + self._offset_rad,
            0.1 * feedback.speed / self._per_rad,
            feedback.position_s,
            feedback.sequence,
            (feedback.position, feedback.speed),
            feedback.status,
            int(feedback.cause),
            0.01 * feedback.current * self._nm_per_a,
        )

    def write(self, velocity_rad_s: float) -> float:
        """Send a velocity and return the one in force: this one, or the last if the line is busy.

        It is limited to `max_velocity_deg_s`. A value that is not finite is sent as zero and
        latched. After a fault, or a pause in which the drive stopped by itself, zero is sent.
        """
        line, feedback = self._line, self._feedback
        if line is None or not self._commanding:
            return 0.0
        self._check_horizon(self._now())
        if not math.isfinite(velocity_rad_s):
            feedback.latch(Cause.COMMAND_NOT_FINITE)
            velocity_rad_s = 0.0
        if feedback.cause not in (Cause.NONE, Cause.COMMAND_NOT_FINITE):
            # The arm must not start again when power or replies come back, and a target needs a
            # known position. The present move ends.
            velocity_rad_s = 0.0
        if line.busy:
            feedback.counts["skipped"] += 1
        elif feedback.refused and feedback.cause is Cause.NONE:
            # A drive without power refuses to move, and so does a faulty one: read which it is.
            if self._asked_why:
                feedback.latch(Cause.DRIVE_FAULT)
            self._asked_why = True
            self._send(ask_all=True)
        else:
            counts_s = max(-self._fastest, min(self._fastest, velocity_rad_s * self._per_rad))
            self._sent = round(10.0 * counts_s)
            self._commanded_s = self._now()
            self._send(*self._requests(0.1 * self._sent))
        return 0.1 * self._sent / self._per_rad

    @property
    def counts(self) -> Mapping[str, int]:
        """Replies received, lost, damaged, refused (``e``), and commands skipped on a busy line."""
        return dict(self._feedback.counts)

    # -- the end ------------------------------------------------------------------------------

    @property
    def powered(self) -> bool:
        """Whether it was given power and has not confirmed that it is gone."""
        return not self._reported_off

    def stop(self) -> None:
        """Abort the move: the drive brakes with its own deceleration and stays at rest."""
        self._commanding = False
        if self._powered:
            request = "t 0" if self._settings.mode == "moves" else set_request(0x2F, 0)
            self._try(request)

    def disable(self) -> None:
        """Remove the power at once; a drive that does not confirm it is reported as lost."""
        self._commanding = False
        self._powered = False
        self._reported_off = self._try(set_request(0x24, OFF)) or self._reported_off

    def close(self) -> None:
        """Remove the power and close the port."""
        self.disable()
        self._speaking = self._configured = False
        line, self._line = self._line, None
        if line is not None:
            line.close()

    # -- parts --------------------------------------------------------------------------------

    def _requests(self, counts_s: float) -> tuple[str, ...]:
        if self._settings.mode == "velocity":
            return (set_request(0x2F, round(10.0 * counts_s)),)
        if counts_s == 0.0:
            return ("t 0",)
        feedback = self._feedback
        moving = max(-self._fastest, min(self._fastest, 0.1 * feedback.speed))
        age_s = min(max(self._now() - feedback.position_s, 0.0), 2.0 * self._cycle_s)
        target = move_target(
            feedback.position + moving * age_s,
            moving,
            counts_s,
            self._deceleration,
            self._settings.horizon_s,
        )
        return set_request(0xCA, target), set_request(0xCB, abs(round(10.0 * counts_s))), "t 1"

    def _send(self, *commands: str, ask_all: bool = False) -> None:
        line = self._line
        if line is not None:
            self._cycle += 1
            turns = (0xA0, 0x24) if ask_all else ((0x24,) if self._cycle % 2 else (0xA0,))
            asked = (0x32, 0x18, *self._settings.current_registers, *turns)
            requests = (*commands, *map(read_request, asked))
            self._feedback.asked(requests, self._now())
            line.submit(*requests)

    def _check_horizon(self, now_s: float) -> None:
        """Latch a cause if the last move has ended because no command renewed it."""
        line = self._line
        if not self._commanding or self._settings.mode != "moves" or line is None or line.busy:
            return
        if now_s - self._commanded_s > self._settings.horizon_s:
            self._feedback.latch(Cause.DRIVE_STATE)

    def _write_bounds(self, talk: AsciiTalk, tight: Tight | None) -> None:
        if self._bounds is not None:
            self.bounds = write_bounds(talk, self._settings, self._bounds, tight)

    def _start_sampling(self) -> None:
        """Start again from a fresh sample, without the causes of the previous run."""
        self._asked_why = False
        talk = self._talking()
        position, speed, status = (talk.value(register) for register in (0x32, 0x18, 0xA0))
        self._feedback.begin(position, speed, status, self._now())

    def _talking(self) -> AsciiTalk:
        if self._line is None:
            raise DeviceError("drive: not connected; call connect first")
        return AsciiTalk(self._line, self._settings)

    def _try(self, request: str) -> bool:
        """Send a request that ends the motion; without an ok the drive is lost, but no error."""
        if self._line is None or not self._speaking:
            return False
        self._feedback.forget_requests()
        text = self._line.ask(request, PATIENCE * self._settings.lost_s)
        if text != "ok":
            self._feedback.latch(Cause.DRIVE_LOST)
        return text == "ok"
