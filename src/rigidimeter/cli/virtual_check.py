"""The checks of a rig on the virtual one, on a clock that moves as the rig is read."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from rigidimeter.core.settings import Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.core.version import __version__
from rigidimeter.rig.commissioning import (
    BRAKING,
    PUT_ON,
    CommissioningRecord,
    Compared,
    DailyRecord,
    Operator,
    Setup,
    Timebase,
    daily_check,
    drive_side_of,
)
from rigidimeter.rig.devices import RigFile, SimulatedRig
from rigidimeter.rig.devices.base import Reading, Rig
from rigidimeter.rig.guard import DriveModel

NAME = "virtual rig"
LOAD_NM = 2.0


class _VirtualRig:
    """The virtual rig with a clock, and with the facts of a device; its arm pushes nothing."""

    def __init__(self, settings: Settings) -> None:
        first = next(iter(settings.subject.values()))
        self._rig = SimulatedRig(settings.rig, first.relaxed, np.random.default_rng(settings.seed))
        self._settings, self._reads = settings, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rig, name)

    def now_s(self) -> float:
        return max(self._reads - 1, 0) / self._settings.rig.tick_rate_hz

    def read(self, elapsed_ticks: int = 1) -> Reading:
        self._reads += elapsed_ticks
        return self._rig.read(elapsed_ticks)

    def load(self, torque_nm: float) -> None:
        """Put a torque on the joint, toward positive angles."""
        self._rig.load_nm = torque_nm

    def configure(self) -> Mapping[str, Any]:
        """Return facts of a drive that brakes and stops by itself as the settings need."""
        guard, watchdog_s = self._settings.guard, 2.0 * self._settings.loop.stall_s
        values = {BRAKING: rad_from_deg(guard.acceleration_limit_deg_s2)}
        facts = {"model": NAME, "serial": "", "watchdog_s": watchdog_s, "values": values}
        return {"torque_sensor": facts, "drive": facts}


def virtual_setup(settings: Settings, operator: Operator) -> Setup:
    """Return the virtual rig as one that is to be tried."""
    rig = _VirtualRig(settings)
    time = Timebase(rig.now_s, lambda deadline_s: deadline_s)
    return Setup(cast("Rig", rig), settings, time, operator)


def measured_drive_side(settings: Settings) -> DriveModel | None:
    """Return what commissioning finds of the virtual drive's side; None if it reports no torque.

    A weight of `LOAD_NM` is put on the joint when that is asked for.
    """
    rig = _VirtualRig(settings)

    def ask(question: str) -> bool:
        rig.load(LOAD_NM if question.startswith(PUT_ON) else 0.0)
        return True

    time = Timebase(rig.now_s, lambda deadline_s: deadline_s)
    operator = Operator(ask, known_torque_nm=LOAD_NM)
    return drive_side_of(Setup(cast("Rig", rig), settings, time, operator))


def virtual_check(setup: Setup) -> DailyRecord:
    """Return the daily check of the virtual rig; it is commissioned by what its settings say."""
    torque, motion = setup.settings.rig.torque, setup.settings.rig.motion
    behind_s = (torque.latency_s - torque.stamp_latency_s) - (
        motion.latency_s - motion.stamp_latency_s
    )
    now = datetime.now(UTC).isoformat(timespec="seconds")
    numbers = {"torque_after_motion_s": behind_s}
    commissioned = CommissioningRecord(NAME, "", {}, {}, (), numbers, __version__, now)
    return daily_check(
        setup,
        cast("RigFile", SimpleNamespace(name=NAME, digest="", devices={})),
        lambda _: commissioned,
        compared=Compared(),
        made_utc=now,
        software=__version__,
    )
