"""The primary measures in the form before a session: declared, or to be declared as it starts."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files import (
    PrimaryTable,
    declare_primary,
    declared_primary,
    primary_words,
)
from rigidimeter.rig.console.page.server_state import Place
from rigidimeter.rig.console.page.session_form import PRIMARIES, PRIMARY


class PrimaryView:
    """What the study of the console's folder declares, or a choice if it declares nothing.

    A page for one session has no study, so its choice is planned with and not declared.

    Parameters
    ----------
    place : Place
    value : str
        What the form has.
    change : callable
        Takes the key and the new value.

    Attributes
    ----------
    declared : PrimaryTable or None
        What the study declares.
    """

    def __init__(self, place: Place, value: str, change: Callable[[str, str], None]) -> None:
        self._place = place
        self.declared: PrimaryTable | None = None
        if not place.one_session:
            try:
                self.declared = declared_primary(place.root)
            except UserError as error:
                ui.label(str(error)).classes("problem").props('role="alert"')
                return
        if self.declared is not None:
            words, day = primary_words(self.declared), self.declared.declared
            ui.label(f"Primary measures: {words}, declared {day}").mark("primary")
            return
        usual = {"": f"default: {primary_words(PrimaryTable())}"}
        measures = ui.select(
            usual | {one: one for one in PRIMARIES},
            label="Primary measures of the study",
            value=value if value in PRIMARIES else "",
        )
        measures.classes("entry").mark("primary")
        measures.on_value_change(lambda event: change(PRIMARY, event.value))

    def declare(self, chosen: PrimaryTable | None) -> None:
        """Write what was chosen into `study.toml`, before the session has data.

        Raises
        ------
        UserError
            If it cannot be written.
        """
        if chosen is None or self.declared is not None or self._place.one_session:
            return
        declare_primary(self._place.root, chosen, list(self._place.settings.subject))
