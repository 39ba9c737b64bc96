"""A CiA 402 servo over CANopen in profile-velocity mode.

Before the loop, SDO transfers write the settings and read them back. The loop waits for no SDO and
has no threads: each `write` sends a SYNC and the command, the drive answers every SYNC with its
state, position, velocity and, if it can, torque, and the next `read` receives them. `write` also
sends the heartbeat that keeps the drive enabled. If the loop hangs, the heartbeat ends with it, and
the drive stops by itself: by its heartbeat watchdog (0x1016), and sooner by its command deadline
(0x1400:05) if it has one.

The drive gets bounds of its own, if `bound` was called (see `drive_bounds`): they are written by
`configure` and again by `enable`, since the position limits are those about where the joint stands.
A hand-held stop in the drive's inputs is in a frame of its own, which answers every SYNC too: one
that is pressed, or whose frame stays away, is a cause like any other.

A measurement is taken at the SYNC, so its time is that at which this SYNC was sent; see `bus` for
how the two are matched. Where no measurement belongs to a SYNC for `lost_s`, or frames come that no
SYNC of ours asked for, the drive counts as lost.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rigidimeter.rig.devices.base import DeviceError, DeviceFacts, MotionSample, Now
from rigidimeter.rig.devices.bounds import (
    BOUND_FACT,
    SLIPPAGE,
    BoundFound,
    DriveBounds,
    Tight,
)
from rigidimeter.rig.devices.cia402.bus import NodeBus
from rigidimeter.rig.devices.cia402.drive_bounds import ask_drive, wanted_bounds, write_bounds
from rigidimeter.rig.devices.cia402.drive_torque import FACT, find_rated_torque, is_in_frame
from rigidimeter.rig.devices.cia402.power_up_sequence import FAULTS, power_up, reset_fault
from rigidimeter.rig.devices.cia402.sdo_transfers import (
    read_back,
    read_object,
    read_text,
    refuse_two_nodes,
    write_object,
)
from rigidimeter.rig.devices.cia402.setup import (
    BRAKING,
    CONTROLWORD,
    IDENTITY,
    TARGET,
    Cia402Settings,
    Object,
    displayed_mode,
    inputs,
    is_pressed,
    objects,
    scale,
)
from rigidimeter.rig.devices.cia402.state_words import (
    INPUTS_BYTES,
    OPERATIONAL,
    POWERED,
    SLIPPED,
    TICK_FRAMES,
    TICK_FRAMES_WITH_TORQUE,
    Cia402State,
    Control,
    Nmt,
    fastest_tick_rate_hz,
)
from rigidimeter.rig.guard import Cause

MAX_FRAMES_A_READ = 400
"""A full bus at 1 Mbit/s brings 18 frames a ms, which is 364 in a tick of 20 ms."""


class Cia402Drive:
    """A `VelocityDrive`; see the module for the protocol.

    The first `Cause` in the loop is kept until the next `enable`. A drive that left operation by
    itself is commanded to quick stop and is not enabled again.

    Parameters
    ----------
    settings : Cia402Settings
    now : callable
        Seconds on the loop's clock.
    """

    Settings = Cia402Settings

    def __init__(self, settings: Cia402Settings, now: Now) -> None:
        self._settings, self._now = settings, now
        self._who = (
            f"CiA 402 drive, node {settings.node_id} on {settings.interface} {settings.channel}"
        )
        self._wire = NodeBus(settings, now, self._who)
        self._scale = scale(settings)
        self._expect(objects(settings))
        self._nm_per_permille = math.nan  # of the drive's torque; NaN where it is not read
        self._bounds: DriveBounds | None = None
        self._tight: Tight | None = None
        self._slips = False  # the drive has a bound of the slippage
        self.bounds: tuple[BoundFound, ...] = ()
        """What came of each bound when it was written last."""
        self._stops_itself_s = settings.drive_watchdog_s - settings.heartbeat_s
        if settings.command_deadline_s > 0:
            self._stops_itself_s = min(self._stops_itself_s, settings.command_deadline_s)
        self._configured = False
        self._control = Control.DISABLE_VOLTAGE
        self._halted = False  # `control` is not sent yet
        self._sent = 0
        self._settled_s = -math.inf
        self._cause = Cause.NONE
        self._sample = MotionSample(math.nan, math.nan, -math.inf, cause=int(Cause.DRIVE_LOST))

    def _expect(self, written: tuple[Object, ...]) -> None:
        """Take these objects as those that are written, and read back at each `enable`."""
        self._objects = written
        self._readable = (*written, displayed_mode(self._settings))

    @property
    def counts(self) -> Mapping[str, int]:
        """Measurements received or lost; frames damaged, unsent, unplaced; reads at their limit."""
        return self._wire.counts

    @property
    def powered(self) -> bool:
        """Whether its last statusword is of a state in which it may turn the motor.

        Between `enable` and `disable` it is, so after `disable` any other is news.
        """
        return self._wire.is_open and self._wire.state in POWERED

    def bound(self, bounds: DriveBounds) -> None:
        """Have these bounds written by the next `configure` and every `enable`."""
        self._bounds = bounds

    def tighten(self, tight: Tight | None) -> None:
        """Have one bound so tight from the next `enable` on that a move must hit it; None: none."""
        self._tight = tight

    def connect(self) -> None:
        """Open the bus and make the drive pre-operational; nothing is energised."""
        self._wire.open()
        self._wire.network(Nmt.PRE_OPERATIONAL)

    def configure(self) -> DeviceFacts:
        """Write every setting, read each back, and start the drive's cyclic frames.

        Raises
        ------
        DeviceError
            If the drive does not answer, or does not accept a value.
        """
        if not self._wire.is_open:
            raise DeviceError(f"{self._who}: not connected; connect it before it is configured")
        self._configured = False
        self._control = Control.DISABLE_VOLTAGE
        settings, who = self._settings, self._who
        self._wire.network(Nmt.PRE_OPERATIONAL)
        with self._wire.sdo_client() as sdo:
            self._wire.booted = False
            refuse_two_nodes(sdo, who)
            identity = {entry.name: read_object(sdo, entry, who) for entry in IDENTITY}
            firmware, name = read_text(sdo, 0x100A, who), read_text(sdo, 0x1008, who)
            rated_nm, no_torque = find_rated_torque(sdo, settings, who)
            absent = self._write(sdo, with_torque=bool(rated_nm))
            if rated_nm and not is_in_frame(sdo, settings, who):
                rated_nm, no_torque = 0.0, "not available: not taken into the velocity frame"
                absent = self._write(sdo, with_torque=False)
            read_object(sdo, inputs(settings), who)
            entries = self._write_bounds(sdo, None)
            found, held = read_back(sdo, self._readable, who), read_back(sdo, entries, who)
        self._wire.network(Nmt.START)
        self._configured = True
        self._wire.has_torque = bool(rated_nm)
        self._nm_per_permille = rated_nm / 1000.0 if rated_nm else math.nan
        watchdogs = [settings.drive_watchdog_s]
        if settings.command_deadline_s > 0 and not any(entry.index == 0x1400 for entry in absent):
            watchdogs.append(settings.command_deadline_s)
        values: dict[str, str | float | int] = {"firmware (0x100A)": firmware, **found}
        values.update({entry.label: "absent" for entry in absent})
        values.update({k: value for k, value in identity.items() if value is not None})
        ramps = [found[entry.label] for entry in self._objects if entry.name in BRAKING]
        values.update({f"{BOUND_FACT} {label}": value for label, value in held.items()})
        values.update({f"{BOUND_FACT} {bound.name}": bound.words for bound in self.bounds})
        if settings.button_bit >= 0:
            values["button_bit"] = settings.button_bit
        values.update({FACT: no_torque} if no_torque else {"rated_torque_nm": abs(rated_nm)})
        values["braking_rad_s2"] = min(ramps) / self._scale.units_per_rad_s2
        return DeviceFacts(
            model=name or f"vendor {identity['vendor']}, product {identity['product']}",
            serial="" if identity["serial"] is None else str(identity["serial"]),
            fastest_tick_rate_hz=fastest_tick_rate_hz(settings.bitrate, self._tick_frames()),
            watchdog_s=min(watchdogs),
            values=values,
        )

    def _write(self, sdo: Any, with_torque: bool) -> list[Object]:
        """Write every setting; return the optional ones that the drive does not have."""
        self._expect(objects(self._settings, with_torque))
        return [entry for entry in self._objects if not write_object(sdo, entry, self._who)]

    def reset_fault(self) -> None:
        """Reset a fault at the operator's request; the drive stays without power.

        Raises
        ------
        DeviceError
            If the fault remains.
        """
        self._require_configured()
        self._control = Control.DISABLE_VOLTAGE
        reset_fault(self._wire, self._now, self._settings.enable_timeout_s, self._who)
        self._cause = Cause.NONE

    def enable(self) -> None:
        """Write zero velocity, read it and every setting back, then energise.

        The loop must start to write within the drive's watchdog time.

        Raises
        ------
        DeviceError
            If a setting or the target is not as written, or the drive does not start in time.
        """
        self._require_configured()
        self._control = Control.DISABLE_VOLTAGE
        wire = self._wire
        try:
            with wire.sdo_client() as sdo:
                for entry in self._objects:
                    if entry.name in (CONTROLWORD, TARGET):
                        write_object(sdo, entry, self._who)
                self._refuse_pressed(read_object(sdo, inputs(self._settings), self._who))
                entries = self._write_bounds(sdo, self._tight)
                read_back(sdo, (*self._readable, *entries), self._who)
            wire.network(Nmt.START)
            wire.drain()
            self._require_configured()
            wire.alarmed = wire.unheard = False
            self._cause = Cause.NONE
            power_up(wire, self._now, self._settings.enable_timeout_s, self._who)
        except BaseException:  # also when interrupted: the drive may have power by now
            self.disable()
            raise
        self._control, self._halted = Control.ENABLE_OPERATION, False
        self._sent = 0
        wire.emergency, wire.left_operation, wire.seen_bits = 0, False, 0
        wire.inputs, wire.inputs_s = None, self._now()
        wire.heard_s, wire.network_state = self._now(), OPERATIONAL

    def read(self) -> MotionSample:
        """Return the newest sample without waiting; the previous one if there is no new one."""
        wire = self._wire
        for _ in range(MAX_FRAMES_A_READ):
            if not wire.receive():
                break
        else:
            wire.counts["backlog"] += 1
        now_s = self._now()
        found = self._find_cause(now_s)
        if found in (Cause.DRIVE_FAULT, Cause.DRIVE_STATE) and (
            wire.left_operation or wire.network_state != OPERATIONAL
        ):
            # Repeating "enable operation" would restart a drive that stopped by itself, and a node
            # that is not operational does not hear the guard's ramp.
            self._halt(Control.QUICK_STOP)
        if found is Cause.EMERGENCY_STOP:  # no weaker cause before it may keep the power on
            self._cause = found
        self._cause = self._cause or found
        self._check_watchdog(now_s)
        if wire.sequence and wire.sequence != self._sample.sequence:
            position, velocity = wire.raw
            self._sample = MotionSample(
                (position - self._settings.zero_counts) / self._scale.counts_per_rad,
                velocity / self._scale.units_per_rad_s,
                wire.measured_s,
                wire.sequence,
                wire.raw,
                drive_torque_nm=wire.torque * self._nm_per_permille,
            )
        status = wire.emergency << 16 | wire.statusword
        cause = self._cause if wire.sequence else Cause.DRIVE_LOST
        return self._sample._replace(status=status, cause=int(cause))

    def _check_watchdog(self, now_s: float) -> None:
        """Halt a drive that may be braking by itself: "enable operation" would restart it."""
        if self._control is not Control.ENABLE_OPERATION:
            return
        wire = self._wire
        if now_s - min(wire.commanded_s, wire.asked_s) > self._stops_itself_s:
            answered = wire.asked_s == math.inf
            self._cause = self._cause or (Cause.DRIVE_STATE if answered else Cause.DRIVE_LOST)
            self._halt(Control.QUICK_STOP)

    def _find_cause(self, now_s: float) -> Cause:
        """Return why the drive is not in the commanded state, NONE if it is."""
        wire, settings = self._wire, self._settings
        if wire.booted:
            self._halt(Control.DISABLE_VOLTAGE)
        if wire.inputs is not None and is_pressed(settings, wire.inputs):
            return Cause.EMERGENCY_STOP
        unheard = wire.unheard and self._control is Control.ENABLE_OPERATION
        if wire.booted or wire.alarmed or unheard or wire.state in FAULTS:
            return Cause.DRIVE_FAULT
        if self._control is Control.ENABLE_OPERATION:
            if wire.left_operation or wire.network_state != OPERATIONAL:
                return Cause.DRIVE_STATE
            if self._slips and wire.seen_bits & SLIPPED:
                return Cause.DRIVE_FAULT
            if settings.button_bit >= 0 and now_s - wire.inputs_s > settings.lost_s:
                return Cause.DRIVE_LOST
            if wire.unplaced or now_s - wire.heard_s > settings.heartbeat_s + settings.lost_s:
                return Cause.DRIVE_LOST
        elif wire.state is Cia402State.OPERATION_ENABLED and now_s > self._settled_s:
            return Cause.DRIVE_STATE
        lost = not wire.is_open or now_s - wire.asked_s > settings.lost_s
        return Cause.DRIVE_LOST if lost else Cause.NONE

    def write(self, velocity_rad_s: float) -> float:
        """Send velocity, SYNC and, when due, our heartbeat; return what was actually sent.

        Zero is sent to a drive that is not enabled, and in place of a value that is not finite.
        After a pause in which the drive's watchdog may have acted, a quick stop is sent.
        """
        self._check_watchdog(self._now())
        target = 0
        if self._control is Control.ENABLE_OPERATION and math.isfinite(velocity_rad_s):
            limit = self._settings.max_velocity_rad_s
            wanted = max(-limit, min(limit, velocity_rad_s)) * self._scale.units_per_rad_s
            target = max(-(2**31), min(2**31 - 1, round(wanted)))
        if self._wire.is_open:
            if self._halted:
                self._send_halt()
            elif self._wire.ask(self._control, target):
                self._sent = target
        return self._sent / self._scale.units_per_rad_s

    def stop(self) -> None:
        """Brake along the drive's quick-stop ramp; only `enable` starts it again."""
        if self._wire.is_open and self._control is not Control.DISABLE_VOLTAGE:
            self._halt(Control.QUICK_STOP)
            self._send_halt()

    def disable(self) -> None:
        """Remove the power at once."""
        if self._wire.is_open:
            self._halt(Control.DISABLE_VOLTAGE)
            self._send_halt()

    def close(self) -> None:
        """Remove the power, make the drive pre-operational, close the bus."""
        self._configured = False
        try:
            if self._wire.is_open:
                self.disable()
                self._wire.network(Nmt.PRE_OPERATIONAL)
        finally:
            self._wire.close()

    def _halt(self, control: Control) -> None:
        """Halt with the next `write`: a program that is silent must not be the one that stops."""
        # Power that was removed is not restored for a quick stop.
        if self._control not in (control, Control.DISABLE_VOLTAGE):
            self._control = control
            self._halted = True
            self._settled_s = self._now() + self._settings.lost_s
        self._sent = 0

    def _send_halt(self) -> None:
        self._wire.send_both_ways(self._control)
        self._halted = False

    def _write_bounds(self, sdo: Any, tight: Tight | None) -> tuple[Object, ...]:
        """Write the bounds about where the joint stands; return the objects that hold them."""
        if self._bounds is None:
            return ()
        settings, who = self._settings, self._who
        says = ask_drive(sdo, settings, who)
        wanted = wanted_bounds(settings, self._bounds, says, tight)
        self.bounds, written = write_bounds(sdo, wanted, who)
        self._slips = any(found.name == SLIPPAGE and found.where for found in self.bounds)
        return written

    def _refuse_pressed(self, levels: int | None) -> None:
        if levels is not None and is_pressed(self._settings, levels):
            raise DeviceError(
                f"{self._who}: the hand-held stop (bit {self._settings.button_bit} of 0x60FD) is "
                "pressed, or its wire is broken; release it, or check the wire and "
                "button_pressed_level"
            )

    def _tick_frames(self) -> tuple[int, ...]:
        tick = TICK_FRAMES_WITH_TORQUE if self._wire.has_torque else TICK_FRAMES
        return (*tick, INPUTS_BYTES) if self._settings.button_bit >= 0 else tick

    def _require_configured(self) -> None:
        self._configured = self._configured and not self._wire.booted
        if not (self._wire.is_open and self._configured):
            raise DeviceError(
                f"{self._who}: not configured, or restarted since; configure it, then enable it"
            )
