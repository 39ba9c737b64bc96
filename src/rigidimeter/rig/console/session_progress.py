"""What a session is to do, and how far it has come: what runs, what ended how, what is left to run.

The plan is known before it begins; the events are those that are recorded, in their order.
`progress_after` takes one at a time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from rigidimeter.core.session import PlannedEpoch
from rigidimeter.core.settings import Settings
from rigidimeter.planning import NO_DOSE, Dose


@dataclass(frozen=True)
class SessionPlan:
    """What the console knows of the session that it shows.

    Attributes
    ----------
    settings : Settings
    epochs : tuple of PlannedEpoch
        Those that this run is to do, in order.
    done_before : int
        How many epochs were done in the session that this one continues.
    codes : mapping of str to str
        What the operator reads in place of a condition's name; empty where nobody is blinded.
    virtual : bool
        Whether the rig is the virtual one.
    raters : tuple of str
        Who is to rate, where a plan names them.
    """

    settings: Settings
    epochs: tuple[PlannedEpoch, ...]
    done_before: int = 0
    codes: Mapping[str, str] = field(default_factory=dict)
    virtual: bool = False
    raters: tuple[str, ...] = ()

    @property
    def total(self) -> int:
        """How many epochs the whole session has, repetitions aside.

        One that was continued more than once knows it from the numbers, which epochs keep.
        """
        numbers = [epoch.number for epoch in self.epochs]
        return max(self.done_before + len(self.epochs), *numbers, 0)

    def shown(self, condition: str) -> str:
        """Return what the operator may read of a condition.

        A condition without a code is not named where others have one.
        """
        return self.codes.get(condition, "(blinded)") if self.codes else condition


@dataclass(frozen=True)
class EndedEpoch:
    """An epoch that was run; `place` is that in the session, which a repetition shares."""

    number: int
    place: int
    label: str
    task: str
    condition: str
    outcome: str
    reason: str
    started_s: float
    ended_s: float
    repeated: bool


@dataclass(frozen=True)
class Progress:
    """How far a session has come.

    Attributes
    ----------
    to_run : tuple of PlannedEpoch
        In order, with the repetitions that are due.
    places : mapping of int to int
        Number of an epoch to its place in the session, from 1.
    current : PlannedEpoch or None
        The epoch that runs, or did last and whose rest runs.
    running : bool
        Whether it runs.
    started_s : float
        When it began.
    ended : tuple of EndedEpoch
    zeroed : bool
        Whether the torque sensor was zeroed.
    alone_kg_m2 : float
        J of what the rig has beyond the torque sensor, by the daily check; 0 if not known.
    stop : str
        Why the guard last stopped or held the rig, with value, limit and remedy.
    outcome, reason : str
        How the session ended; empty as long as it runs.
    wild_samples : int
        Single torque samples far from those around them, up to the last epoch that ended.
    range_rad : tuple of float or None
        Both ends of the person's range of motion, from where the joint began.
    dose : Dose
        What was done up to the last epoch, with the session that this one continues.
    """

    to_run: tuple[PlannedEpoch, ...]
    places: Mapping[int, int]
    current: PlannedEpoch | None = None
    running: bool = False
    started_s: float = 0.0
    ended: tuple[EndedEpoch, ...] = ()
    zeroed: bool = False
    alone_kg_m2: float = 0.0
    stop: str = ""
    outcome: str = ""
    reason: str = ""
    wild_samples: int = 0
    range_rad: tuple[float, float] | None = None
    dose: Dose = NO_DOSE


def progress_at_start(epochs: tuple[PlannedEpoch, ...]) -> Progress:
    """Return the progress of a session of which nothing has run yet."""
    return Progress(epochs, {epoch.number: epoch.number for epoch in epochs})


def progress_after(progress: Progress, event: Mapping[str, Any]) -> Progress:
    """Return the progress after an event; events that say nothing of it leave it as it is."""
    kind = event.get("event")
    if kind == "epoch_started":
        return _started(progress, event)
    if kind == "epoch_ended":
        return _ended(progress, event)
    if kind == "rig_enabled" and event.get("range_rad"):
        low_rad, high_rad = event["range_rad"]
        return replace(progress, range_rad=(low_rad, high_rad))
    if kind == "sensor_zeroed":
        return replace(progress, zeroed=not event["refused"])
    if kind == "daily_check":
        return replace(progress, alone_kg_m2=event.get("inertia_kg_m2", 0.0))
    if kind == "guard_latched":
        return replace(progress, stop=event["sentence"])
    if kind == "session_ended":
        return replace(
            progress, running=False, outcome=event["outcome"], reason=event["reason"] or ""
        )
    return progress


def _started(progress: Progress, event: Mapping[str, Any]) -> Progress:
    number = event["epoch"]
    found = next((epoch for epoch in progress.to_run if epoch.number == number), None)
    if found is None:  # its plan is not known here: what the event says of it
        found = PlannedEpoch(
            number, event["label"], event["task"], event["condition"], event["planned_s"], 0.0
        )
    return replace(
        progress,
        to_run=tuple(epoch for epoch in progress.to_run if epoch.number != number),
        current=found,
        running=True,
        started_s=event["time_s"],
    )


def _ended(progress: Progress, event: Mapping[str, Any]) -> Progress:
    current = progress.current
    if current is None or current.number != event["epoch"]:
        return progress
    again = event.get("again_as")
    places, to_run = progress.places, progress.to_run
    place = places.get(current.number, current.number)
    if again is not None:
        repetition = replace(current, number=again, label=f"{current.label}r")
        places = {**places, again: place}
        # One that was ended by the operator is repeated next, one that failed at the end.
        first = event["outcome"] == "abort"
        to_run = (repetition, *to_run) if first else (*to_run, repetition)
    ended = EndedEpoch(
        current.number,
        place,
        current.label,
        current.task,
        current.condition,
        event["outcome"],
        event["reason"] or "",
        progress.started_s,
        event["time_s"],
        again is not None,
    )
    return replace(
        progress,
        to_run=to_run,
        places=places,
        running=False,
        ended=(*progress.ended, ended),
        wild_samples=event.get("counts", {}).get("torque_wild", 0),
        dose=Dose.of_record(event.get("dose", progress.dose._asdict())),
    )
