"""The emulated servo: its state machine, its commands to the arm, and its misbehaviours.

States and transitions are those of CiA 402. Bits 0 (switch on), 1 (enable voltage), 2 (not quick
stop), 3 (enable operation) of the controlword and the rising edge of bit 7 (fault reset) decide the
next state. Numbers in comments are those of the transitions in the standard.

This module reads objects by their index; messages are handled in `cia402_emulator`.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator
from enum import Enum
from typing import Any, NamedTuple, Protocol

from rigidimeter.testing.emulated_arm import EmulatedArm

CIA402_MISBEHAVIOURS = {
    "fault": "brakes, reports a fault (value: its code) and cannot be reset",
    "emergency": "sends an emergency message (value: its code) but keeps moving",
    "short emergency": "sends an emergency message of so many bytes (value) but keeps moving",
    "leave operation": "removes its own power, as if its hardware enable opened",
    "fall to switched on": "disables its operation once; the next controlword can enable it again",
    "change mode": "reports another mode of operation (value: which)",
    "stop measurements": "stops answering SYNC",
    "stop heartbeat": "stops sending its heartbeat",
    "die": "stops receiving and sending; its own watchdogs still work",
    "reboot": "restarts: no power, no settings, no watchdog",
    "refuse enable": "does not go beyond switched on",
    "stale target": "keeps an old target velocity (value: in rad/s) whatever is written",
    "does not follow": "accepts commands and does not move",
    "runs away": "moves at a velocity of its own (value: in rad/s) while it has power",
    "drifts": "adds a velocity of its own (value: in rad/s) to every command while it has power",
    "encoder frozen": "keeps reporting the present position and velocity",
    "encoder jump": "reports a position with an error (value: in rad)",
    "encoder sign": "reports position and velocity with the wrong sign",
    "velocity gain": "reports so many times the velocity (value: 0 or less, as a rule)",
    "torque frozen": "keeps reporting the present torque of its motor",
    "slow answers": "answers SDO requests late (value: by how many s)",
    "wrong watchdog": "accepts the heartbeat watchdog but uses another (value: in ms)",
    "ignores quick stop": "keeps moving after a quick-stop command",
    "wrong bound": "takes a bound of the torque but keeps another (value: in thousandths)",
    "press button": "opens bit 0 of its digital inputs, as a hand-held stop does",
    "stop inputs": "stops sending its digital inputs",
    "bound sleeps": "takes a bound and does not obey it (value: its object, 0 for all of them)",
}
"""Misbehaviours by name."""

DEFAULTS = {
    "fault": 0x2310,
    "emergency": 0x4210,
    "short emergency": 3,
    "change mode": 1,
    "stale target": 0.5,
    "runs away": 6.0,
    "drifts": 0.08,
    "encoder jump": 1.0,
    "velocity gain": 0.0,
    "slow answers": 0.5,
    "wrong watchdog": 0,
    "wrong bound": 500,
    "bound sleeps": 0,
}

UNITS_PER_RAD = 819_200.0 / (2 * math.pi)
"""Drive units of position, velocity and acceleration: 819,200 counts in a turn of the joint."""

GEAR_RATIO = 100.0
RAD_S_OF_1_MIN = 2.0 * math.pi / 60.0 / GEAR_RATIO
"""Of the joint, where the motor turns once a minute."""

MAX_TORQUE, MAX_CURRENT, POSITION_LIMITS, MAX_PROFILE_SPEED, MAX_MOTOR_SPEED, MAX_SLIPPAGE = (
    *(0x6072, 0x6073, 0x607D, 0x607F, 0x6080, 0x60F8),
)
BOUNDS = (
    *(MAX_TORQUE, MAX_CURRENT, POSITION_LIMITS),
    *(MAX_PROFILE_SPEED, MAX_MOTOR_SPEED, MAX_SLIPPAGE),
)
"""Objects that bound what the drive does. This one has them act in profile velocity mode."""

NO_THOUSANDTHS = 0xFFFF
INTERNAL_LIMIT, SLIPPED = 1 << 11, 1 << 13
SLIPPAGE_ERROR = 0x8400
ROUNDED = 1e-3
"""Drive units that rounding may leave."""

AT_REST_RAD_S = 0.01
GENERIC_ERROR, COMMUNICATION_ERROR = 0x01, 0x11
QUICK_STOP_HOLDS = 5
"""From this quick-stop option on, the motor keeps its power after stopping."""


class Phase(Enum):
    """A state, with the bits that code it in the statusword."""

    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION = 0x0F
    FAULT = 0x08


POWERED = (Phase.OPERATION_ENABLED, Phase.QUICK_STOP_ACTIVE, Phase.FAULT_REACTION)
"""The states in which the motor has power."""

VOLTAGE_ENABLED, REMOTE = 0x10, 0x200


def statusword(phase: Phase) -> int:
    """Return the statusword of a drive with supply voltage that listens to the network."""
    return phase.value | VOLTAGE_ENABLED | REMOTE


def after_control(phase: Phase, control: int, before: int) -> Phase:
    """Return the state after a controlword; `before` is the one before it."""
    if phase is Phase.FAULT_REACTION:
        return phase
    if phase is Phase.FAULT:
        reset = control & 0x80 and not before & 0x80
        return Phase.SWITCH_ON_DISABLED if reset else phase  # 15
    if not control & 0x02:  # disable voltage
        return Phase.SWITCH_ON_DISABLED  # 7, 9, 10, 12
    if not control & 0x04:  # quick stop
        if phase is Phase.OPERATION_ENABLED:
            return Phase.QUICK_STOP_ACTIVE  # 11
        if phase is Phase.QUICK_STOP_ACTIVE:
            return phase
        return Phase.SWITCH_ON_DISABLED  # 7, 10
    if not control & 0x01:  # shutdown
        return phase if phase is Phase.QUICK_STOP_ACTIVE else Phase.READY  # 2, 6, 8
    if phase is Phase.SWITCH_ON_DISABLED:
        return phase
    if not control & 0x08:  # switch on
        return phase if phase is Phase.QUICK_STOP_ACTIVE else Phase.SWITCHED_ON  # 3, 5
    return Phase.OPERATION_ENABLED  # 3 and 4 at once, 4, 16


class LastStop(NamedTuple):
    """Reason and times of the last quick stop."""

    reason: str = ""
    began_s: float = math.nan
    rest_s: float = math.nan


class Objects(Protocol):
    """The functions of the node that the servo uses."""

    def has(self, index: int) -> bool:
        """Return whether there is such an object."""

    def value(self, index: int, subindex: int = 0) -> int:
        """Return an object's value."""

    def emergency(self, code: int, register: int) -> None:
        """Send an emergency message."""

    def changed(self) -> None:
        """Report a change of state."""

    def note(self, event: str) -> None:
        """Log an event."""


