"""The row of a session under After: its words, its buttons and its epochs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from nicegui import ui

from rigidimeter.rig.console.page.button_words import in_buttons
from rigidimeter.rig.console.page.sessions_found import (
    FoundEpoch,
    FoundSession,
    report_folder,
    report_link,
)


@dataclass(frozen=True)
class Acts:
    """What the buttons of a row do, with the session as it was last found."""

    recover: Callable[[FoundSession], Any]
    run_rest: Callable[[FoundSession], Any]
    estimate: Callable[[FoundSession], Any]
    report: Callable[[FoundSession], Any]
    show: Callable[[FoundSession, FoundEpoch], Any]
    repeat: Callable[[FoundSession, FoundEpoch], Any]
    leave_out: Callable[[FoundSession, FoundEpoch], Any]
    include: Callable[[FoundSession, FoundEpoch], Any]
    rate: Callable[[FoundSession], Any]


class SessionRow:
    """The row of a session, made in the present container.

    Parameters
    ----------
    acts : Acts
    session : FoundSession

    Attributes
    ----------
    session : FoundSession
        As it was last found.
    frame : expansion
        What is unfolded.
    """

    def __init__(self, acts: Acts, session: FoundSession) -> None:
        self._acts, self.session = acts, session
        self._epochs: dict[str, _EpochRow] = {}
        self.frame = ui.expansion().classes("w-full session")
        with self.frame:
            self._reason = ui.label()
            self._rated = ui.label()
            with ui.row():
                self._recover = self._button("Recover", acts.recover)
                self._rest = self._button("", acts.run_rest)
                self._button("Estimate", acts.estimate)
                self._button("Report", acts.report)
                self._rate = self._button("Rate", acts.rate)
                target = report_link(report_folder(session.name))
                self._link = ui.link("Open its report", target, new_tab=True)

    def _button(self, words: str, act: Callable[[FoundSession], Any]) -> ui.button:
        return ui.button(words, on_click=lambda: act(self.session))

    def show(self, session: FoundSession, *, reported: bool, rated: str = "") -> None:
        """Show what is known of the session now."""
        self.session = session
        how = session.outcome or session.reason
        self.frame.text = f"{session.name}: {session.good} of {session.planned} epochs good, {how}"
        _show(self._reason, in_buttons(session.reason))
        self._recover.set_visibility(not session.outcome and not session.recording)
        _show(self._rest, f"Run what is left: {len(session.left)}" if session.left else "")
        self._link.set_visibility(reported)
        _show(self._rated, rated)
        self._rate.set_visibility(bool(rated))
        for epoch in session.epochs:
            if epoch.label not in self._epochs:
                with self.frame:
                    self._epochs[epoch.label] = _EpochRow(self._acts)
            self._epochs[epoch.label].show(session, epoch)


class _EpochRow:
    def __init__(self, acts: Acts) -> None:
        with ui.row().classes("items-center w-full"):
            self._words = ui.label().classes("grow")
            self._button("Show", acts.show)
            self._repeat = self._button("Repeat", acts.repeat)
            self._leave_out = self._button("Leave out", acts.leave_out)
            self._include = self._button("Include again", acts.include)

    def _button(self, words: str, act: Callable[[FoundSession, FoundEpoch], Any]) -> ui.button:
        return ui.button(words, on_click=lambda: act(*self._found))

    def show(self, session: FoundSession, epoch: FoundEpoch) -> None:
        self._found = session, epoch
        parts = [f"epoch {epoch.label}", epoch.condition, epoch.task, epoch.outcome, epoch.reason]
        if epoch.rating:
            parts.append(f"rated {epoch.rating}")
        if epoch.excluded:
            parts.append(f"left out: {epoch.excluded}")
        self._words.text = " · ".join(filter(None, parts))
        self._repeat.set_visibility(bool(session.outcome))
        self._leave_out.set_visibility(not epoch.excluded)
        self._include.set_visibility(bool(epoch.excluded))


def _show(at: ui.label | ui.button, words: str) -> None:
    at.text = words
    at.set_visibility(bool(words))
