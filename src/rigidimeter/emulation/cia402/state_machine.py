"""The power drive's finite state automaton (CiA 402), as a drive goes through it.

The controlword's bits 0 switch on, 1 enable voltage, 2 not quick stop, 3 enable operation and the
rising edge of 7, fault reset, decide where it goes next. The numbers in the comments are those of
the transitions in the standard.
"""

from __future__ import annotations

from enum import Enum

__all__ = ["POWERED", "Phase", "after_control", "statusword"]


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
