"""The part of the page after a session: what the folder of sessions holds."""

from __future__ import annotations

from nicegui import ui

from rigidimeter.console.page.desk import Desk


class AfterView:
    """How the last session ended.

    Parameters
    ----------
    desk : Desk
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        ui.label(f"Sessions are in {desk.place.root}").classes("text-lg")
        ui.timer(1.0, self._show)
        self._last = ui.label("")
        self._next = ui.label("")

    def _show(self) -> None:
        finished = self._desk.finished
        if finished is None:
            return
        self._last.text = " ".join(finished.sentences)
        self._next.text = (
            f"rigidimeter report {finished.folder} --out report: the report; "
            f"rigidimeter run --resume {finished.folder} --out NEW: the epochs that are left"
        )
