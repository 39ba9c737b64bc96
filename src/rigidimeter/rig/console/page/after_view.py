"""The part of the page after a session: the sessions of the folder, their epochs, what to do.

What changes is changed in place, so that no click on a row is lost while a list is brought up to
date.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from nicegui import ui

from rigidimeter.core.errors import UserError
from rigidimeter.rig.console.page.button_words import in_buttons, unfinished_words
from rigidimeter.rig.console.page.form_values import parse_line
from rigidimeter.rig.console.page.jobs import Jobs
from rigidimeter.rig.console.page.question import Question, ask
from rigidimeter.rig.console.page.recorded_traces import epoch_panes
from rigidimeter.rig.console.page.server_state import ServerState, StartRequest
from rigidimeter.rig.console.page.session_row import Acts, SessionRow
from rigidimeter.rig.console.page.sessions_found import (
    OF_STUDY,
    PAGE,
    FoundEpoch,
    FoundSession,
    continued,
    exclude,
    extended,
    found_sessions,
    include,
    rate,
    rated_words,
    report_file,
    report_folder,
    report_link,
)

FOLLOW_S = 0.2
"""How often it is looked whether a session has ended."""


class AfterView:
    """The sessions as one page shows them.

    Parameters
    ----------
    state : ServerState
    jobs : Jobs
    in_control : callable
        Whether the page may act.
    notice : label
        Says elsewhere on the page which sessions are unfinished.
    """

    def __init__(
        self,
        state: ServerState,
        jobs: Jobs,
        in_control: Callable[[], bool],
        notice: ui.label,
    ) -> None:
        self._state, self._jobs, self._in_control = state, jobs, in_control
        self._notice = notice
        self._root = state.place.root
        self._shown = -1
        self._ran = False
        self._computing = False
        self._rows: dict[str, SessionRow] = {}
        self._acts = Acts(
            recover=self._recover,
            run_rest=self._run_rest,
            estimate=lambda one: self._command("estimate", one.name, *one.options),
            report=self._report,
            show=self._show,
            repeat=self._repeat,
            leave_out=self._leave_out,
            include=self._include,
            rate=self._rate,
        )
        several = not state.place.one_session
        ui.label(f"Sessions in {self._root}").classes("text-lg")
        self._title = ui.input("Title of the report of the study", value=self._root.name)
        self._title.classes("entry").props("maxlength=120 data-field=title")
        self._title.set_visibility(several)
        self._problems = ui.element("div")
        self._none = ui.label("There is no session yet.")
        with ui.row().classes("items-center") as self._study:
            if several:
                ui.button("Report of the study", on_click=self._study_report)
                text = "Open the report of the study"
                self._study_link = ui.link(text, report_link(OF_STUDY), new_tab=True)
        self._list = ui.element("div").classes("w-full")
        self._dialogs = ui.element("div")
        self._answer = ui.html("", sanitize=False).classes("answer")
        ui.element("div").props('id=epoch-panes aria-label="Epoch"')
        self._update()
        self._follow()
        ui.timer(FOLLOW_S, self._follow)

    def _follow(self) -> None:
        """Fold the list when a session begins; when it has ended, list it and unfold it."""
        began, self._ran = (self._state.in_session and not self._ran, self._state.in_session)
        if began:
            for row in self._rows.values():
                row.frame.close()
        finished = self._state.finished
        if finished is not None and finished.number != self._shown and not self._state.busy:
            self._shown = finished.number
            self._update()
            name = os.path.relpath(finished.folder, self._root)
            if name in self._rows:
                self._rows[name].frame.open()

    def _update(self) -> None:
        """Bring the list up to date; the rows that are in it stay, with what is unfolded."""
        sessions, problems = found_sessions(self._root)
        self._notice.text = unfinished_words(sessions)
        self._problems.clear()
        with self._problems:
            for problem in problems:
                ui.label(in_buttons(problem)).classes("problem")
        self._none.set_visibility(not sessions)
        self._study.set_visibility(bool(sessions))
        if not self._state.place.one_session:
            self._study_link.set_visibility(self._reported(OF_STUDY))
        for gone in self._rows.keys() - {session.name for session in sessions}:
            self._rows.pop(gone).frame.delete()
        for at, session in enumerate(sessions):
            if session.name not in self._rows:
                with self._list:
                    self._rows[session.name] = SessionRow(self._acts, session)
            row = self._rows[session.name]
            row.show(
                session,
                reported=self._reported(report_folder(session.name)),
                rated=rated_words(self._root, session),
            )
            if self._list.default_slot.children[at] is not row.frame:
                row.frame.move(self._list, at)

    def _reported(self, folder: str) -> bool:
        """Whether a report was made; a page of one session links to none of other folders."""
        return report_file(self._root, folder, PAGE) is not None

    def _may_act(self) -> bool:
        self._follow()  # what is left of a session is what is left now
        if self._in_control() and not self._state.busy:
            return True
        ui.notify("not while a session runs, and only on the page in control")
        return False

    def _repeat(self, session: FoundSession, epoch: FoundEpoch) -> None:
        """Run an epoch once more, in a new folder."""
        if not self._may_act():
            return
        if epoch.outcome == "success" and not epoch.excluded:
            ui.notify("both runs of this epoch count, until you leave one out")
        self._run(session.name, epoch=epoch.number)

    def _run_rest(self, session: FoundSession) -> None:
        """Run what is left of a session, in a new folder."""
        if self._may_act() and (left := self._rows[session.name].session.left):
            self._run(session.name, left=left)

    def _run(self, session: str, **what: Any) -> None:
        """Continue a session; one of a plan, if it has to wait again, after asking for a reason."""
        try:
            rest = continued(self._root, session)
        except UserError as error:
            ui.notify(str(error))
            return
        stem = session.rpartition("-")[0] or session  # the name ends with the time
        folder = rest.due.folder if rest else f"{stem}-{time.strftime('%H%M%S')}"

        def run(reason: str = "") -> None:
            self._state.ask(StartRequest(folder, resume=session, begin_anyway=reason, **what))

        if rest and (words := rest.words(datetime.now(UTC))):
            self._ask_anyway(words, run)
        else:
            run()

    def _ask_anyway(self, words: str, run: Callable[[str], None]) -> None:
        """Ask why a session is continued before its wait is over."""

        def anyway(text: str) -> None:
            reason = parse_line(text, "reason")
            if not reason:
                raise UserError("to begin before the wait is over write the reason")
            run(reason)

        field = "continue_anyway", "Reason to begin before the wait is over", 200
        ask(self._dialogs, Question(words, [field], "Begin anyway"), self._may_act, anyway)

    def _leave_out(self, session: FoundSession, epoch: FoundEpoch) -> None:
        """Leave an epoch out, after asking for a reason and a name."""
        words = f"Leave epoch {epoch.label} of {session.name} out of results; nothing is deleted."
        self._ask_reason(words, "Leave out", exclude, session, epoch)

    def _include(self, session: FoundSession, epoch: FoundEpoch) -> None:
        """Include an epoch again that was left out, after asking for a reason and a name."""
        words = (
            f"Include epoch {epoch.label} of {session.name} again. It was left out: "
            f"{epoch.excluded}. The study keeps a record of both."
        )
        self._ask_reason(words, "Include again", include, session, epoch)

    def _rate(self, session: FoundSession) -> None:
        """Rate a session of a plan, by one of its raters."""
        with self._dialogs, ui.dialog() as dialog, ui.card():
            ui.label(f"Rating of {session.name}.")
            by = ui.select(list(session.raters), label="Examiner", value=session.raters[0])
            by.classes("entry").mark("rater")
            score = ui.input("Score").props("maxlength=8 data-field=rating")

            def confirm() -> None:
                if not self._may_act():
                    return
                try:
                    warning = rate(self._state.place, session.name, by.value, score.value or "")
                except UserError as error:
                    ui.notify(str(error))
                    return
                if warning:
                    ui.notify(warning)
                dialog.close()
                self._update()

            with ui.row():
                ui.button("Cancel", on_click=dialog.close)
                ui.button("Save", on_click=confirm)
        dialog.open()

    def _ask_reason(
        self,
        words: str,
        button: str,
        act: Callable[[Path, str, str, str, str], None],
        session: FoundSession,
        epoch: FoundEpoch,
    ) -> None:
        def confirm(reason: str, by: str) -> None:
            act(self._root, session.name, epoch.label, reason, by)
            self._update()

        fields = ("reason", "Reason", 200), ("by", "Your name", 40)
        ask(self._dialogs, Question(words, fields, button), self._may_act, confirm)

    async def _recover(self, session: FoundSession) -> None:
        """Close the record of an interrupted session."""
        if not await self._command("recover", session.name):
            return
        for text in extended(self._state.place):
            ui.notify(text)
        self._update()

    async def _report(self, session: FoundSession) -> None:
        """Make the report of a session."""
        out = self._root / report_folder(session.name)
        if await self._command("report", session.name, "--out", str(out), *session.options):
            self._update()

    async def _study_report(self) -> None:
        """Report the study; of blinded sessions only after a warning, since it names conditions."""
        try:
            title = parse_line(str(self._title.value or ""), "title", 120)
        except UserError as error:
            ui.notify(str(error))
            return
        named = (f"--title={title}",) if title else ()
        sessions, _ = found_sessions(self._root)
        blinded = [session.name for session in sessions if session.blinded]
        if blinded and not await self._unblinds(blinded):
            return
        if await self._command("report", "", "--out", str(self._root / OF_STUDY), *named):
            self._update()

    async def _unblinds(self, sessions: list[str]) -> bool:
        """Warn that the report of the study names the conditions of blinded sessions."""
        with self._dialogs, ui.dialog() as dialog, ui.card():
            ui.label(
                f"This unblinds you: the report of the study names the conditions of "
                f"{', '.join(sessions)}. Reports of single sessions show their codes."
            )
            with ui.row():
                ui.button("Cancel", on_click=lambda: dialog.submit(False))
                ui.button("Unblind and report", on_click=lambda: dialog.submit(True))
        return bool(await dialog)

    async def _command(self, command: str, session: str, *options: str) -> bool:
        """Show what a command says of a session, or of the study; return whether it was run."""
        if not self._may_act():
            return False
        if self._computing:  # by the first click of a double one, or by another button
            ui.notify("the command before is still computing")
            return False
        self._computing = True
        self._answer.set_content("<p>computing …</p>")
        try:
            answer = await self._jobs.command(command, str(self._root / session), *options)
        finally:
            self._computing = False
        self._answer.set_content(answer.html())
        return True

    async def _show(self, session: FoundSession, epoch: FoundEpoch) -> None:
        """Draw an epoch: raw signals, and measured and modelled torque with their difference."""
        if self._state.busy:
            ui.notify("not while a session runs")
            return
        folder = self._root / session.name
        self._answer.set_content("<p>reading …</p>")
        with tempfile.TemporaryDirectory(prefix="rigidimeter-epoch-") as name:
            fitted = Path(name) / "torque.csv"
            await self._jobs.command("estimate", str(folder), "--subject-torque", str(fitted))
            try:
                panes: list[dict[str, Any]] = epoch_panes(folder, epoch.label, fitted)
            except UserError as error:
                self._answer.set_content("")
                ui.notify(str(error))
                return
        self._answer.set_content("")
        title = json.dumps(f"{session.name}, epoch {epoch.label}")
        ui.run_javascript(f"rigEpoch({title}, {json.dumps(panes)})")
