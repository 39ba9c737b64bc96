"""Compile the steps from their own source, to the same bits.

A step is compiled as it stands; the helpers it calls by name are replaced by their compiled forms,
and an enumeration by its numbers. No body is written twice, and the rooms of the steps know nothing
of a compiler. Sums are not reordered and products not fused (no `fastmath`), so a step gives what
it gives in the interpreter. Steps are put in place of their calls (`inline`): as calls, they would
count references to the guard's ring at every tick, which costs more than the steps. No divisor is
ever zero (the settings are checked), so none is looked at (`error_model`).

The machine code is kept on disk. The compiler itself would look only at the file of the outermost
function; here the name under which the code is kept holds a digest of the source of all steps, so
a changed step is never passed over.
"""

from __future__ import annotations

import hashlib
import sys
from collections import namedtuple
from collections.abc import Callable
from enum import IntEnum
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

from rigidimeter.core.errors import UserError
from rigidimeter.model import (
    admittance_step,
    arm_torque_nm,
    between,
    biquad_step,
    drive_step,
    moment,
    quantised,
)
from rigidimeter.rig.guard import Cause, contact, step, watch
from rigidimeter.virtual.batch import batch_epoch as epoch


class Compiled(NamedTuple):
    """The two functions of `epoch`, compiled."""

    run_epoch: Callable[..., tuple[int, int, float, int]]
    moments: Callable[..., None]


@cache
def compiled() -> Compiled:
    """Return the compiled functions; they compile, or load, when first called.

    Raises
    ------
    UserError
        If numba is not installed.
    """
    try:
        from numba import njit
    except ImportError as error:
        raise UserError(
            "simulating many epochs needs numba: pip install 'rigidimeter[batch]'"
        ) from error

    def inlined(function: Callable[..., Any], **helpers: Any) -> Any:
        return njit(with_helpers(function, helpers), inline="always", error_model="numpy")

    drive = inlined(drive_step)
    outermost: list[tuple[Callable[..., Any], dict[str, Any]]] = [
        (
            epoch.run_epoch,
            {
                "biquad_step": inlined(biquad_step),
                "admittance_step": inlined(admittance_step),
                "arm_torque_nm": inlined(arm_torque_nm),
                "between": inlined(between),
                "quantised": inlined(quantised),
                "guard_step": inlined(
                    step.guard_step,
                    Limited=enum_numbers(step.Limited),
                    energy_after=inlined(watch.energy_after),
                    found_wrong=inlined(watch.found_wrong, Cause=enum_numbers(Cause)),
                    outside=inlined(watch.outside),
                    contact_step=inlined(contact.contact_step),
                    _most_serious=inlined(step._most_serious),
                    _fastest_toward=inlined(
                        step._fastest_toward,
                        _farthest_in_flight=inlined(step._farthest_in_flight),
                        _stoppable_speed=inlined(step._stoppable_speed),
                    ),
                ),
                "drive_step": drive,
                "_state_at": inlined(epoch._state_at, drive_step=drive),
            },
        ),
        (epoch.moments, {"moment": inlined(moment)}),
    ]
    digest = _digest()
    functions: list[Any] = []
    for function, helpers in outermost:
        own = with_helpers(function, helpers)
        own.__qualname__ = f"{function.__qualname__}_{digest}"
        try:
            functions.append(njit(own, cache=True, nogil=True, error_model="numpy"))
        except RuntimeError:  # no folder to keep the code in: it is compiled each time
            functions.append(njit(own, nogil=True, error_model="numpy"))
    return Compiled(*functions)


def with_helpers(function: Callable[..., Any], helpers: dict[str, Any]) -> FunctionType:
    """Return the same code, finding `helpers` where it looks for names of its module."""
    assert isinstance(function, FunctionType)
    return FunctionType(
        function.__code__,
        {**function.__globals__, **helpers},
        function.__name__,
        function.__defaults__,
    )


def enum_numbers(members: type[IntEnum]) -> Any:
    """Return the members as plain numbers under the same names."""
    make: Any = namedtuple
    return make(members.__name__, members.__members__)(*(int(member) for member in members))


def _digest() -> str:
    """Return a digest of every file that holds a step, and of this one."""
    steps = (
        *(
            epoch.run_epoch,
            step.guard_step,
            watch.found_wrong,
            contact.contact_step,
            biquad_step,
            admittance_step,
        ),
        *(drive_step, arm_torque_nm, quantised, _digest),
    )
    files = sorted({str(sys.modules[step.__module__].__file__) for step in steps})
    return hashlib.sha256(b"".join(Path(file).read_bytes() for file in files)).hexdigest()[:12]
