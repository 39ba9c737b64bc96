"""The part of the page before a session: the form, what is predicted, and the start."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from nicegui import ui

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_json, read_toml, write_json
from rigidimeter.core.session import count_epochs, in_codes
from rigidimeter.core.settings import Settings, load_settings
from rigidimeter.core.study_files import STUDY_FILE, PrimaryTable
from rigidimeter.rig.console.page.computed import computed
from rigidimeter.rig.console.page.jobs import Jobs
from rigidimeter.rig.console.page.outside_plan import outside_form, read_coded_form
from rigidimeter.rig.console.page.prediction import detected, dry_run_lines, prediction_lines
from rigidimeter.rig.console.page.primary_view import PrimaryView
from rigidimeter.rig.console.page.rig_steps import start_refusal
from rigidimeter.rig.console.page.rig_view import RigView
from rigidimeter.rig.console.page.server_state import ServerState, StartRequest
from rigidimeter.rig.console.page.session_form import (
    BLINDED,
    DAY,
    MAX_BLOCKS,
    METADATA,
    NOTE,
    PRIMARY,
    RANGE,
    SETTINGS,
    STIMULATION,
    YES,
    EnteredSession,
    Field,
    block_form,
    blocks_of,
    empty_form,
    restored_form,
)

DRAFT = "draft.json"

MAX_FILES = 100
OF_A_RIG = ("torque_sensor", "drive")
"""Tables that a rig file has, and no protocol."""


class BeforeView:
    """The form of one page.

    Parameters
    ----------
    state : ServerState
    jobs : Jobs
    in_control : callable
        Whether the page may act.
    codes : mapping of str to str, optional
        Beside a plan: what stands for each condition, empty where nobody is blinded.
    """

    def __init__(
        self,
        state: ServerState,
        jobs: Jobs,
        in_control: Callable[[], bool],
        codes: Mapping[str, str] | None = None,
    ) -> None:
        self._state, self._jobs, self._in_control = state, jobs, in_control
        self._base, self._codes = state.place.settings, codes or {}
        self._form = restored_form(_stored(state.place.root / DRAFT), self._base)
        if codes is not None:
            self._form = outside_form(self._form, codes)
        self._inputs: dict[str, Any] = {}
        self._entered: EnteredSession | None = None
        place = state.place
        rig = "the virtual rig" if place.rig is None else place.rig.name
        with ui.row().classes("w-full items-center"):
            ui.label(f"Rig: {rig}. Protocol: {place.settings_name}.").classes("text-lg").mark(
                "what"
            )
            names = [] if place.one_session else protocol_names(place.protocols)
            if names:
                chosen = ui.select(names, label=f"Another protocol of {place.protocols}")
                chosen.classes("entry").mark("protocol")
                chosen.on_value_change(lambda event: self._choose(str(event.value or "")))
        self._wrong_file = ui.label("").classes("problem").props('role="alert"')
        self._not_stored = ui.label("").classes("problem").props('role="alert"')
        self._rig = RigView(state, jobs, in_control, self._settings, self._show_steps)
        self._row(*METADATA, NOTE, *([DAY] if DAY.key in self._form else []))
        self._row(*RANGE)
        self._blocks()
        with ui.row().classes("w-full items-start"):
            rests = "Rest between epochs (drawn if several: 10; 20)"
            self._input(Field("rests", rests, "s"))
            blinded = ui.checkbox("Blinded: show codes for conditions").mark("blinded")
            blinded.value = self._form[BLINDED] == YES
            blinded.set_visibility(not self._codes)
            blinded.on_value_change(lambda event: self._change(BLINDED, YES if event.value else ""))
            self._primary = PrimaryView(state.place, self._form[PRIMARY], self._change)
        with ui.expansion("Perturbation, controller and limits").classes("w-full").props("dense"):
            self._row(*SETTINGS)
            ui.button("Back to the protocol's values", on_click=self._reset)
        stimulation = ui.expansion("Stimulation (leave empty if there is none)")
        stimulation.set_visibility(not self._codes)
        with stimulation.classes("w-full").props("dense"):
            self._row(*STIMULATION)
        self._problem = ui.label("").classes("problem").props('role="alert"')
        self._refused = ui.label("").classes("problem").mark("refused").props('role="alert"')
        with ui.row():
            start = "Start session" if codes is None else "Start outside the plan"
            self._start = ui.button(start, on_click=self._ask).mark("start")
            self._start.props("size=lg")
            if not self._codes:  # the numbers of a condition would say which one it is
                ui.button("Predict precision, margin, days needed", on_click=self._predict)
                ui.button("Dry run on the virtual rig", on_click=self._dry_run)
            tested = ui.button("Test the tones").mark("tones")
            tested.on("click", js_handler="() => window.rigTones.test()")
            tested.tooltip("Two short low tones, a caution, then a long high one, a stop")
        self._answer = ui.html("", sanitize=False).classes("answer").props("data-name=computed")
        self._check()
        ui.timer(5.0, self._show_steps)

    def _choose(self, name: str) -> None:
        """Begin the form anew with another protocol; of a wrong one the page says what is wrong."""
        place = self._state.place
        if not name or not self._rig.may_act():
            return
        try:
            settings = read_protocol(place.protocols, name)
        except UserError as error:
            wrong = in_codes(str(error), self._codes)
            self._wrong_file.text = f"{wrong}. The form is still that of {place.settings_name}."
            return
        path = place.protocols / name
        self._state.place = replace(
            place, settings=settings, settings_name=name, settings_path=path
        )
        self._store(restored_form(self._form, settings))
        ui.navigate.reload()

    def _row(self, *fields: Field) -> None:
        with ui.row().classes("w-full"):
            for one in fields:
                self._input(one)

    def _input(self, one: Field) -> None:
        label = f"{one.label} [{one.unit}]" if one.unit else one.label
        made = ui.input(label, value=self._form.get(one.key, ""))
        made.classes("entry short" if one.key.startswith("epochs") else "entry")
        made.without_auto_validation()  # what is wrong is said by `_check`
        made.props(f"maxlength=400 data-field={one.key} debounce=150")
        made.on_value_change(lambda event, key=one.key: self._change(key, event.value))
        self._inputs[one.key] = made

    @ui.refreshable_method
    def _blocks(self) -> None:
        blocks = blocks_of(self._form)
        for k in blocks:
            with ui.row().classes("w-full items-center"):
                ui.label(f"Block {k + 1}").classes("text-base")
                task = ui.select(
                    {"prbs": "PRBS: J, B, K", "sinusoid": "sinusoid: work, impulse"},
                    value=self._form[f"task{k}"]
                    if self._form[f"task{k}"] == "sinusoid"
                    else "prbs",
                    label="Task",
                ).classes("entry")
                task.on_value_change(lambda event, k=k: self._change(f"task{k}", event.value))
                self._input(Field(f"condition{k}", "Condition, or its code"))
                self._input(Field(f"epochs{k}", "Epochs"))
        with ui.row():
            if len(blocks) < MAX_BLOCKS:
                ui.button("Add a block", on_click=self._add)
            if len(blocks) > 1:
                ui.button("Remove the last block", on_click=self._remove)

    def _add(self) -> None:
        k = len(blocks_of(self._form))
        last = {part: self._form[f"{part}{k - 1}"] for part in ("task", "condition", "epochs")}
        self._form |= block_form(k, **last)
        self._redraw()

    def _remove(self) -> None:
        k = len(blocks_of(self._form)) - 1
        for key in block_form(k, "", "", ""):
            del self._form[key]
            self._inputs.pop(key, None)
        self._redraw()

    def _reset(self) -> None:
        fresh = empty_form(self._base)
        for one in SETTINGS:
            self._inputs[one.key].value = fresh[one.key]

    def _redraw(self) -> None:
        self._blocks.refresh()
        self._check()

    def _change(self, key: str, value: Any) -> None:
        self._form[key] = str(value or "")[:400]
        self._check()
        if self._in_control():
            self._store(self._form)

    def _store(self, form: Mapping[str, str]) -> None:
        """Keep the form for a reload; say why where that is not possible."""
        try:
            write_json(self._state.place.root / DRAFT, form)
            self._not_stored.text = ""
        except UserError as error:
            self._not_stored.text = f"A reload would empty this form: {error}"

    def _check(self) -> None:
        """Say under each field what is wrong with it."""
        self._entered = read_coded_form(self._form, self._base, self._codes)
        errors = self._entered.errors
        for key, made in self._inputs.items():
            made.error = errors.get(key)
        general = [text for key, text in errors.items() if key not in self._inputs]
        count = "1 field needs" if len(errors) == 1 else f"{len(errors)} fields need"
        wrong = f"{count} correction" if errors else ""
        self._problem.text = " ".join([*general, wrong]) if general or wrong else ""
        self._show_steps()

    def _show_steps(self) -> None:
        """Show the steps for what was entered, and why a session cannot start."""
        if self._state.busy or self._entered is None:
            return
        steps = self._jobs.rig_steps(
            self._entered.settings or self._base, self._state.place.settings_path
        )
        self._rig.show(steps)
        why = start_refusal(steps)
        self._refused.text = f"No session can start: {why}." if why else ""
        self._start.set_enabled(not self._entered.errors and not why)

    def _settings(self) -> Settings | None:
        return self._entered.settings if self._entered is not None else None

    def _ask(self) -> None:
        entered = self._entered
        if not self._rig.may_act() or entered is None or entered.settings is None:
            return
        folder = f"{entered.subject}-{time.strftime('%Y%m%d-%H%M%S')}"
        request = StartRequest(
            self._state.place.one_session or folder, entered.settings, entered.about
        )
        try:
            self._primary.declare(entered.primary)
        except UserError as error:
            self._refused.text = f"No session can start: {error}."
            return
        self._state.ask(request)

    async def _predict(self) -> None:
        """Say what the session would tell, and what to change."""

        def lines(folder: Path, settings: Settings) -> list[str]:
            document = folder / "design.json"
            if not document.is_file():
                return []
            return prediction_lines(read_json(document), settings.margins)

        entered = self._entered.primary if self._entered is not None else None
        options = detected(self._primary.declared or entered or PrimaryTable())
        await self._compute(("design",), (*options, "--json", "design.json"), lines)

    async def _dry_run(self) -> None:
        """Run the protocol on a simulated clock; the folder is deleted."""

        def lines(folder: Path, _: Settings) -> list[str]:
            return dry_run_lines(*count_epochs(folder / "dry-run"))

        await self._compute(("simulate",), ("--out", "dry-run"), lines)

    async def _compute(
        self,
        command: tuple[str, ...],
        options: tuple[str, ...],
        lines: Callable[[Path, Settings], list[str]],
    ) -> None:
        """Show what a command says of the settings that were entered, first in sentences."""
        if not self._rig.may_act():
            return
        settings = self._settings()
        if settings is None:
            ui.notify("first put right what is wrong in the form")
            return
        self._answer.set_content("<p>computing …</p>")
        self._answer.set_content(await computed(self._jobs, settings, command, options, lines))


def _stored(path: Path) -> Any:
    """Return a form that was kept; None if there is none that can be read."""
    try:
        return read_json(path) if path.is_file() else None
    except UserError:
        return None


def protocol_names(folder: Path) -> list[str]:
    """Return the names of the TOML files of a folder that can be protocols, or are damaged."""
    here = folder.resolve()
    found = sorted(path for path in folder.glob("*.toml") if path.resolve().parent == here)
    return [path.name for path in found[:MAX_FILES] if path.is_file() and _may_be_one(path)]


def read_protocol(folder: Path, name: str) -> Settings:
    """Return the settings of a protocol file of the folder.

    Raises
    ------
    UserError
        If it is none of them, or wrong.
    """
    names = protocol_names(folder)
    if name not in names:
        known = ", ".join(names) or "none"
        raise UserError(f"{name[:100]}: is no protocol file of {folder}; there are: {known}")
    return load_settings(folder / name)


def _may_be_one(path: Path) -> bool:
    if path.name == STUDY_FILE:
        return False
    try:
        return not any(table in read_toml(path) for table in OF_A_RIG)
    except UserError:
        return True
