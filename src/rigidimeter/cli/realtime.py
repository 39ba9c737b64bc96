"""Compose rig, loop and processes for a session in real time."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidimeter.acquisition.supervise import LoopSide
    from rigidimeter.design import PlannedEpoch, Protocol
    from rigidimeter.settings import Settings

__all__ = ["run_loop"]


def run_loop(
    settings: Settings, protocol: Protocol, rig_path: Path | None, side: LoopSide
) -> None:
    """Run a session; the target of the loop's process.

    Parameters
    ----------
    settings : Settings
    protocol : Protocol
    rig_path : Path or None
        RIG.toml; the virtual rig if not given.
    side : LoopSide
        Rings, board and what prepares the process.
    """
    from rigidimeter.acquisition import run_session
    from rigidimeter.acquisition.realtime import DeadlineClock

    clock = DeadlineClock()
    if rig_path is None:
        rig, new_joint = _virtual(settings, protocol)
    else:
        rig, new_joint = _real(rig_path, settings, clock), lambda _: {}
    try:
        rig.connect()
        facts = rig.configure()
        if rig_path is not None:
            from rigidimeter.commissioning import check_record
            from rigidimeter.device.rigfile import load_rig

            check_record(load_rig(rig_path), facts, settings, settings.commissioning)
        side.sink.event("rig_configured", **facts)
        side.ready()
        run_session(
            protocol,
            settings,
            rig,
            clock,
            side.sink,
            before_epoch=new_joint,
            outside=side.outside,
            zero_first=True,
            state_changed=side.sink.state_changed,
        )
    finally:
        rig.close()


def _virtual(settings: Settings, protocol: Protocol) -> tuple[Any, Any]:
    import numpy as np

    from rigidimeter.device import SimulatedRig

    first = settings.subject[protocol.epochs[0].condition]
    rig = SimulatedRig(settings.rig, first, np.random.default_rng(settings.seed))

    def new_joint(planned: PlannedEpoch) -> dict[str, Any]:
        return {"true_joint": asdict(rig.new_epoch(settings.subject[planned.condition]))}

    return rig, new_joint


def _real(path: Path, settings: Settings, clock: Any) -> Any:
    from rigidimeter.device.rigfile import load_rig

    return load_rig(path).build(clock.now_s, settings.rig.tick_rate_hz)
