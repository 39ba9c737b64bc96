"""The part of the page after a session: the sessions of the folder, their epochs, what to do."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nicegui import ui

from rigidimeter.console.page.button_words import in_buttons, unfinished_words
from rigidimeter.console.page.desk import Desk, StartRequest
from rigidimeter.console.page.entered import line
from rigidimeter.console.page.kept_study import extended
from rigidimeter.console.page.recorded_traces import epoch_traces
from rigidimeter.console.page.report_files import (
    OF_STUDY,
    PAGE,
    report_file,
    report_folder,
    report_link,
)
from rigidimeter.console.page.sessions_found import (
    FoundEpoch,
    FoundSession,
    exclude,
    found_sessions,
)
from rigidimeter.console.page.work import Work
from rigidimeter.errors import UserError


class AfterView:
    """The sessions as one page shows them.

    Parameters
    ----------
    desk : Desk
    work : Work
    in_control : callable
        Whether the page may act.
    notice : label
        Says elsewhere on the page which sessions are unfinished.
    """

    def __init__(
        self, desk: Desk, work: Work, in_control: Callable[[], bool], notice: ui.label
    ) -> None:
        self._desk, self._work, self._in_control = desk, work, in_control
        self._notice = notice
        self._root = desk.place.root
        self._chosen = ""
        self._shown = -1
        ui.label(f"Sessions in {self._root}").classes("text-lg")
        self._title = ui.input("Title of the report of the study", value=self._root.name)
        self._title.classes("entry").props("maxlength=120 data-field=title")
        self._title.set_visibility(not desk.place.one_session)
        self._list()
        self._dialogs = ui.element("div")  # not in the list, which is drawn anew meanwhile
        self._answer = ui.html("", sanitize=False).classes("answer")
        ui.element("div").props('id=epoch-panes aria-label="Epoch"')
        ui.timer(1.0, self._follow)

    def _follow(self) -> None:
        """Show the list anew when a session has ended."""
        finished = self._desk.finished
        if finished is not None and finished.number != self._shown and not self._desk.busy:
            self._shown, self._chosen = finished.number, finished.folder.name
            self._list.refresh()

    @ui.refreshable_method
    def _list(self) -> None:
        sessions, problems = found_sessions(self._root)
        self._notice.text = unfinished_words(sessions)
        for problem in problems:
            ui.label(in_buttons(problem)).classes("problem")
        if not sessions:
            ui.label("There is no session yet.")
        elif not self._desk.place.one_session:
            with ui.row().classes("items-center"):
                ui.button("Report of the study", on_click=self._study_report)
                self._link(OF_STUDY, "Open the report of the study")
        for session in sessions:
            self._session(session)

    def _session(self, session: FoundSession) -> None:
        how = session.outcome or session.reason
        with ui.expansion(
            f"{session.name}: {session.good} of {session.planned} epochs good, {how}",
            value=session.name == self._chosen,
        ).classes("w-full session"):
            if session.reason:
                ui.label(in_buttons(session.reason))
            with ui.row():
                if not session.outcome and not session.recording:
                    ui.button("Recover", on_click=lambda: self._recover(session.name))
                if session.left:
                    ui.button(
                        f"Run what is left: {len(session.left)}",
                        on_click=lambda: self._run(session.name, left=session.left),
                    )
                ui.button("Estimate", on_click=lambda: self._estimate(session))
                ui.button("Report", on_click=lambda: self._report(session))
                self._link(report_folder(session.name), "Open its report")
            for epoch in session.epochs:
                self._epoch(session, epoch)

    def _epoch(self, session: FoundSession, epoch: FoundEpoch) -> None:
        said = [f"epoch {epoch.label}", epoch.condition, epoch.task, epoch.outcome, epoch.reason]
        if epoch.rating:
            said.append(f"rated {epoch.rating}")
        if epoch.excluded:
            said.append(f"left out: {epoch.excluded}")
        with ui.row().classes("items-center w-full"):
            ui.label(" · ".join(filter(None, said))).classes("grow")
            ui.button("Show", on_click=lambda: self._show(session.name, epoch.label))
            if session.outcome:
                ui.button("Repeat", on_click=lambda: self._repeat(session.name, epoch))
            if not epoch.excluded:
                ui.button("Leave out", on_click=lambda: self._ask_reason(session.name, epoch.label))

    def _may_act(self) -> bool:
        if self._in_control() and not self._desk.busy:
            return True
        ui.notify("not while a session runs, and only on the page in control")
        return False

    def _link(self, folder: str, text: str) -> None:
        """Link to a report if it was made; a page of one session shows none of other folders."""
        if report_file(self._root, folder, PAGE) is not None:
            ui.link(text, report_link(folder), new_tab=True)

    def _repeat(self, session: str, epoch: FoundEpoch) -> None:
        if epoch.outcome == "success" and not epoch.excluded:
            ui.notify("both runs of this epoch count, until you leave one out")
        self._run(session, epoch.number)

    def _run(self, session: str, epoch: int | None = None, left: tuple[int, ...] = ()) -> None:
        """Run what is left of a session, or one epoch of it again, in a new folder."""
        if not self._may_act():
            return
        folder = f"{session.rpartition('-')[0] or session}-{time.strftime('%H%M%S')}"
        self._desk.ask(StartRequest(folder, resume=session, epoch=epoch, left=left))

    def _ask_reason(self, session: str, epoch: str) -> None:
        with self._dialogs, ui.dialog() as dialog, ui.card():
            ui.label(f"Leave epoch {epoch} of {session} out of results; nothing is deleted.")
            reason = ui.input("Reason").props("maxlength=200 data-field=reason")
            by = ui.input("Your name").props("maxlength=40 data-field=by")

            def leave_out() -> None:
                if not self._may_act():
                    return
                try:
                    exclude(self._root, session, epoch, reason.value, by.value)
                except UserError as error:
                    ui.notify(str(error))
                    return
                dialog.close()
                self._chosen = session
                self._list.refresh()

            ui.button("Leave out", on_click=leave_out)
        dialog.open()

    async def _recover(self, session: str) -> None:
        if not await self._command("recover", session):
            return
        for said in extended(self._desk.place):
            ui.notify(said)
        self._chosen = session
        self._list.refresh()

    async def _estimate(self, session: FoundSession) -> None:
        await self._command("estimate", session.name, *session.options)

    async def _report(self, session: FoundSession) -> None:
        out = self._root / report_folder(session.name)
        if await self._command("report", session.name, "--out", str(out), *session.options):
            self._chosen = session.name
            self._list.refresh()

    async def _study_report(self) -> None:
        """Report the study; of blinded sessions only after a warning, since it names conditions."""
        try:
            title = line(str(self._title.value or ""), "title", 120)
        except UserError as error:
            ui.notify(str(error))
            return
        named = (f"--title={title}",) if title else ()
        sessions, _ = found_sessions(self._root)
        blinded = [session.name for session in sessions if session.blinded]
        if blinded and not await self._unblinds(blinded):
            return
        if await self._command("report", "", "--out", str(self._root / OF_STUDY), *named):
            self._list.refresh()

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
        self._answer.set_content("<p>computing …</p>")
        answer = await self._work.command(command, str(self._root / session), *options)
        self._answer.set_content(answer.html())
        return True

    async def _show(self, session: str, epoch: str) -> None:
        """Draw an epoch: raw signals, and measured and modelled torque with their difference."""
        if self._desk.busy:
            ui.notify("not while a session runs")
            return
        self._answer.set_content("<p>reading …</p>")
        with tempfile.TemporaryDirectory(prefix="rigidimeter-epoch-") as name:
            fitted = Path(name) / "torque.csv"
            await self._work.command(
                "estimate", str(self._root / session), "--subject-torque", str(fitted)
            )
            try:
                panes: list[dict[str, Any]] = epoch_traces(self._root / session, epoch, fitted)
            except UserError as error:
                self._answer.set_content("")
                ui.notify(str(error))
                return
        self._answer.set_content("")
        title = json.dumps(f"{session}, epoch {epoch}")
        ui.run_javascript(f"rigEpoch({title}, {json.dumps(panes)})")
