"""A session of a plan that is continued: whether the stimulation is still as it was when it began.

The stimulation may have been switched in the break. Then the rest of the session has a wait of its
own, as its beginning had, and its epochs have other minutes since the change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files.day_plan import StudyPlan, read_plan
from rigidimeter.core.study_files.next_session import change_facts, wait_words
from rigidimeter.core.study_files.plan_progress import DueBlock, named_block, recorded_blocks
from rigidimeter.core.study_files.session_scan import SESSIONS


@dataclass(frozen=True)
class ContinuedSession:
    """What is left of a session of a plan.

    Attributes
    ----------
    plan : StudyPlan
    due : DueBlock
        The session's place in the plan, with the stimulation as it is now.
    place : mapping
        `about.plan` of the manifest of the part before.
    """

    plan: StudyPlan
    due: DueBlock
    place: Mapping[str, Any]

    @property
    def speed(self) -> float:
        """Of the clock of the waits: that of the part before."""
        return float(self.place["clock_speed"])

    def waits(self, now: datetime) -> bool:
        """Whether a wait has to pass: the stimulation is not known to be as it was before."""
        since = change_facts(self.due, now)["stimulation_changed_utc"]
        changed = bool(since != self.place["stimulation_changed_utc"])
        return changed and self.due.left_min(now, self.speed) != 0.0

    def words(self, now: datetime) -> str:
        """Return why it has to wait; empty where it has not."""
        if not self.waits(now):
            return ""
        what = (
            "Whether the stimulation was switched since this session began is not known"
            if self.due.change is None
            else "The stimulation was switched since this session began"
        )
        return f"{what}. {wait_words(self.due, now, self.speed)}."

    def facts(self, now: datetime, reason: str = "") -> dict[str, Any]:
        """Return `about.plan` of the part that begins now.

        Parameters
        ----------
        now : datetime
        reason : str
            Why not to wait; not recorded where there is no wait.

        Raises
        ------
        UserError
            If it has to wait and no reason is given.
        """
        if self.waits(now) and not reason:
            raise UserError(self.words(now).removesuffix("."))
        over = self.due.left_min(now, self.speed) == 0.0
        why = reason if self.waits(now) else self.place["wait_cut_short"]
        return {
            **self.place,
            **change_facts(self.due, now, self.speed),
            "wait_cut_short": "" if over else why,
        }


def continued_session(session: Path, about: Mapping[str, Any]) -> ContinuedSession | None:
    """Return what is left of a session, with its place in the plan of its study.

    Parameters
    ----------
    session : Path
        The part before, in the study folder or in its folder `sessions`.
    about : mapping
        Of its manifest.

    Returns
    -------
    ContinuedSession or None
        None where it was not run from a plan, or the plan no longer has it.

    Raises
    ------
    UserError
        If the plan, a manifest or the table of the stimulation cannot be read.
    """
    place = about.get("plan")
    if not place:
        return None
    here = session.resolve().parent
    study = here.parent if here.name == SESSIONS else here
    plan = read_plan(study)
    if plan is None:
        return None
    key = str(place["subject"]), str(place["day"]), int(place["order"])
    due = named_block(plan, recorded_blocks(study), key)
    return ContinuedSession(plan, due, place) if due is not None else None
