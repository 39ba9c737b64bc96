"""The part of the page that draws a plan of days, where the console's folder has none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from nicegui import ui

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_json
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import PrimaryTable, plan_rows, plan_words
from rigidimeter.planning import DrawnPlan, day_settings, days_of_design
from rigidimeter.rig.console.page.computed import computed
from rigidimeter.rig.console.page.form_values import parse_number
from rigidimeter.rig.console.page.jobs import Jobs
from rigidimeter.rig.console.page.plan_form import (
    EXAMPLES,
    GIVEN,
    IN_A_DAY,
    ORDERS,
    SESSION,
    WAITS,
    WAITS_AFTER_OFF,
    WHO,
    EnteredPlan,
    empty_plan_form,
    read_plan_form,
    wait_leaves,
)
from rigidimeter.rig.console.page.plan_table import plan_table
from rigidimeter.rig.console.page.prediction import detected, prediction_lines
from rigidimeter.rig.console.page.server_state import ServerState
from rigidimeter.rig.console.page.session_form import YES, Field

FOLLOW_S = 2.0
"""How often it is looked whether there is a plan."""


class DrawView:
    """The form of a plan, and the plan that it draws, before it is written.

    Parameters
    ----------
    state : ServerState
    jobs : Jobs
    in_control : callable
        Whether the page may act.
    written : callable
        Called once the plan is written.
    """

    def __init__(
        self,
        state: ServerState,
        jobs: Jobs,
        in_control: Callable[[], bool],
        written: Callable[[], object] = ui.navigate.reload,
    ) -> None:
        self._state, self._jobs, self._in_control = state, jobs, in_control
        self._written = written
        self._form = empty_plan_form()
        self._inputs: dict[str, Any] = {}
        self._drawn: DrawnPlan | None = None
        ui.label(
            "A plan says which condition is recorded on which day, in which order and after which "
            f"wait. Settings of its sessions: {state.place.settings_name}."
        )
        self._row(WHO)
        with ui.row().classes("w-full items-start"):
            order = ui.select(ORDERS, value=self._form["order"], label="Order in a day")
            order.classes("entry").mark("order")
            order.on_value_change(lambda event: self._change("order", event.value))
            self._inputs["order"] = order
            self._input(GIVEN)
            for one in IN_A_DAY:
                self._input(one)
        self._row(SESSION)
        with ui.row().classes("w-full items-center"):
            for one in WAITS:
                self._input(one)
            named = ui.toggle(WAITS_AFTER_OFF).props("dense no-caps").mark("named-wait")
            named.on_value_change(lambda event: self._choose_wait(event.value))
            self._named = named
        self._leaves = ui.label("").mark("leaves")
        blinded = ui.checkbox("Blinded: codes for conditions wherever an examiner may look")
        blinded.mark("blinded")
        blinded.on_value_change(lambda event: self._change("blinded", YES if event.value else ""))
        self._problem = ui.label("").classes("problem").mark("draw-problem").props('role="alert"')
        with ui.row():
            ui.button("Draw the plan", on_click=self._draw).mark("draw")
            ui.button("Days and PRBS epochs from Predict", on_click=self._predict).mark("predict")
        self._answer = ui.html("", sanitize=False).classes("answer")
        with ui.element("div").classes("w-full") as self._shown:
            self._summary = ui.label("").classes("text-lg").mark("summary").props('role="status"')
            self._table = ui.html("", sanitize=False).classes("plan")
            ui.button("Write this plan", on_click=self._write).mark("write")
        self._check()
        ui.timer(FOLLOW_S, self._follow)

    def _follow(self) -> None:
        """Go on to a plan that was written by another page or program."""
        if self._state.place.planned and not self._state.busy:
            self._written()

    def _row(self, fields: Sequence[Field]) -> None:
        with ui.row().classes("w-full items-start"):
            for one in fields:
                self._input(one)

    def _input(self, one: Field) -> None:
        label = f"{one.label} [{one.unit}]" if one.unit else one.label
        made = ui.input(label, value=self._form[one.key]).classes("entry")
        made.without_auto_validation()  # what is wrong is said by `_check`
        made.props(f"maxlength=200 data-field=plan_{one.key} debounce=150")
        if one.key in EXAMPLES:
            made.props["stack-label"], made.props["placeholder"] = True, EXAMPLES[one.key]
        made.on_value_change(lambda event, key=one.key: self._change(key, event.value))
        self._inputs[one.key] = made

    def _change(self, key: str, value: Any) -> None:
        self._form[key] = str(value or "")[:200]
        self._check()

    def _choose_wait(self, value: str | None) -> None:
        if value:
            self._inputs["wait_after_off"].value = value

    def _check(self) -> None:
        """Take back a plan that was drawn from other values; say what the wait leaves."""
        self._drawn = None
        self._shown.set_visibility(False)
        self._inputs["given"].set_visibility(self._form["order"] == "given")
        text = self._form["wait_after_off"].strip()
        self._named.value = text if text in WAITS_AFTER_OFF else None
        try:
            self._leaves.text = wait_leaves(parse_number(text, "wait"))
        except UserError:
            self._leaves.text = ""

    def _entered(self) -> EnteredPlan:
        """Read the form; say at each field what is wrong with it."""
        entered = read_plan_form(self._form, self._state.place.settings)
        errors = entered.errors
        for key, made in self._inputs.items():
            made.error = errors.get(key)
        general = [text for key, text in errors.items() if key not in self._inputs]
        count = "1 field needs" if len(errors) == 1 else f"{len(errors)} fields need"
        wrong = [f"{count} correction"] if len(errors) > len(general) else []
        self._problem.text = " ".join([*general, *wrong])
        return entered

    def _draw(self) -> None:
        """Draw the plan and show it; nothing is written."""
        if self._state.busy:  # it takes seconds, in which no page could stop the session
            ui.notify("not while a session runs")
            return
        self._drawn = self._entered().plan
        self._shown.set_visibility(self._drawn is not None)
        if self._drawn is None:
            return
        plan = self._drawn.shown(self._state.place.root)
        self._summary.text = f"{plan_words(plan)}. Nothing is written yet."
        several = len(plan.about.subjects) > 1
        self._table.set_content(
            "".join(
                plan_table(plan_rows(plan, one, ()), f"Subject {one}" if several else "")
                for one in plan.about.subjects
            )
        )
        if self._shown.client.has_socket_connection:
            shown = f"getHtmlElement({self._shown.id})"
            ui.run_javascript(f"{shown}.scrollIntoView({{block: 'nearest'}})")

    def _may_act(self) -> bool:
        if self._in_control() and not self._state.busy:
            return True
        ui.notify("not while a session runs, and only on the page in control")
        return False

    def _write(self) -> None:
        """Write the plan that is shown, and go on to the session that is due."""
        if self._drawn is None or not self._may_act():
            return
        try:
            self._drawn.write(self._state.place.root)
        except UserError as error:
            self._problem.text = str(error)
            return
        self._written()

    async def _predict(self) -> None:
        """Take the days and PRBS epochs that `design` asks for."""
        if not self._may_act():
            return
        entered = self._entered()
        if entered.values is None:
            return
        try:
            settings = day_settings(entered.values, self._state.place.settings)
        except UserError as error:
            self._problem.text = str(error)
            return
        needed: list[tuple[int, int]] = []

        def lines(folder: Path, settings: Settings) -> list[str]:
            path = folder / "design.json"
            if not path.is_file():
                return []
            needed.append(days_of_design(path))
            return prediction_lines(read_json(path), settings.margins)

        self._answer.set_content("<p>computing …</p>")
        options = (*detected(PrimaryTable()), "--json", "design.json")
        answer = await computed(self._jobs, settings, ("design",), options, lines)
        self._answer.set_content(answer)
        if needed:
            self._inputs["days"].value, self._inputs["prbs_epochs"].value = map(str, needed[0])
