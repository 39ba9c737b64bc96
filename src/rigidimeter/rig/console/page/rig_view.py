"""The steps before a subject is on the rig, as rows; the checks among them run from the page."""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from nicegui import ui

from rigidimeter.core.files import toml_text
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.rig.console.page.jobs import CommandResult, Jobs
from rigidimeter.rig.console.page.rig_steps import LEVELS, SIGNS, RigStep
from rigidimeter.rig.console.page.server_state import ServerState

BUTTONS = {"check": "Check the rig", "zero": "Read zero and noise"}
CHECKING = {"check": "checking the rig", "zero": "reading zero and noise of the sensor"}


class RigView:
    """The rows, and below them what a check asks and says.

    Parameters
    ----------
    state : ServerState
    jobs : Jobs
    in_control : callable
        Whether the page has control; a check is stopped when it has lost it.
    settings : callable
        What was entered; None if something is wrong with it.
    checked : callable
        Called after each check, to show the steps anew.
    """

    def __init__(
        self,
        state: ServerState,
        jobs: Jobs,
        in_control: Callable[[], bool],
        settings: Callable[[], Settings | None],
        checked: Callable[[], None],
    ) -> None:
        self._state, self._jobs = state, jobs
        self._in_control, self._settings = in_control, settings
        self._checked = checked
        self._steps: tuple[RigStep, ...] = ()
        self._rows()
        self._question = ui.element("div").props('role="alertdialog" aria-label="Question"')
        self._question.classes("question").set_visibility(False)
        self._stop = ui.button("Stop the check", on_click=state.stop_check).mark("stop-check")
        self._stop.set_visibility(False)
        self._output = ui.html("", sanitize=False).classes("answer")

    def show(self, steps: tuple[RigStep, ...]) -> None:
        """Show these steps."""
        steps = tuple(self._with_reading(step) for step in steps)
        if steps != self._steps:
            self._steps = steps
            self._rows.refresh()

    def may_act(self) -> bool:
        """Whether the page may begin something now; it shows why not."""
        if not self._in_control():
            ui.notify("this page watches: another one has control")
        elif self._state.busy:
            ui.notify("not while a session runs or the rig is checked")
        else:
            return True
        return False

    def _with_reading(self, step: RigStep) -> RigStep:
        """Return the step of the zero with what was read last."""
        read = self._jobs.zero_read
        if step.action != "zero" or read is None:
            return step
        return replace(step, state="done" if read.good else "not done", found=read.text)

    @ui.refreshable_method
    def _rows(self) -> None:
        with ui.element("div").classes("steps").props('role="list"'):
            for step in self._steps:
                self._row(step)

    def _row(self, step: RigStep) -> None:
        with ui.element("div").classes(f"step {LEVELS[step.state]}").props('role="listitem"'):
            ui.html(f"<b>{SIGNS[step.state]}</b> {step.state}", sanitize=False).classes("state")
            with ui.element("div").classes("words"):
                ui.label(step.title).classes("title")
                for text in filter(None, (step.found, step.remedy)):
                    ui.label(text)
            if step.action:
                ui.button(BUTTONS[step.action], on_click=lambda: self._run(step.action))

    async def _run(self, action: str) -> None:
        """Run a check with the settings that were entered."""
        settings = self._settings()
        if not self.may_act():
            return
        if settings is None:
            ui.notify("first put right what is wrong in the form")
            return
        if not self._state.begin_check(CHECKING[action]):
            return
        self._stop.set_visibility(True)
        self._output.set_content(f"<p>{CHECKING[action]} …</p>")
        try:
            with tempfile.TemporaryDirectory(prefix="rigidimeter-check-") as name:
                path = Path(name) / "protocol.toml"
                path.write_text(toml_text(dump_settings(settings)), encoding="utf-8")
                rig = () if self._state.place.rig is None else (str(self._state.place.rig),)
                answer = await self._jobs.conversation(
                    "check", *rig, "--settings", str(path), "--piped",
                    *(("--zero",) if action == "zero" else ()),
                    on_output=self._say,
                    on_question=self._ask,
                    going_on=self._going_on,
                )  # fmt: skip
        finally:
            self._state.end_check()
            self._stop.set_visibility(False)
            self._question.set_visibility(False)
        if action == "zero":
            at = time.strftime("%Y-%m-%d %H:%M")
            self._jobs.zero_read = CommandResult(answer.good, f"{at}: {answer.last_lines}")
            self._output.set_content("")
        else:
            self._output.set_content(answer.html())
        self._checked()

    def _say(self, text: str) -> None:
        self._output.set_content(CommandResult(True, text).html())

    def _going_on(self) -> bool:
        lost = self._state.presence.lost(time.monotonic_ns())
        return self._in_control() and not lost and not self._state.check_stopped

    async def _ask(self, question: str) -> bool:
        """Put a question on the page, beside nothing that could hide the emergency stop."""
        answered: asyncio.Future[bool] = asyncio.get_running_loop().create_future()

        def answer(consent: bool) -> None:
            if not answered.done():
                answered.set_result(consent)

        self._question.clear()
        with self._question:
            ui.label(question).classes("text-lg")
            with ui.row():
                ui.button("Yes, go on", on_click=lambda: answer(True))
                no = ui.button("No", on_click=lambda: answer(False))
        self._question.set_visibility(True)
        # A key that was pressed for something else must not consent.
        no.client.run_javascript(f"requestAnimationFrame(() => getHtmlElement({no.id}).focus())")
        try:
            return await answered
        finally:
            self._question.set_visibility(False)
