"""A session of a plan, or the rest of one: what to run, after which wait, and what it leaves."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rigidimeter.cli.console import require_full_waits
from rigidimeter.cli.output import echo
from rigidimeter.cli.planned_session import PlannedSession, new_session
from rigidimeter.cli.progress import Meter
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import in_codes
from rigidimeter.core.study_files import (
    SESSIONS,
    ContinuedSession,
    DueBlock,
    StudyPlan,
    add_change,
    begun_session,
    continued_session,
    due_words,
    extend_study,
    next_block,
    next_words,
    parse_change,
    plan_of,
    subject_of,
    wait_words,
)

_TICK_S = 0.5


@dataclass(frozen=True)
class SaidOfSession:
    """What the operator said of a session, on the command line or in a form.

    Attributes
    ----------
    subject, operator, note : str
    stimulation : str
        ``on``, ``off since 10:42``; empty if nothing was said.
    block : str
        ``DAY/ORDER``, to run another session than the one that is due; empty for that one.
    begin_anyway : str
        Why not to wait.
    speed : float
        Of the clock of the waits; above 1 on the virtual rig alone.
    day : str
        A label, where the session is of no plan.
    """

    subject: str = ""
    operator: str = ""
    note: str = ""
    stimulation: str = ""
    block: str = ""
    begin_anyway: str = ""
    speed: float = 1.0
    day: str = ""

    def facts(self) -> dict[str, str]:
        """Return what a manifest says of a session of no plan."""
        said = {key: getattr(self, key) for key in ("subject", "operator", "note", "day")}
        return {key: text for key, text in said.items() if text}


@dataclass(frozen=True)
class SessionOfPlan:
    """A session of a plan, or what is left of one, before its wait is over.

    Attributes
    ----------
    plan : StudyPlan
    due : DueBlock
    said : SaidOfSession
    rest : ContinuedSession or None
        Where it continues one.
    """

    plan: StudyPlan
    due: DueBlock
    said: SaidOfSession
    rest: ContinuedSession | None = None

    def planned(self) -> PlannedSession:
        """Return a new session as it is to be run now, with its place in the plan."""
        said = self.said
        begun = begun_session(
            self.plan,
            self.due,
            datetime.now(UTC),
            operator=said.operator,
            note=said.note,
            speed=said.speed,
            reason=said.begin_anyway,
        )
        return new_session(begun.settings, begun.about, begun.source)

    def waited(self) -> Mapping[str, Any]:
        """Count down to the end of the wait; return what the manifest says of one begun then.

        Raises
        ------
        UserError
            If the wait has not begun, or the stimulation was changed meanwhile.
        """
        said, rest = self.said, self.rest
        if rest is None:
            due = _after_wait(self.plan, self.due, said.begin_anyway, said.speed)
            return replace(self, due=due).planned().about
        if words := rest.words(datetime.now(UTC)):
            echo(words)
            due = _after_wait(self.plan, self.due, said.begin_anyway, rest.speed)
            rest = replace(rest, due=due)
        return {"plan": rest.facts(datetime.now(UTC), said.begin_anyway)}

    def folder(self, out: Path | None = None) -> Path:
        """Return the new folder of the session, whose name does not give the condition away.

        Raises
        ------
        UserError
            If another was named that is not in the study.
        """
        study = self.plan.folder
        if out is not None and out.resolve().parent not in (study, study / SESSIONS):
            raise UserError(f"--out {out}: is outside the study {study}; leave it out")
        return study / self.due.folder if out is None else out

    def add(self, folder: Path) -> None:
        """Add the recorded session to the study, and say what is left of the plan."""
        for line in extend_study(self.plan.folder, [folder]):
            echo(in_codes(line, self.plan.about.codes))
        echo(next_words(self.plan, self.due.block.subject))


def _after_wait(plan: StudyPlan, due: DueBlock, begin_anyway: str, speed: float) -> DueBlock:
    """Count down to the end of the wait; return the session as it is due then."""
    left = due.left_min(datetime.now(UTC), speed)
    if left == 0.0:
        return due
    if begin_anyway:
        echo(f"Begun without waiting: {begin_anyway}")
        return due
    if left is None:
        raise UserError(
            f"{wait_words(due, datetime.now(UTC))}; enter it with --stimulation "
            '"on since 10:42", or begin with --begin-anyway REASON'
        )
    echo(wait_words(due, datetime.now(UTC), speed))
    total_s = 60.0 * left / speed
    start_s = time.monotonic()
    with Meter("wait", total_s) as meter:
        while (gone_s := time.monotonic() - start_s) < total_s:
            meter.reach(gone_s)
            time.sleep(min(_TICK_S, total_s - gone_s))
    _, day, order = due.block.key
    found = next_block(plan, due.block.subject, (day, order))
    if found is None or found.part != due.part:
        raise UserError("the session was recorded by another program during the wait")
    if found.wait_from != due.wait_from:
        raise UserError("the stimulation was changed during the wait; begin the wait again")
    return found


def rest_of_plan(
    resume: Path, about: Mapping[str, Any], said: SaidOfSession
) -> SessionOfPlan | None:
    """Return what is left of a session of a plan; None where it is of none.

    Raises
    ------
    UserError
        If something was said that has a meaning with a plan alone, is wrong, or contradicts it.
    """
    found = continued_session(resume, about)
    refuse_without_next(said, continued=found is not None)
    if found is None:
        return None
    subject, day, _ = found.due.block.key
    for option, other, own in (("subject", said.subject, subject), ("day", said.day, day)):
        if other not in ("", own):
            raise UserError(
                f"--{option} {other}: the session that is continued is of {own}; leave it out"
            )
    if said.stimulation:
        change = parse_change(said.stimulation, subject, datetime.now(UTC), said.operator)
        add_change(found.plan.folder, change)
        found = continued_session(resume, about) or found
    return SessionOfPlan(found.plan, found.due, said, found)


def next_session(study: Path, said: SaidOfSession, *, virtual: bool) -> SessionOfPlan:
    """Return the session of a study that is due, or the one that was named.

    Raises
    ------
    UserError
        If the study has no plan or nothing is left of it, the subject or session is not in it, or
        the clock is speeded up where a person is waiting.
    """
    require_full_waits(said.speed, virtual=virtual)
    plan = plan_of(study)
    subject = subject_of(plan, said.subject)
    if said.stimulation:
        add_change(study, parse_change(said.stimulation, subject, datetime.now(UTC), said.operator))
    found = _named(plan, subject, said.block) if said.block else next_block(plan, subject)
    if found is None:
        raise UserError(
            f"{study}: all sessions of {subject} are recorded; name one with --block DAY/ORDER "
            "to run it again"
        )
    echo(due_words(plan, found))
    return SessionOfPlan(plan, found, said)


def refuse_with_next(given: Mapping[str, bool]) -> None:
    """Refuse options of what the plan of a study says, where one is given.

    Raises
    ------
    UserError
        Naming the option.
    """
    for option, there in given.items():
        if there:
            raise UserError(f"{option} does not go with --next: the plan of the study says it")


def refuse_without_next(said: SaidOfSession, *, continued: bool = False) -> None:
    """Refuse what has a meaning with a plan alone; the wait also where one of it is continued.

    Raises
    ------
    UserError
        Naming the option.
    """
    given = {
        "--stimulation": said.stimulation and not continued,
        "--begin-anyway": said.begin_anyway and not continued,
        "--block": said.block,
        "--clock-speed": said.speed != 1.0,
    }
    for option, there in given.items():
        if there:
            resumed = option in ("--stimulation", "--begin-anyway")
            more = ", or with --resume of a session of its plan" if resumed else ""
            raise UserError(f"{option} goes with --next STUDY alone{more}")


def _named(plan: StudyPlan, subject: str, text: str) -> DueBlock:
    day, _, order = text.rpartition("/")
    found = None
    if order.isdigit():
        found = next_block(plan, subject, (day, int(order)))
    if found is None:
        raise UserError(
            f"--block {text}: the plan of {subject} has no such session; write its day and its "
            "number on that day, such as 3/2"
        )
    return found
