"""Power-up to operation and fault reset, one controlword at a time.

Each step sends a controlword with zero velocity and a SYNC, and reads the statusword in the answer.
These functions wait, for a limited time; they are not for use in the loop.
"""

from __future__ import annotations

from rigidimeter.rig.devices.base import DeviceError, Now
from rigidimeter.rig.devices.cia402.bus import NodeBus
from rigidimeter.rig.devices.cia402.state_words import NEXT_CONTROL, Cia402State, Control

STEP_S = 0.005
FAULTS = (Cia402State.FAULT, Cia402State.FAULT_REACTION)


def power_up(wire: NodeBus, now: Now, timeout_s: float, who: str) -> None:
    """Remove the power, then go step by step to operation.

    Raises
    ------
    DeviceError
        If there is a fault or a restart, or on timeout; the caller removes the power.
    """
    deadline_s = now() + timeout_s
    control, off = Control.DISABLE_VOLTAGE, False
    while True:
        state = _step(wire, now, control)
        # Whatever the drive was doing before, the sequence starts without power.
        off = off or state is Cia402State.SWITCH_ON_DISABLED
        if state in FAULTS or wire.alarmed or wire.booted:
            what = "restarted" if wire.booted else state.words
            raise DeviceError(
                f"{who}: {what}, emergency code 0x{wire.emergency:04X}; remove its cause; "
                "a fault must be reset by hand"
            )
        if off and state is Cia402State.OPERATION_ENABLED:
            return
        if off and state is not Cia402State.UNKNOWN:
            control = NEXT_CONTROL.get(state, Control.DISABLE_VOLTAGE)
        if now() > deadline_s:
            raise DeviceError(
                f"{who}: {state.words} (statusword 0x{wire.statusword:04X}) after {timeout_s:g} s, "
                "not operation enabled; check its hardware enable, supply and limit switches"
            )


def reset_fault(wire: NodeBus, now: Now, timeout_s: float, who: str) -> None:
    """Reset a fault; the drive stays without power.

    Raises
    ------
    DeviceError
        If the fault remains.
    """
    wire.drain()
    deadline_s = now() + timeout_s
    # The reset is the rising edge of its bit, so the bit is cleared before and after.
    control, state = Control.DISABLE_VOLTAGE, Cia402State.UNKNOWN
    while now() <= deadline_s:
        state = _step(wire, now, control)
        if state is Cia402State.FAULT:
            reset = control is Control.DISABLE_VOLTAGE
            control = Control.FAULT_RESET if reset else Control.DISABLE_VOLTAGE
        elif state not in (Cia402State.UNKNOWN, Cia402State.FAULT_REACTION):
            _step(wire, now, Control.DISABLE_VOLTAGE)
            wire.alarmed = False
            wire.emergency = 0
            return
    _step(wire, now, Control.DISABLE_VOLTAGE)
    raise DeviceError(
        f"{who}: in {wire.state.words} still, after a fault reset (emergency code "
        f"0x{wire.emergency:04X}); remove its cause first, see the drive's manual"
    )


def _step(wire: NodeBus, now: Now, control: Control) -> Cia402State:
    """Send a controlword with zero velocity; return the state in the answer, or UNKNOWN."""
    before = wire.sequence
    wire.ask(control, 0)
    until_s = now() + STEP_S
    while now() < until_s:
        wire.receive(STEP_S / 5)
        if wire.sequence != before:
            return wire.state
    return Cia402State.UNKNOWN
