"""What was recorded of a plan, and which session is due, after which wait.

A session that was run from a plan has its place in its manifest, under `about.plan`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from rigidimeter.core.study_files.day_plan import PlannedBlock, StudyPlan
from rigidimeter.core.study_files.session_scan import (
    SESSIONS,
    ScannedSession,
    scan_session,
    session_folders,
)
from rigidimeter.core.study_files.stimulation_log import (
    StimulationChange,
    last_change,
    read_changes,
)


@dataclass(frozen=True)
class RecordedBlock:
    """A session folder, and the place in the plan that its manifest gives.

    Attributes
    ----------
    path : str
        Below the study folder.
    created_utc : str
    facts : mapping
        `about.plan` of the manifest; empty where the session was not run from a plan.
    good, planned : int
        Epochs that ended with success, and those that were planned.
    begun : bool
        Whether an epoch was started; one that was refused before is still to be recorded.
    """

    path: str
    created_utc: str
    facts: Mapping[str, Any]
    good: int
    planned: int
    begun: bool

    @property
    def key(self) -> tuple[str, str, int] | None:
        """Subject, day and place in the day; None where it was not run from a plan."""
        if not self.facts:
            return None
        return str(self.facts["subject"]), str(self.facts["day"]), int(self.facts["order"])


@dataclass(frozen=True)
class DueBlock:
    """The session that is due.

    Attributes
    ----------
    block : PlannedBlock
    place : (int, int)
        Which one it is of how many, of this subject.
    stimulation : str
        What it must be: ``on`` or ``off``.
    change : StimulationChange or None
        The last change of the subject's stimulation that was written down, since the last session
        of another day.
    wait_from : StimulationChange or None
        From when the wait runs: from the change; where examiners are blinded from the last report,
        which is made before every session, also where nothing is changed, since a wait that is
        over at once would give the condition away. None where the state is another or unknown.
    part : int
        From 1; more where it was begun before.
    """

    block: PlannedBlock
    place: tuple[int, int]
    stimulation: str
    change: StimulationChange | None
    wait_from: StimulationChange | None
    part: int = 1

    @property
    def folder(self) -> str:
        """The folder of the session below that of the study; it does not tell the condition."""
        part = f"-{self.part}" if self.part > 1 else ""
        name = f"{self.block.subject}-day-{self.block.day}-{self.block.order}{part}"
        return f"{SESSIONS}/" + re.sub(r"[^\w.-]+", "-", name)

    def since_min(self, now: datetime, speed: float = 1.0) -> float | None:
        """Return the minutes since the change, on a clock that is `speed` times as fast."""
        known = self.change is not None and self.change.stimulation == self.stimulation
        if not known or self.change is None or self.change.is_ahead_of(now):
            return None
        return speed * self.change.minutes_until(now)

    def left_min(self, now: datetime, speed: float = 1.0) -> float | None:
        """Return the minutes of the wait that are left; None where it has not begun."""
        if self.block.wait_min == 0.0 and self.change is None:
            return 0.0
        if self.wait_from is None or self.wait_from.is_ahead_of(now):
            return None
        return max(self.block.wait_min - speed * self.wait_from.minutes_until(now), 0.0)


def recorded_blocks(study: Path) -> tuple[RecordedBlock, ...]:
    """Return the sessions in a study folder and in its folder `sessions`, the oldest first."""
    scanned = (scan_session(study, folder) for folder in session_folders(study))
    return tuple(sorted(map(_recorded, scanned), key=lambda one: one.created_utc))


def _recorded(one: ScannedSession) -> RecordedBlock:
    return RecordedBlock(
        one.path,
        str(one.manifest["created_utc"]),
        one.about.get("plan", {}),
        sum(event["outcome"] == "success" for event in one.of("epoch_ended")),
        len(one.manifest["protocol"]),
        bool(one.of("epoch_started")),
    )


def due_block(plan: StudyPlan, recorded: Sequence[RecordedBlock], subject: str) -> DueBlock | None:
    """Return the next session of a subject in the order of the plan; None if all are recorded.

    A session that ended before all its epochs were run counts as recorded: it is continued, or run
    again, by its name.
    """
    own = [block for block in plan.blocks if block.subject == subject]
    done = {one.key for one in recorded if one.begun}
    for number, block in enumerate(own, start=1):
        if block.key not in done:
            return _due(plan, recorded, block, (number, len(own)))
    return None


def named_block(
    plan: StudyPlan, recorded: Sequence[RecordedBlock], key: tuple[str, str, int]
) -> DueBlock | None:
    """Return a session of the plan by its name, to be run out of order or once more."""
    own = [block for block in plan.blocks if block.subject == key[0]]
    for number, block in enumerate(own, start=1):
        if block.key == key:
            return _due(plan, recorded, block, (number, len(own)))
    return None


def _due(
    plan: StudyPlan,
    recorded: Sequence[RecordedBlock],
    block: PlannedBlock,
    place: tuple[int, int],
) -> DueBlock:
    own = [one for one in recorded if one.begun and one.facts.get("subject") == block.subject]
    changes = [one for one in read_changes(plan.folder) if one.subject == block.subject]
    wanted = plan.about.stimulation_of(block.condition)
    # What was switched between two days, at home, nobody wrote down.
    today = _after([one for one in own if one.facts["day"] != block.day], changes)
    change = last_change(today)
    wait_from = change
    if plan.blinded:
        new = _after(own, changes)
        wait_from = new[-1] if new else None
    if wait_from is not None and wait_from.stimulation != wanted:
        wait_from = None
    part = 1 + sum(one.key == block.key for one in recorded)
    return DueBlock(block, place, wanted, change, wait_from, part)


def _after(
    sessions: Sequence[RecordedBlock], changes: Sequence[StimulationChange]
) -> list[StimulationChange]:
    """Return the changes since the last of these sessions began."""
    if not sessions:
        return list(changes)
    last = datetime.fromisoformat(max(one.created_utc for one in sessions))
    return [one for one in changes if one.changed_utc > last]
