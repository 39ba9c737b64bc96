"""`rigidimeter console`: the operator's page in a browser."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.cli.help_pages import OPTIONS, PAGE, argument
from rigidimeter.cli.options import CPU, PRIORITY, RIG
from rigidimeter.cli.output import echo
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.cli.planned_session import PlannedSession
    from rigidimeter.rig.acquisition.processes import Ended, Realtime
    from rigidimeter.rig.console.page import ServerState, StartRequest

SHOWN_S = 3.0

HOST = PAGE.option(
    "--host ADDRESS",
    "Address of the page. Any but this computer's own loopback needs a token, which is printed.",
    "127.0.0.1",
)
PORT = PAGE.option("--port N", "Port; 0 for a free one.", 8765, min=0, max=65535)
TOKEN = PAGE.option("--token TEXT", "Token of the page. Default: a random one.", "")


def console(
    protocol: Path | None = argument(
        "[PROTOCOL.toml]", "Settings that the form begins with.", None
    ),
    rig: Path | None = RIG,
    out: Path = OPTIONS.option("--out DIR", "Folder of the sessions.", Path("sessions")),
    host: str = HOST,
    port: int = PORT,
    token: str = TOKEN,
    priority: int = PRIORITY,
    cpu: int | None = CPU,
) -> None:
    """Run sessions from a page in a browser: plan, run, look, repeat.

    The page's heartbeat is a dead-man's switch: a page that is closed, frozen or cut off stops the
    arm. Needs the extra `console`. Ctrl-C ends the program.

    \b
    For example:
      rigidimeter console
      rigidimeter console protocol.toml --rig rig.toml --out study
    """
    from rigidimeter.core.settings import load_settings
    from rigidimeter.rig.acquisition.processes import Realtime, complete_left
    from rigidimeter.rig.console.page import Place, ServerState, extended

    for line in complete_left():
        echo(line, err=True)
    settings = load_settings(protocol)
    require_page()
    out.mkdir(parents=True, exist_ok=True)
    name = protocol.name if protocol is not None else "the defaults"
    place = Place(out.absolute(), settings, name, rig, settings_path=protocol)
    state = ServerState(place)
    for line in extended(state.place):
        echo(line)
    with serving(state, host, port, token):
        while not state.ending:
            lead_session(state, state.next_request(), Realtime(priority=priority, cpu=cpu))


def run_on_page(
    planned: PlannedSession,
    out: Path,
    rig: Path | None,
    realtime: Realtime,
    address: tuple[str, int, str],
) -> Ended:
    """Serve the page for one session, which begins when the operator says so there.

    Raises
    ------
    UserError
        If the program was stopped before.
    """
    from rigidimeter.rig.console.page import Place, ServerState

    require_page()
    out = out.absolute()
    out.parent.mkdir(parents=True, exist_ok=True)
    name = planned.source.name if planned.source is not None else "the defaults"
    source = planned.source
    state = ServerState(Place(out.parent, planned.settings, name, rig, out.name, source))
    with serving(state, *address):
        while not state.ending:
            ended = lead_session(state, state.next_request(), realtime)
            if ended is not None:
                time.sleep(SHOWN_S)  # for the page to say how it ended
                return ended
    raise UserError("the program was stopped before a session was run")


@contextmanager
def serving(state: ServerState, host: str, port: int, token: str) -> Iterator[None]:
    """Serve the page meanwhile."""
    from rigidimeter.cli.rig_steps import rig_steps
    from rigidimeter.rig.console.page import Jobs, PageServer

    server = PageServer(state, Jobs(partial(rig_steps, state.place.rig)), host, port, token)
    server.start()
    echo(f"Open {server.address} in a browser; Ctrl-C ends the program")
    try:
        yield
    finally:
        server.stop()


def lead_session(state: ServerState, request: StartRequest, realtime: Realtime) -> Ended | None:
    """Run what the page asked for, and say on the page how it ended; None if it did not begin."""
    from rigidimeter.cli.planned_session import (
        checked_rig,
        require_packages,
        run_planned,
        write_nwb_beside,
    )
    from rigidimeter.core.session import count_epochs, rest_of
    from rigidimeter.rig.console.page import extended, in_buttons, next_buttons

    folder, rig = state.place.root / request.folder, state.place.rig
    try:
        planned = checked_rig(_planned(state, request), rig)
        require_packages(planned.settings)
        planned = planned.blinded() if planned.about.get("blinded") else planned
        look = state.console(planned.shown(virtual=rig is None), folder)
        state.refuse_stopped()
        ended = run_planned(planned, folder, rig, realtime, look, state.operator_seen_ns)
        state.ending = bool(ended.signals)
        good, of = count_epochs(ended.folder)
        left = len(rest_of(ended.folder).epochs)
    except UserError as error:
        state.over(folder, "not run", tuple(map(in_buttons, error.lines)))
        for line in error.lines:
            echo(line, err=True)
        return None
    sentences = [f"{good} of {of} epochs ended with success; session in {ended.folder}."]
    if ended.outcome != "success":
        sentences.append(f"It ended with {ended.outcome or 'no outcome'}: {ended.reason}.")
    if planned.settings.sharing.nwb_at_close:
        sentences.append(write_nwb_beside(ended.folder))
    sentences += [*ended.remarks, *extended(state.place)]
    echo(" ".join(sentences))
    sentences.append(next_buttons(closed=bool(ended.outcome), good=good, left=left))
    state.over(ended.folder, ended.outcome or "no outcome", tuple(map(in_buttons, sentences)))
    return ended


def _planned(state: ServerState, request: StartRequest) -> PlannedSession:
    """Return what is to be run, in which a silent page is lost sooner than a silent terminal."""
    from rigidimeter.cli.planned_session import new_session, rest_of_session
    from rigidimeter.core.settings import changed_settings
    from rigidimeter.rig.console.page import SILENT_S

    if request.settings is None:
        virtual = state.place.rig is None
        folder = state.place.root / request.resume
        planned = rest_of_session(folder, virtual=virtual, epoch=request.epoch, left=request.left)
    else:
        planned = new_session(request.settings, request.about, state.place.settings_path)
    lost_s = min(SILENT_S, planned.settings.loop.console_lost_s)
    settings = changed_settings(planned.settings, {"loop": {"console_lost_s": lost_s}})
    return replace(planned, settings=settings)


def require_page() -> None:
    """Refuse to begin without the packages of the page.

    Raises
    ------
    UserError
        With the command that installs them.
    """
    if importlib.util.find_spec("nicegui") is None:
        raise UserError(
            "the page needs more packages: pip install 'rigidimeter[console]'; "
            "`rigidimeter run` shows a session in the terminal"
        )
