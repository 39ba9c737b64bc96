"""The part of the page before a session of a plan: which one is due, its wait, and the start."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from nicegui import ui

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import (
    PLAN_FILE,
    PLAN_TABLE,
    STIMULATION_TABLE,
    BegunSession,
    DueBlock,
    StudyPlan,
    add_change,
    begun_session,
    due_words,
    next_block,
    parse_change,
    plan_of,
    plan_rows,
    recorded_blocks,
    wait_words,
)
from rigidimeter.rig.console.page.form_values import parse_line
from rigidimeter.rig.console.page.jobs import Jobs
from rigidimeter.rig.console.page.page_messages import duration
from rigidimeter.rig.console.page.plan_table import plan_table
from rigidimeter.rig.console.page.rig_steps import start_refusal
from rigidimeter.rig.console.page.rig_view import RigView
from rigidimeter.rig.console.page.server_state import ServerState, StartRequest
from rigidimeter.rig.console.page.session_form import METADATA, NOTE, RANGE, read_range

TICK_S = 0.5
_DUE = "the one that is due"


class PlanView:
    """The due session of the study's plan, as one page shows it.

    Parameters
    ----------
    state : ServerState
    jobs : Jobs
    in_control : callable
        Whether the page may act.
    """

    def __init__(self, state: ServerState, jobs: Jobs, in_control: Callable[[], bool]) -> None:
        self._state, self._jobs, self._in_control = state, jobs, in_control
        place = state.place
        self._plan: StudyPlan | None = None
        self._due: DueBlock | None = None
        self._begun: BegunSession | None = None
        self._seen: object = None
        self._shown_subject = ""
        rig = "the virtual rig" if place.rig is None else place.rig.name
        ui.label(f"Rig: {rig}. Plan: {place.root.name}.").classes("text-lg").mark("what")
        if place.clock_speed != 1.0:
            ui.label(f"Rehearsal: waits pass {place.clock_speed:g} times as fast. Recorded.")
        with ui.row().classes("w-full items-center"):
            self._subject = ui.select([], label="Subject", on_change=self._other).classes("entry")
            self._named = ui.select([_DUE], label="Session", value=_DUE, on_change=self._load)
            self._named.classes("entry").mark("session")
        self._words = ui.label("").classes("text-lg").mark("due")
        with ui.row().classes("w-full items-center"):
            self._left = ui.label("").classes("huge").mark("countdown")
            self._wait = ui.label("").props('role="status"').mark("wait")
        self._switch = ui.row().classes("w-full items-center")
        with self._switch:
            self._change = self._input("stimulation", "Stimulation: on, off, or off since 10:42")
            ui.button("Enter the change", on_click=self._enter).mark("enter-change")
        self._switched = ui.label("").mark("switched")
        self._rig = RigView(state, jobs, in_control, self._settings, self._show)
        fields = (*METADATA[1:], NOTE, *(RANGE if place.rig is not None else ()))
        with ui.row().classes("w-full"):
            self._fields = {
                one.key: self._input(
                    one.key, f"{one.label} [{one.unit}]" if one.unit else one.label
                )
                for one in fields
            }
        self._problem = ui.label("").classes("problem").mark("refused").props('role="alert"')
        with ui.row().classes("w-full items-center"):
            self._start = ui.button("Start session", on_click=lambda: self._ask(""))
            self._start.mark("start").props("size=lg")
            self._reason = self._input("begin_anyway", "Reason to begin before the wait is over")
            self._anyway = ui.button("Begin anyway", on_click=self._ask_anyway).mark("anyway")
            tested = ui.button("Test the tones").mark("tones")
            tested.on("click", js_handler="() => window.rigTones.test()")
        with ui.expansion("Plan").classes("w-full").props("dense"):
            self._table = ui.html("", sanitize=False).classes("plan")
        self._load()
        ui.timer(TICK_S, self._tick)

    def _input(self, key: str, label: str) -> ui.input:
        made = ui.input(label).classes("entry")
        made.props(f"maxlength=200 data-field={key} debounce=150")
        return made

    def _stamp(self) -> object:
        """Return what changes when the plan, the stimulation or the recorded sessions do."""
        root, finished = self._state.place.root, self._state.finished
        paths = (root / name for name in (PLAN_TABLE, PLAN_FILE, STIMULATION_TABLE))
        times = tuple(path.stat().st_mtime_ns if path.exists() else 0 for path in paths)
        return times, finished and finished.number

    def _other(self) -> None:
        """Offer what is due of another subject."""
        if self._subject.value == self._shown_subject:
            return
        self._named.value = _DUE
        self._load()

    def _load(self) -> None:
        """Read the plan and which session is due."""
        self._seen = self._stamp()
        self._due = self._begun = None
        try:
            self._plan = plan = plan_of(self._state.place.root)
            subjects = list(plan.about.subjects)
            subject = self._subject.value if self._subject.value in subjects else subjects[0]
            self._shown_subject = subject
            self._subject.set_options(subjects, value=subject)
            self._subject.set_visibility(len(subjects) > 1)
            recorded = recorded_blocks(plan.folder)
            rows = plan_rows(plan, subject, recorded)
            names = {f"{row[0]}/{row[1]}": (row[0], int(row[1])) for row in rows}
            chosen = self._named.value if self._named.value in names else _DUE
            self._named.set_options([_DUE, *names], value=chosen)
            self._table.set_content(plan_table(rows))
            self._due = next_block(plan, subject, names.get(chosen), recorded)
            if self._due is not None:
                self._begun = begun_session(plan, self._due, datetime.now(UTC))
            self._problem.text = ""
        except UserError as error:
            self._problem.text = str(error)
        self._show()

    def _show(self) -> None:
        """Show the due session, its wait, and why it cannot start."""
        plan, due, begun = self._plan, self._due, self._begun
        blinded = plan is not None and plan.blinded
        self._switch.set_visibility(due is not None and not blinded)
        self._switched.text = self._switch_words()
        if plan is None or due is None:
            self._words.text = "" if self._problem.text else "All sessions are recorded."
            self._left.text = self._wait.text = ""
        else:
            self._words.text = due_words(plan, due)
            now, speed = datetime.now(UTC), self._state.place.clock_speed
            left = due.left_min(now, speed)
            self._left.text = "–" if left is None else duration(60.0 * left)
            self._wait.text = wait_words(due, now, speed)
        if begun is not None and not self._state.busy:
            steps = self._jobs.rig_steps(begun.settings, begun.source)
            self._rig.show(steps)
            why = start_refusal(steps)
            self._problem.text = f"No session can start: {why}." if why else ""
        ready = begun is not None and not self._problem.text
        over = self._left_min() == 0.0
        self._start.set_enabled(ready and over)
        self._reason.set_visibility(due is not None and not over)
        self._anyway.set_visibility(due is not None and not over)
        self._anyway.set_enabled(ready)

    def _switch_words(self) -> str:
        """Return since when the stimulation is as it is; of a blinded plan, who enters it."""
        plan, due = self._plan, self._due
        if plan is None or due is None:
            return ""
        if plan.blinded:
            return (
                "Whoever sets the stimulator enters it before every session: rigidimeter study "
                f"stimulation {plan.folder}"
            )
        needed = f"This session needs the stimulation {due.stimulation}"
        if due.change is None:
            return f"{needed}; nobody entered today whether it is."
        since = due.change.changed_utc.astimezone()
        day = "" if since.date() == datetime.now(UTC).astimezone().date() else f"{since:%Y-%m-%d} "
        return f"{needed}; it is {due.change.stimulation} since {day}{since:%H:%M}."

    def _left_min(self) -> float | None:
        if self._due is None:
            return None
        return self._due.left_min(datetime.now(UTC), self._state.place.clock_speed)

    def _tick(self) -> None:
        if not self._state.busy:
            if self._stamp() != self._seen:
                self._load()
            self._show()

    def _settings(self) -> Settings | None:
        return self._begun.settings if self._begun is not None else None

    def _enter(self) -> None:
        """Write down that the stimulation was switched."""
        due, now = self._due, datetime.now(UTC)
        if due is None or not self._rig.may_act():
            return
        try:
            by = parse_line(self._fields["operator"].value or "", "operator", 40)
            change = parse_change(self._change.value or "", due.block.subject, now, by)
            add_change(self._state.place.root, change)
        except UserError as error:
            ui.notify(str(error))
            return
        self._change.value = ""
        self._load()

    def _ask_anyway(self) -> None:
        """Begin before the wait is over, with a reason."""
        try:
            reason = parse_line(self._reason.value or "", "reason")
        except UserError as error:
            ui.notify(str(error))
            return
        if not reason:
            ui.notify("to begin before the wait is over write the reason")
            return
        self._ask(reason)

    def _ask(self, reason: str) -> None:
        """Ask for the session; without a reason only after its wait."""
        if not self._rig.may_act():
            return
        shown = self._due
        self._load()  # another program may have recorded it meanwhile
        plan, due = self._plan, self._due
        if due is not None and (
            shown is None or (shown.block, shown.part) != (due.block, due.part)
        ):
            ui.notify("another session is due now; start again if it is the one that you want")
            return
        over = self._left_min() == 0.0
        if plan is None or due is None or self._problem.text or not (over or reason):
            return
        try:
            begun = begun_session(
                plan,
                due,
                datetime.now(UTC),
                operator=self._entered("operator", 40),
                note=self._entered("note", 200),
                speed=self._state.place.clock_speed,
                reason=reason,
            )
            about = dict(begun.about) | self._range(due.block.subject)
        except UserError as error:
            ui.notify(str(error))
            return
        if not about["operator"]:
            ui.notify("operator: must be given")
            return
        self._reason.value, self._named.value = "", _DUE
        self._state.ask(StartRequest(due.folder, begun.settings, about, source=begun.source))

    def _entered(self, key: str, longest: int) -> str:
        return parse_line(self._fields[key].value or "", key, longest)

    def _range(self, subject: str) -> dict[str, Any]:
        """Return the range of motion of the person; only hardware asks for it.

        Raises
        ------
        UserError
            If it is wrong.
        """
        form = {key: str(made.value or "") for key, made in self._fields.items()}
        if not any(form.get(one.key, "").strip() for one in RANGE):
            return {}
        errors: dict[str, str] = {}
        found = read_range(form["range_low"], form, subject, errors)
        if errors:
            raise UserError(*errors.values())
        return {"range": found}
