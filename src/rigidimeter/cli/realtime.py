"""Compose rig, loop and processes for a session in real time."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigidimeter.acquisition.supervise import LoopSide
    from rigidimeter.design import PlannedEpoch, Protocol
    from rigidimeter.settings import Settings

__all__ = ["run_loop"]

HOME_TOLERANCE_RAD = 0.05
"""A session is gone on with from where it began, within 3 deg."""


def run_loop(
    settings: Settings,
    protocol: Protocol,
    rig_path: Path | None,
    home_rad: float | None,
    side: LoopSide,
) -> None:
    """Run a session; the target of the loop's process.

    Parameters
    ----------
    settings : Settings
    protocol : Protocol
    rig_path : Path or None
        RIG.toml; the virtual rig if not given.
    home_rad : float or None
        Where the joint stood, on the drive's scale, when the session began that this goes on with.
    side : LoopSide
        Rings, board and what prepares the process.
    """
    from rigidimeter.acquisition.realtime import DeadlineClock

    clock = DeadlineClock()
    if rig_path is None:
        rig, new_joint = _virtual(settings, protocol)
        claim: AbstractContextManager[Any] = nullcontext()
    else:
        # What is slow to load is loaded before the sensor's samples flow.
        import rigidimeter.commissioning  # noqa: F401
        from rigidimeter.device.rigfile import load_rig

        claim = load_rig(rig_path).claim()
        rig, new_joint = _real(rig_path, settings, clock, home_rad), lambda _: {}
    with claim:
        _run(settings, protocol, rig, new_joint, clock, side, rig_path)


def _run(
    settings: Settings,
    protocol: Protocol,
    rig: Any,
    new_joint: Any,
    clock: Any,
    side: LoopSide,
    rig_path: Path | None,
) -> None:
    from rigidimeter.acquisition import run_session

    try:
        rig.connect()
        facts = rig.configure()
        if rig_path is not None:
            from rigidimeter.commissioning import check_record
            from rigidimeter.device.rigfile import load_rig

            record = check_record(load_rig(rig_path), facts, settings, settings.commissioning)
            if record.not_tried:
                what = ", ".join(record.not_tried)
                print(f"Not tried when the rig was commissioned: {what}.", file=sys.stderr)
                side.sink.event("not_commissioned", checks=list(record.not_tried))
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


def _real(path: Path, settings: Settings, clock: Any, home_rad: float | None) -> Any:
    from rigidimeter.device.composed import Home
    from rigidimeter.device.rigfile import load_rig

    home = Home(home_rad, HOME_TOLERANCE_RAD) if home_rad is not None else None
    return load_rig(path).build(clock.now_s, settings.rig.tick_rate_hz, home)
