"""A question on the page: some words, fields to fill in, and a button that does what was asked."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from nicegui import ui

from rigidimeter.core.errors import UserError


@dataclass(frozen=True)
class Question:
    """What is asked: `fields` are key, label and most characters of each."""

    words: str
    fields: Sequence[tuple[str, str, int]]
    button: str


def ask(
    parent: ui.element,
    question: Question,
    may_act: Callable[[], bool],
    act: Callable[..., None],
) -> None:
    """Open a dialog with the question; what `act` refuses is said, and the dialog stays open.

    Parameters
    ----------
    parent : ui.element
    question : Question
    may_act : callable
        Whether the page may act now.
    act : callable
        Takes the text of each field.
    """
    with parent, ui.dialog() as dialog, ui.card():
        ui.label(question.words)
        made = [
            ui.input(label).props(f"maxlength={longest} data-field={key}")
            for key, label, longest in question.fields
        ]

        def confirm() -> None:
            if not may_act():
                return
            try:
                act(*(str(one.value or "") for one in made))
            except UserError as error:
                ui.notify(str(error))
                return
            dialog.close()

        with ui.row():
            ui.button("Cancel", on_click=dialog.close)
            ui.button(question.button, on_click=confirm).mark("confirm")
    dialog.open()
