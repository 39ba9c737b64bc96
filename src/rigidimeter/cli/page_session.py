"""Sessions that are led from the page in a browser: `console`, and `run --console`."""

from __future__ import annotations

import importlib.util
import time
from dataclasses import replace
from functools import partial

from rigidimeter.cli.output import echo
from rigidimeter.cli.planned_session import (
    PlannedSession,
    checked_rig,
    new_session,
    require_packages,
    rest_of_session,
    run_planned,
    write_nwb_beside,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import count_epochs, rest_of
from rigidimeter.core.settings import changed_settings
from rigidimeter.rig.acquisition.processes import Ended, Realtime
from rigidimeter.rig.console.page import (
    SILENT_S,
    Jobs,
    PageServer,
    Place,
    ServerState,
    StartRequest,
    extended,
    in_buttons,
    next_buttons,
)

SHOWN_S = 3.0


def serve_page(place: Place, realtime: Realtime, address: tuple[str, int, str]) -> Ended | None:
    """Serve the page at a host and a port, with a token, until the program is stopped.

    Where the place is for one session, until that has ended; it is returned.

    Raises
    ------
    UserError
        If the packages of the page are missing.
    """
    if importlib.util.find_spec("nicegui") is None:
        raise UserError(
            "the page needs more packages: pip install 'rigidimeter[console]'; "
            "`rigidimeter run` shows a session in the terminal"
        )
    from rigidimeter.cli.rig_steps import rig_steps

    place.root.mkdir(parents=True, exist_ok=True)
    state = ServerState(place)
    if not place.one_session:
        for line in extended(place):
            echo(line)
    server = PageServer(state, Jobs(partial(rig_steps, place.rig)), *address)
    server.start()
    echo(f"Open {server.address} in a browser; Ctrl-C ends the program")
    try:
        while not state.ending:
            ended = lead_session(state, state.next_request(), realtime)
            if place.one_session and ended is not None:
                time.sleep(SHOWN_S)  # for the page to say how it ended
                return ended
    finally:
        server.stop()
    return None


def lead_session(state: ServerState, request: StartRequest, realtime: Realtime) -> Ended | None:
    """Run what the page asked for, and say on the page how it ended; None if it did not begin."""
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
    if request.settings is None:
        virtual = state.place.rig is None
        folder = state.place.root / request.resume
        planned = rest_of_session(folder, virtual=virtual, epoch=request.epoch, left=request.left)
    else:
        planned = new_session(request.settings, request.about, state.place.settings_path)
    lost_s = min(SILENT_S, planned.settings.loop.console_lost_s)
    settings = changed_settings(planned.settings, {"loop": {"console_lost_s": lost_s}})
    return replace(planned, settings=settings)
