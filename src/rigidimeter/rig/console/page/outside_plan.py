"""A session outside of the plan, on the page of a study that has one.

It is recorded without a place in the plan, so that the deviations list it, and with the day of the
study that it belongs to. Where examiners are blinded its form takes the codes of the plan in place
of conditions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from nicegui import ui

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import in_codes
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import read_plan
from rigidimeter.rig.console.page.jobs import Jobs
from rigidimeter.rig.console.page.server_state import ServerState
from rigidimeter.rig.console.page.session_form import (
    DAY,
    STIMULATION,
    EnteredSession,
    blocks_of,
    read_form,
)


def outside_form(form: Mapping[str, str], codes: Mapping[str, str]) -> dict[str, str]:
    """Return a form that asks for the day, and whose conditions are codes if there are any.

    Any other condition is emptied: a code in its place would say what the code stands for.
    """
    keys = [f"condition{k}" for k in blocks_of(form)] if codes else []
    kept = {key: form[key] if form[key] in codes.values() else "" for key in keys}
    return {**form, **kept, DAY.key: ""}


def read_coded_form(
    form: Mapping[str, str], base: Settings, codes: Mapping[str, str]
) -> EnteredSession:
    """Return what a form with the codes of a plan says; without codes as `read_form`."""
    if not codes:
        return read_form(form, base)
    names = {code: name for name, code in codes.items()}
    # Whoever sets the stimulator is not at the page.
    wrong, plain = {}, dict(form) | dict.fromkeys((one.key for one in STIMULATION), "")
    for key in (f"condition{k}" for k in blocks_of(form)):
        code = form[key].strip()
        plain[key] = names.get(code, next(iter(codes)))
        if code not in names:
            wrong[key] = f"condition: write a code of the plan: {', '.join(sorted(names))}"
    found = read_form(plain, base)
    errors = {key: in_codes(text, codes) for key, text in found.errors.items()} | wrong
    about = {**found.about, "blinded": True, "codes": dict(codes)}
    return replace(found, about=about, errors=errors, settings=None if errors else found.settings)


class OutsideView:
    """The form of a session outside of the plan, which is built when it is unfolded.

    Parameters
    ----------
    state : ServerState
    jobs : Jobs
    in_control : callable
        Whether the page may act.
    form : callable
        Builds the form; takes the same, then the codes of the plan.
    """

    def __init__(
        self,
        state: ServerState,
        jobs: Jobs,
        in_control: Callable[[], bool],
        form: Callable[..., object],
    ) -> None:
        self._state, self._built = state, False
        self._form = partial(form, state, jobs, in_control)
        self._frame = ui.expansion("A session outside the plan").classes("w-full").props("dense")
        self._frame.mark("outside").on_value_change(lambda event: self._build(bool(event.value)))

    def _build(self, opened: bool) -> None:
        if not opened or self._built:
            return
        self._built = True
        with self._frame:
            try:
                plan = read_plan(self._state.place.root)
            except UserError as error:
                ui.label(str(error)).classes("problem")
                return
            ui.label(
                "It has no place in the plan and no wait, and is listed among the sessions that "
                "were not as planned."
            )
            codes = plan.about.codes if plan is not None else {}
            self._form(codes)