class Servo:
    """A drive and its state; the caller serialises the calls.

    Parameters
    ----------
    arm : EmulatedArm
    node : Objects
    """

    def __init__(self, arm: EmulatedArm, node: Objects) -> None:
        self._arm, self._node = arm, node
        self._control = 0
        self.phase = Phase.SWITCH_ON_DISABLED
        self.wrong: dict[str, Any] = {}
        """Active misbehaviours and their values."""
        self._limited = self._slipped = False
        self.last_stop = LastStop()
        side = arm.drive_side
        self.rated_torque_mnm = (
            round(1e3 * side.rated_torque_nm / GEAR_RATIO) if side.reports_torque else None
        )
        """Of the motor; None if the drive does not report its torque."""
        self._torques = deque([0], side.torque_latency_ticks + 1)

    def restart(self) -> None:
        """Return to the state after power-up."""
        self.go(Phase.SWITCH_ON_DISABLED, "restart")
        self._control = 0

    def target(self) -> float:
        """Return the present target velocity, in drive units."""
        if "stale target" in self.wrong:
            return float(self.wrong["stale target"]) * UNITS_PER_RAD
        wanted = float(self._node.value(0x60FF))
        for limit in self._speed_limits():
            wanted = max(-limit, min(limit, wanted))
        return wanted

    def _speed_limits(self) -> Iterator[float]:
        """Yield the limits of the velocity in force, in drive units."""
        if self._bound(MAX_PROFILE_SPEED):
            yield self._node.value(MAX_PROFILE_SPEED)
        if self._bound(MAX_MOTOR_SPEED):
            yield self._node.value(MAX_MOTOR_SPEED) * RAD_S_OF_1_MIN * UNITS_PER_RAD

    def _bound(self, index: int) -> bool:
        """Return whether a bound is there and awake."""
        asleep = self.wrong.get("bound sleeps")
        return self._node.has(index) and (asleep is None or asleep not in (0, index))

    def _torque_limit_nm(self) -> float:
        """Return the largest torque of the motor at the joint."""
        parts = [self._node.value(o) for o in (MAX_TORQUE, MAX_CURRENT) if self._bound(o)]
        limited = [part for part in parts if part < NO_THOUSANDTHS]
        return min(limited, default=math.inf) * 1e-3 * self._arm.drive_side.rated_torque_nm

    def _position_limits(self) -> tuple[float, float]:
        if self._bound(POSITION_LIMITS):
            lowest, highest = (self._node.value(POSITION_LIMITS, k) for k in (1, 2))
            if lowest < highest:  # both 0: none
                return lowest, highest
        return -math.inf, math.inf

    def _inside(self, wanted_rad_s: float) -> float:
        """Return a velocity from which the drive comes to rest at its position limits."""
        lowest, highest = self._position_limits()
        angle = self.measured()[0]
        left_rad = (highest - angle if wanted_rad_s > 0.0 else angle - lowest) / UNITS_PER_RAD
        ramp = self._node.value(0x6084) / UNITS_PER_RAD
        fastest = math.sqrt(2.0 * ramp * left_rad) if left_rad > 0.0 else 0.0
        return max(-fastest, min(fastest, wanted_rad_s))

    def bound_bits(self) -> int:
        """Return the bits of the statusword that tell of bounds."""
        bits = SLIPPED if self._slipped else 0
        return bits | (INTERNAL_LIMIT if self._limited or self._arm.saturated else 0)

    def watch_bounds(self) -> None:
        """Keep to the position limits, and fail where the joint does not follow."""
        if self.phase not in POWERED:
            return
        if self.phase is Phase.OPERATION_ENABLED and self._position_limits()[1] < math.inf:
            self.move()
        most = self._node.value(MAX_SLIPPAGE) / UNITS_PER_RAD if self._bound(MAX_SLIPPAGE) else 0
        if 0 < most < abs(self._arm.lag_rad_s()) and not self._slipped:
            self._slipped = True
            self.fault(SLIPPAGE_ERROR, "slippage")

    def measured(self) -> tuple[int, int]:
        """Return the reported position and velocity, in drive units."""
        if isinstance(frozen := self.wrong.get("encoder frozen"), tuple):
            return frozen
        angle_rad, velocity_rad_s = self._arm.motion()
        angle_rad += self.wrong.get("encoder jump", 0.0)
        sign = -1 if "encoder sign" in self.wrong else 1
        units = sign * UNITS_PER_RAD
        velocity_rad_s *= self.wrong.get("velocity gain", 1.0)
        return round(angle_rad * units), round(velocity_rad_s * units)

    def torque(self) -> int:
        """Take the motor's torque and return an earlier one, in thousandths of the rated torque."""
        if isinstance(frozen := self.wrong.get("torque frozen"), int):
            return frozen
        powered = self.phase in POWERED
        torque_nm = self._arm.drive_torque_nm() if powered else 0.0
        part = round(1e3 * torque_nm / self._arm.drive_side.rated_torque_nm)
        self._torques.append(max(-(2**15), min(2**15 - 1, part)))
        return self._torques[0]

    def control(self, control: int) -> None:
        """Execute a controlword."""
        before, self._control = self._control, control
        if control & 0x06 == 0x02 and "ignores quick stop" in self.wrong:
            return
        phase = after_control(self.phase, control, before)
        if phase is Phase.OPERATION_ENABLED and "refuse enable" in self.wrong:
            phase = Phase.SWITCHED_ON
        if self.phase is Phase.FAULT and "fault" in self.wrong:
            phase = Phase.FAULT
        self.go(phase, f"controlword 0x{control:02X}")

    def go(self, phase: Phase, why: str) -> None:
        """Change to a state."""
        if phase is self.phase:
            return
        before, self.phase = self.phase, phase
        self._slipped = self._slipped and phase in (Phase.FAULT_REACTION, Phase.FAULT)
        self._node.note(f"{before.name} -> {phase.name}: {why}")
        if phase in (Phase.QUICK_STOP_ACTIVE, Phase.FAULT_REACTION):
            self.last_stop = LastStop(why, time.monotonic())
        self.move()
        self._node.changed()

    def move(self) -> None:
        """Command the arm according to state and target."""
        powered = self.phase in POWERED
        self._arm.torque_limit_nm = self._torque_limit_nm() if powered else math.inf
        if self.phase not in POWERED:
            self._arm.release()
        elif "runs away" in self.wrong:
            self._arm.command(self.wrong["runs away"])
        elif self.phase is not Phase.OPERATION_ENABLED:
            self._arm.command(0.0, self._node.value(0x6085) / UNITS_PER_RAD)
        elif "does not follow" in self.wrong:
            self._arm.command(0.0)
        else:
            wanted_rad_s = self._inside(self.target() / UNITS_PER_RAD)
            short = wanted_rad_s * UNITS_PER_RAD - self._node.value(0x60FF)
            self._limited = abs(short) > ROUNDED
            speeds_up = abs(wanted_rad_s) > abs(self._arm.motion()[1])
            ramp = self._node.value(0x6083 if speeds_up else 0x6084) / UNITS_PER_RAD
            self._arm.command(wanted_rad_s + self.wrong.get("drifts", 0.0), ramp)

    def fault(self, code: int, why: str) -> None:
        """Brake, then enter the fault state."""
        self._node.emergency(code, GENERIC_ERROR)
        self.go(Phase.FAULT_REACTION if self.phase in POWERED else Phase.FAULT, why)

    def connection_lost(self, code: int, why: str) -> None:
        """React to a silent master as configured in 0x6007."""
        self._node.emergency(code, COMMUNICATION_ERROR)
        if self.phase is not Phase.OPERATION_ENABLED:
            return
        option = self._node.value(0x6007)
        if option == 1:
            self.go(Phase.FAULT_REACTION, why)
        elif option == 2:
            self.go(Phase.SWITCH_ON_DISABLED, why)
        elif option == 3:
            self.go(Phase.QUICK_STOP_ACTIVE, why)

    def watch_rest(self, now_s: float) -> None:
        """Leave the quick stop once the arm is at rest."""
        if self.phase not in (Phase.QUICK_STOP_ACTIVE, Phase.FAULT_REACTION):
            return
        if abs(self._arm.motion()[1]) > AT_REST_RAD_S:
            return
        if math.isnan(self.last_stop.rest_s):
            self.last_stop = self.last_stop._replace(rest_s=now_s)
            self._node.note("at rest")
        if self.phase is Phase.FAULT_REACTION:
            self.go(Phase.FAULT, "at rest")
        elif self._node.value(0x605A) < QUICK_STOP_HOLDS:
            self.go(Phase.SWITCH_ON_DISABLED, "at rest after a quick stop")
