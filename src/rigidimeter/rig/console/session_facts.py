"""What an operator needs to know while a session runs, as values: one place for every view.

`facts` computes them from the plan, the progress and what the processes show; it reads nothing
itself. Who shows them computes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from rigidimeter.core.session import PlannedEpoch
from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.acquisition import Phase, State
from rigidimeter.rig.acquisition.processes import PAUSE_NEXT, STOP_NEXT, LiveEstimate, LoopStatus
from rigidimeter.rig.console.emg_state import EmgState
from rigidimeter.rig.console.indicators import (
    Indicator,
    Level,
    LimitDistance,
    RecentSamples,
    RecorderState,
    all_indicators,
    limit_distances,
)
from rigidimeter.rig.console.live_parameters import LiveValue, live_values
from rigidimeter.rig.console.session_progress import Progress, SessionPlan
from rigidimeter.rig.guard import Cause, Reaction

COUNTED = {
    Phase.HOLD: "",
    Phase.ZEROING: "zero of the torque sensor",
    Phase.EPOCH: "epoch",
    Phase.RETURN: "return",
    Phase.REST: "rest",
}
"""Of what a countdown is."""

DOING = {
    Phase.HOLD: "the arm comes to rest",
    Phase.ZEROING: "the torque sensor is zeroed",
    Phase.EPOCH: "epoch runs",
    Phase.RETURN: "the arm moves back to its start",
    Phase.REST: "rest",
}
"""What is asked of the arm while a run goes on."""


@dataclass(frozen=True)
class EpochFacts:
    """An epoch as the operator sees it: epoch `place` of the session's `of`.

    `condition` is the code where the operator is blinded; `again` says that it is a repetition.
    """

    place: int
    of: int
    label: str
    task: str
    condition: str
    duration_s: float
    again: bool

    @property
    def text(self) -> str:
        """The epoch in words."""
        again = ", again" if self.again else ""
        return f"epoch {self.place} of {self.of}{again}: {self.condition}, {self.task}"


@dataclass(frozen=True)
class ConditionCount:
    """How many epochs of a condition ended with success, did not, and are left to run."""

    condition: str
    good: int
    bad: int
    left: int


@dataclass(frozen=True)
class Facts:
    """What an operator needs to know.

    Attributes
    ----------
    time_s : float
        Of the session.
    state : State
    state_words : str
        The state, and what comes after this epoch.
    epoch, next_epoch : EpochFacts or None
        The epoch that runs, and the one after it.
    counts : tuple of ConditionCount
        In order of first appearance.
    countdown_words : str
        Of what `countdown_s` is left; empty where nothing runs for a known time.
    countdown_s, session_left_s : float
        NaN where not known. A pause is not counted.
    live : tuple of LiveValue
        J, B and K.
    live_words : str
        Of which epoch they are.
    angle_deg, torque_nm, drive_torque_nm : float
        Now; torques are means of 0.1 s. The drive's is that of its motor, NaN if it reports none.
    distances : tuple of LimitDistance
    indicators : tuple of Indicator
        The last one is that of the EMG where the settings have some.
    emg_words : str
        What is wrong with the EMG; empty while all is well.
    cause : Cause
        For which the guard holds or has stopped the rig.
    stop_words : str
        The same as a sentence, or how the session ended; empty while all is well.
    held : bool
        Whether the guard only holds it: the operator may resume.
    """

    time_s: float
    state: State
    state_words: str
    epoch: EpochFacts | None
    next_epoch: EpochFacts | None
    counts: tuple[ConditionCount, ...]
    countdown_words: str
    countdown_s: float
    session_left_s: float
    live: tuple[LiveValue, ...]
    live_words: str
    angle_deg: float
    torque_nm: float
    drive_torque_nm: float
    distances: tuple[LimitDistance, ...]
    indicators: tuple[Indicator, ...]
    emg_words: str
    cause: Cause
    stop_words: str
    held: bool


def facts(
    plan: SessionPlan,
    progress: Progress,
    loop: LoopStatus,
    history: Sequence[LiveEstimate] = (),
    recent: RecentSamples | None = None,
    recorder: RecorderState | None = None,
    caution: str = "",
    emg: EmgState | None = None,
) -> Facts:
    """Return what the operator needs to know now.

    Parameters
    ----------
    plan : SessionPlan
    progress : Progress
    loop : LoopStatus
    history : sequence of LiveEstimate
        The live estimates of the last seconds, oldest first.
    recent : RecentSamples
    recorder : RecorderState
    caution : str
        What is wrong with the torque of the last epoch.
    emg : EmgState, optional
        Without it there is no lamp of the EMG.
    """
    recent, recorder = recent or RecentSamples(), recorder or RecorderState()
    state = State(loop.state)
    words, countdown_s = _countdown(progress, loop)
    left_s = session_left_s(progress, loop, plan.settings.protocol.return_s)
    distances = limit_distances(plan.settings.guard, recent, loop.energy_j, progress.range_rad)
    live, live_words = _live(plan, progress, history)
    of_emg = () if emg is None else (emg.indicator,)
    wrong = [f"{one.name}: {one.words}" for one in of_emg if one.level >= Level.WATCH]
    return Facts(
        time_s=loop.time_s,
        state=state,
        state_words=_state_words(progress, loop, state),
        epoch=_epoch(plan, progress, progress.current) if progress.running else None,
        next_epoch=_epoch(plan, progress, progress.to_run[0]) if progress.to_run else None,
        counts=_counts(plan, progress),
        countdown_words=words,
        countdown_s=countdown_s,
        session_left_s=left_s,
        live=live,
        live_words=live_words,
        angle_deg=deg_from_rad(loop.angle_rad),
        torque_nm=recent.torque_nm,
        drive_torque_nm=recent.drive_torque_nm,
        distances=distances,
        indicators=all_indicators(
            plan.settings,
            loop,
            recent,
            distances,
            recorder,
            left_s,
            "; ".join(filter(None, (caution, _wild(progress)))),
            progress.dose,
        )
        + of_emg,
        emg_words="".join(wrong),
        cause=Cause(loop.cause),
        stop_words=_stop_words(progress, loop),
        held=not progress.outcome and _held(loop),
    )


def _wild(progress: Progress) -> str:
    count = progress.wild_samples
    samples = "single torque sample was" if count == 1 else "single torque samples were"
    return f"{count} {samples} far from the others" if count else ""


def session_left_s(progress: Progress, loop: LoopStatus, return_s: float) -> float:
    """Return how long the session takes from now on, the last rest included.

    What runs counts by the time that it still lasts, and what follows it before the next epoch.
    """
    if progress.outcome:
        return 0.0
    left_s = sum(epoch.duration_s + return_s + epoch.rest_s for epoch in progress.to_run)
    until_s, phase = loop.until_s - loop.time_s, Phase(loop.phase)
    if phase is not Phase.HOLD and math.isfinite(until_s):
        left_s += max(until_s, 0.0)
    if progress.current is not None:
        if phase is Phase.EPOCH:
            left_s += return_s
        if phase in (Phase.EPOCH, Phase.RETURN):
            left_s += progress.current.rest_s
    return left_s


def _countdown(progress: Progress, loop: LoopStatus) -> tuple[str, float]:
    """Return of what a countdown is, and how much is left of it in s."""
    left_s, what = loop.until_s - loop.time_s, COUNTED[Phase(loop.phase)]
    if not what or not math.isfinite(left_s) or progress.outcome:
        return "", math.nan
    return what, max(left_s, 0.0)


def _state_words(progress: Progress, loop: LoopStatus, state: State) -> str:
    """Return what is asked of the arm and whether it stands still, by what the loop shows."""
    if progress.outcome:
        return f"ended: {progress.outcome}"
    if state is State.IDLE:
        words = "starts"
    elif state is State.PAUSED:
        words = "held by the guard" if loop.cause else "paused"
        words += ", the arm is still" if loop.still else ", the arm comes to rest"
    elif state is State.RUNNING:
        words = DOING[Phase(loop.phase)]
    else:
        words = "stops" if state is State.STOPPING else "stopped by a fault"
    if loop.pending & STOP_NEXT:
        return f"{words}, ends after this epoch"
    return f"{words}, pauses after this epoch" if loop.pending & PAUSE_NEXT else words


def _epoch(plan: SessionPlan, progress: Progress, epoch: PlannedEpoch | None) -> EpochFacts | None:
    if epoch is None:
        return None
    return EpochFacts(
        progress.places.get(epoch.number, epoch.number),
        plan.total,
        epoch.label,
        epoch.task,
        plan.shown(epoch.condition),
        epoch.duration_s,
        epoch.label.endswith("r"),
    )


def _counts(plan: SessionPlan, progress: Progress) -> tuple[ConditionCount, ...]:
    current = [progress.current] if progress.running and progress.current else []
    left = [epoch.condition for epoch in (*current, *progress.to_run)]
    good = [epoch.condition for epoch in progress.ended if epoch.outcome == "success"]
    bad = [epoch.condition for epoch in progress.ended if epoch.outcome != "success"]
    conditions = dict.fromkeys([*(epoch.condition for epoch in plan.epochs), *good, *bad, *left])
    return tuple(
        ConditionCount(plan.shown(name), good.count(name), bad.count(name), left.count(name))
        for name in conditions
    )


def _live(
    plan: SessionPlan, progress: Progress, history: Sequence[LiveEstimate]
) -> tuple[tuple[LiveValue, ...], str]:
    now = history[-1] if history else LiveEstimate()
    tasks = {epoch.number: (epoch.task, epoch.place) for epoch in progress.ended}
    if progress.current is not None:
        number = progress.current.number
        tasks[number] = (progress.current.task, progress.places.get(number, number))
    task, place = tasks.get(now.epoch, ("", now.epoch))
    words = f"epoch {place}" if now.epoch >= 0 else ""
    runs = progress.current.number if progress.running and progress.current else None
    return live_values(history, task, plan.settings.online, running=runs == now.epoch), words


def _stop_words(progress: Progress, loop: LoopStatus) -> str:
    if progress.outcome:
        return progress.reason
    cause = Cause(loop.cause)
    if cause is Cause.NONE:
        return ""
    return f"{'held' if _held(loop) else 'stopped'}: {progress.stop or cause.sentence}"


def _held(loop: LoopStatus) -> bool:
    """Whether the guard holds the rig, and the operator may resume."""
    return Cause(loop.cause).reaction is Reaction.HOLD and State(loop.state) is not State.FAULTED
