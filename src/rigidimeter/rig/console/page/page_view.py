"""One page: the top bar with the emergency stop, and its three parts."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from nicegui import ui

from rigidimeter.core.version import __version__
from rigidimeter.rig.console.page.after_view import AfterView
from rigidimeter.rig.console.page.before_view import BeforeView
from rigidimeter.rig.console.page.desk import Desk
from rigidimeter.rig.console.page.work import Work

ASSETS = Path(__file__).parent / "assets"


def show_page(desk: Desk, work: Work, secret: str) -> None:
    """Build a page.

    Parameters
    ----------
    desk : Desk
    work : Work
    secret : str
        Of this page alone: the script says it to the socket, so the server knows both as one.
    """

    def in_control() -> bool:
        return desk.presence.has_control(secret)

    ui.colors(primary="#0050a0")  # white on it has a contrast of 8 to 1
    ui.add_head_html(
        f'<meta name="rig-page" content="{secret}">'
        f'<link rel="stylesheet" href="/vendored/uPlot.min.css?{__version__}">'
        f'<link rel="stylesheet" href="/assets/page.css?{__version__}">'
        f'<script src="/vendored/uPlot.iife.min.js?{__version__}"></script>'
        f'<script src="/assets/traces.js?{__version__}" defer></script>'
        f'<script src="/assets/page.js?{__version__}" defer></script>'
    )
    ui.html(_during(), sanitize=False).classes("rig")
    with ui.element("section").classes("view").props("id=view-before"):
        unfinished = ui.label("").classes("problem").props('role="status"')
        BeforeView(desk, work, in_control)
    with ui.element("section").classes("view").props("id=view-after"):
        AfterView(desk, work, in_control, unfinished)


@cache
def _during() -> str:
    return (ASSETS / "page.html").read_text(encoding="utf-8")
