"""Compose the virtual rig, the loop and the recorder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidimeter.acquisition import SessionResult
    from rigidimeter.design import PlannedEpoch
    from rigidimeter.settings import Settings

__all__ = ["run_virtual_session", "session_length_s"]


def session_length_s(settings: Settings) -> float:
    """Return how long the session of these settings lasts, in s."""
    from rigidimeter.design import plan

    return plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed).total_s


def run_virtual_session(
    settings: Settings,
    folder: Path,
    *,
    real_time: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> SessionResult:
    """Run the protocol of the settings on the virtual rig and record it.

    All random numbers come from `settings.seed`: the same settings give the same samples, byte for
    byte, unless the clock is real.
    """
    import numpy as np

    from rigidimeter.acquisition import RealTimeClock, SimulatedClock, run_session
    from rigidimeter.design import plan
    from rigidimeter.device import SimulatedRig
    from rigidimeter.recording import SessionWriter

    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    first = settings.subject[protocol.epochs[0].condition]
    rig = SimulatedRig(settings.rig, first, np.random.default_rng(settings.seed))
    writer = SessionWriter(
        folder,
        settings,
        [asdict(epoch) for epoch in protocol.epochs],
        {"session": settings.seed},
        virtual=True,
    )

    def new_joint(planned: PlannedEpoch) -> dict[str, Any]:
        return {"true_joint": asdict(rig.new_epoch(settings.subject[planned.condition]))}

    return run_session(
        protocol,
        settings,
        rig,
        RealTimeClock() if real_time else SimulatedClock(),
        writer,
        before_epoch=new_joint,
        progress=progress,
    )
