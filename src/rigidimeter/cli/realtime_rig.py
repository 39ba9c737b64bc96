"""Compose rig, loop and processes for a session in real time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidimeter.cli.output import echo

if TYPE_CHECKING:
    from rigidimeter.core.session import PlannedEpoch, Protocol
    from rigidimeter.core.settings import Settings
    from rigidimeter.planning import Dose
    from rigidimeter.rig.acquisition import DeadlineClock
    from rigidimeter.rig.acquisition.processes import LoopSide
    from rigidimeter.rig.devices.base import Rig
    from rigidimeter.rig.guard import DriveModel

HOME_TOLERANCE_RAD = 0.05
"""A session is continued from where it began, within 3 deg."""


def run_loop(
    settings: Settings,
    protocol: Protocol,
    rig_path: Path | None,
    home_rad: float | None,
    range_rad: tuple[float, float] | None,
    side: LoopSide,
    drive_model: DriveModel | None = None,
    dose_before: Dose | None = None,
) -> None:
    """Run a session; the target of the loop's process.

    Parameters
    ----------
    settings : Settings
    protocol : Protocol
    rig_path : Path or None
        RIG.toml; the virtual rig if not given.
    home_rad : float or None
        Where the joint stood, on the drive's scale, when the session began that this one continues.
    range_rad : tuple of float or None
        The range of motion of the person, on the drive's scale.
    side : LoopSide
        Rings, shared status and what prepares the process.
    drive_model : DriveModel, optional
        Of the drive's side; without it the guard does not compare the torque sensor with the
        drive's own torque.
    dose_before : Dose, optional
        What the session did that this one continues.
    """
    from rigidimeter.rig.acquisition import DeadlineClock

    clock = DeadlineClock()
    if rig_path is None:
        rig, new_joint = virtual_rig(settings, protocol)
        _run(
            *(settings, protocol, rig, new_joint, clock, side, lambda _: ()),
            *(range_rad, drive_model, dose_before),
        )
        return
    # What is slow to load is loaded before the sensor's samples flow.
    from rigidimeter.rig.commissioning import check_record, require_daily_check
    from rigidimeter.rig.devices import Home, drive_bounds, load_rig

    rigfile = load_rig(rig_path)
    home = Home(home_rad, HOME_TOLERANCE_RAD) if home_rad is not None else None

    def approve(facts: Mapping[str, Any]) -> tuple[str, ...]:
        commissioned = check_record(rigfile, facts, settings)
        today = require_daily_check(rigfile, commissioned, settings)
        side.sink.event("daily_check", made_utc=today.made_utc, **today.numbers)
        return commissioned.not_tried

    with rigfile.claim() as lock:
        bounds = drive_bounds(settings, range_rad)
        rig = rigfile.build(clock.now_s, settings.rig.tick_rate_hz, home, lock, bounds)
        _run(
            *(settings, protocol, rig, lambda _: {}, clock, side, approve),
            *(range_rad, drive_model, dose_before),
        )


def _run(
    settings: Settings,
    protocol: Protocol,
    rig: Rig,
    new_joint: Callable[[PlannedEpoch], Mapping[str, Any]],
    clock: DeadlineClock,
    side: LoopSide,
    approve: Callable[[Mapping[str, Any]], Sequence[str]],
    range_rad: tuple[float, float] | None,
    drive_model: DriveModel | None,
    dose_before: Dose | None,
) -> None:
    """Set up the rig and run; `approve` refuses it or says which checks were never made."""
    from rigidimeter.planning import NO_DOSE
    from rigidimeter.rig.acquisition import run_session

    try:
        rig.connect()
        facts = rig.configure()
        not_tried = approve(facts)
        side.sink.event("rig_configured", **facts)
        side.sink.event("clock_started", monotonic_s=clock.origin_s)
        if not_tried:
            what = ", ".join(not_tried)
            echo(f"Not tried when the rig was commissioned: {what}.", err=True)
            side.sink.event("not_commissioned", checks=list(not_tried))
        side.ready()
        run_session(
            protocol,
            settings,
            rig,
            clock,
            side.sink,
            before_epoch=new_joint,
            supervision=side.supervision,
            zero_first=True,
            dose_before=dose_before or NO_DOSE,
            state_changed=side.sink.state_changed,
            watch=side.sink.watch,
            range_rad=range_rad,
            drive_model=drive_model,
        )
    finally:
        rig.close()


def virtual_rig(
    settings: Settings, protocol: Protocol
) -> tuple[Rig, Callable[[PlannedEpoch], Mapping[str, Any]]]:
    """Return the virtual rig, and what gives its joint to each epoch.

    Until the first epoch the subject is relaxed, as a person is asked to be while the torque sensor
    is zeroed.
    """
    import numpy as np

    from rigidimeter.rig.devices import SimulatedRig

    first = settings.subject[protocol.epochs[0].condition]
    rig = SimulatedRig(settings.rig, first.relaxed, np.random.default_rng(settings.seed))

    def new_joint(planned: PlannedEpoch) -> dict[str, Any]:
        return {"true_joint": asdict(rig.new_epoch(settings.subject[planned.condition]))}

    return rig, new_joint
