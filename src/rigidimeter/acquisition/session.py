"""Run a protocol on a rig and write it down as it happens."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from rigidimeter.acquisition.clock import Clock
from rigidimeter.acquisition.loop import ControlLoop, Passage
from rigidimeter.design import PlannedEpoch, Protocol, prbs_nm, sinusoid
from rigidimeter.device.base import Rig
from rigidimeter.guard import Cause, why_ended
from rigidimeter.recording.folder import Ending, SessionWriter
from rigidimeter.settings import Settings

__all__ = ["SessionResult", "run_session"]

BeforeEpoch = Callable[[PlannedEpoch], Mapping[str, Any]]
Progress = Callable[[float], None]


@dataclass(frozen=True)
class SessionResult:
    """How a session ended, and how many epochs ended with success."""

    outcome: Ending
    reason: str
    epochs_run: int
    epochs_good: int


def run_session(
    protocol: Protocol,
    settings: Settings,
    rig: Rig,
    clock: Clock,
    writer: SessionWriter,
    *,
    before_epoch: BeforeEpoch = lambda _: {},
    progress: Progress = lambda _: None,
) -> SessionResult:
    """Run every epoch of a protocol with its rest.

    However it ends, the velocity is ramped to zero, the rig disabled, and each open epoch and the
    session closed with a reason.

    Parameters
    ----------
    protocol : Protocol
    settings : Settings
    rig : Rig
    clock : Clock
    writer : SessionWriter
        Closed on return.
    before_epoch : callable
        Called while the arm rests, before each epoch; what it returns is stored with the epoch.
    progress : callable
        Called with the session time, about once a second of it.
    """
    loop = ControlLoop(settings, rig, clock, writer.sample, progress)
    perturbation = prbs_nm(settings.prbs, settings.rig.tick_rate_hz).tolist()
    angle, velocity = (
        values.tolist() for values in sinusoid(settings.sinusoid, settings.rig.tick_rate_hz)
    )
    run = good = 0
    outcome: Ending = "success"
    reason = ""
    current: PlannedEpoch | None = None
    writer.session_started()
    try:
        rig.enable()
        for planned in protocol.epochs:
            facts = before_epoch(planned)
            writer.epoch_started(
                planned.number,
                planned.label,
                planned.task,
                planned.condition,
                loop.time_s,
                planned_s=planned.duration_s,
                **facts,
            )
            current = planned
            if planned.task == "prbs":
                passage = loop.perturb(planned.number, perturbation)
            else:
                passage = loop.follow(planned.number, angle, velocity)
            ending, why = _ending(passage, settings)
            writer.epoch_ended(
                planned.number, loop.time_s, ending, why, limited_ticks=passage.limited_ticks
            )
            current = None
            run += 1
            good += ending == "success"
            if passage.cause is Cause.NONE:
                passage = loop.rest(planned.rest_s, settings.protocol.return_s)
            if passage.cause is not Cause.NONE:
                outcome, reason = "fail", f"the guard stopped the rig: {passage.cause.sentence}"
                break
    except KeyboardInterrupt:
        outcome, reason = "abort", "interrupted by the operator"
    except Exception as error:
        outcome, reason = "fail", f"{type(error).__name__}: {error}"
        raise
    finally:
        _close(loop, rig, writer, current, outcome, reason)
    return SessionResult(outcome, reason, run, good)


def _ending(passage: Passage, settings: Settings) -> tuple[Ending, str]:
    why = why_ended(settings, passage.cause, passage.limit_time_s)
    return ("fail", why) if why else ("success", "")


def _close(
    loop: ControlLoop,
    rig: Rig,
    writer: SessionWriter,
    current: PlannedEpoch | None,
    outcome: Ending,
    reason: str,
) -> None:
    """Stop, disable, close: every step is tried even when one before it fails."""
    try:
        loop.stop()
    finally:
        try:
            rig.disable()
        finally:
            if current is not None:
                writer.epoch_ended(current.number, loop.time_s, outcome, reason)
            writer.close(loop.time_s, outcome, reason)
