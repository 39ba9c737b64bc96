"""Sessions that are led from the page in a browser: `console`, and `run --console`."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

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
from rigidimeter.core.session import codes_of, count_epochs, in_codes, rest_of
from rigidimeter.core.settings import changed_settings
from rigidimeter.core.study_files import continued_session, next_words, plan_of
from rigidimeter.rig.acquisition.processes import Ended, EndedEarly, Realtime, SessionMemory
from rigidimeter.rig.console import StopKeys, stop_keys
from rigidimeter.rig.console.page import (
    SILENT_S,
    Jobs,
    PageServer,
    Place,
    ServerState,
    StartRequest,
    extended,
    in_buttons,
    new_token,
    next_buttons,
    token_in,
)

SHOWN_S = 3.0


NOBODY_ELSE = (
    "Without a token every program and user of this computer can lead the rig: only for a computer "
    "of one user, and close the browser's other pages"
)


@dataclass(frozen=True)
class PageAddress:
    """Where the page is served, and to whom: the options of `console` and `run --console`.

    Raises
    ------
    UserError
        If a file and no token are asked for.
    """

    host: str
    port: int
    token_file: Path | None = None
    no_token: bool = False

    def __post_init__(self) -> None:
        if self.no_token and self.token_file is not None:
            raise UserError("--no-token: there is no token for --token-file; leave one of them out")

    def token(self) -> str:
        """Return the token, of the file or a new one; empty for none.

        Raises
        ------
        UserError
            If the file cannot be used.
        """
        if self.no_token:
            return ""
        return new_token() if self.token_file is None else token_in(self.token_file)


def serve_page(place: Place, realtime: Realtime, address: PageAddress) -> Ended | None:
    """Serve the page until the program is stopped.

    Where the place is for one session, until that has ended; it is returned.

    Raises
    ------
    UserError
        If it cannot be served there.
    """
    from rigidimeter.cli.rig_steps import rig_steps

    token = address.token()
    place.root.mkdir(parents=True, exist_ok=True)
    state = ServerState(place)
    if not place.one_session:
        for line in extended(place):
            echo(line)
    jobs = Jobs(partial(rig_steps, place.rig))
    server = PageServer(state, jobs, address.host, address.port, token)
    server.start()
    echo(f"Open {server.address} in a browser; Ctrl-C ends the program")
    if not token:
        echo(NOBODY_ELSE)
    try:
        with stop_keys(sys.stdin) as keys:
            echo(keys.help)
            listen = partial(_listen, keys, state)
            while not state.ending:
                ended = lead_session(state, state.next_request(listen), realtime, listen)
                if ended is None or ended.outcome != "success":
                    keys.ring()
                if place.one_session and ended is not None:
                    time.sleep(SHOWN_S)  # for the page to say how it ended
                    return ended
    finally:
        server.stop()
    return None


def _listen(keys: StopKeys, state: ServerState) -> None:
    """Obey the emergency stop of the terminal."""
    if keys.pressed():
        keys.say("emergency stop" if state.press_stop() else "nothing runs that could be stopped")


def lead_session(
    state: ServerState, request: StartRequest, realtime: Realtime, listen: Callable[[], None]
) -> Ended | None:
    """Run what the page asked for, and say on the page how it ended; None if it did not begin.

    `listen` is called often.
    """
    folder, rig = state.place.root / request.folder, state.place.rig
    codes: dict[str, str] = codes_of(request.about)
    try:
        planned = checked_rig(_planned(state, request), rig)
        require_packages(planned.settings)
        planned = planned.blinded() if planned.about.get("blinded") else planned
        codes = codes_of(planned.about)
        look = state.console(planned.shown(virtual=rig is None), folder)

        def follow(shared: SessionMemory) -> None:
            listen()
            look(shared)

        listen()
        state.refuse_stopped()
        ended = run_planned(planned, folder, rig, realtime, follow, state.operator_seen_ns)
        state.ending = bool(ended.signals)
        good, of = count_epochs(ended.folder)
        left = len(rest_of(ended.folder).epochs)
    except UserError as error:
        state.ending = isinstance(error, EndedEarly) and bool(error.signals)
        lines = [in_codes(line, codes) for line in error.lines]
        state.over(folder, "not run", tuple(map(in_buttons, lines)))
        for line in lines:
            echo(line, err=True)
        return None
    sentences = [f"{good} of {of} epochs completed; session in {ended.folder}."]
    if ended.outcome != "success":
        how = "failed" if ended.outcome == "fail" else f"ended: {ended.outcome or 'no outcome'}"
        sentences.append(f"The session {how}: {ended.reason}.")
    if planned.settings.sharing.nwb_at_close:
        sentences.append(write_nwb_beside(ended.folder))
    sentences += [*ended.remarks, *extended(state.place)]
    if state.place.planned:
        sentences.append(_next_words(state.place.root, planned.about))
    sentences = [in_codes(sentence, codes) for sentence in sentences if sentence]
    echo(" ".join(sentences))
    sentences.append(next_buttons(closed=bool(ended.outcome), good=good, left=left))
    state.over(ended.folder, ended.outcome or "no outcome", tuple(map(in_buttons, sentences)))
    return ended


def _next_words(study: Path, about: Mapping[str, Any]) -> str:
    """Return which session of the subject is due now; empty where the plan has not the subject."""
    try:
        return next_words(plan_of(study), str(about.get("subject", "")))
    except UserError as error:
        return str(error)


def _planned(state: ServerState, request: StartRequest) -> PlannedSession:
    """Return what is to be run, in which a silent page is lost sooner than a silent terminal."""
    if request.settings is None:
        virtual = state.place.rig is None
        folder = state.place.root / request.resume
        planned = rest_of_session(folder, virtual=virtual, epoch=request.epoch, left=request.left)
        if (rest := continued_session(folder, planned.about)) is not None:
            place = rest.facts(datetime.now(UTC), request.begin_anyway)
            planned = planned.with_about({"plan": place})
    else:
        source = request.source or state.place.settings_path
        planned = new_session(request.settings, request.about, source)
    lost_s = min(SILENT_S, planned.settings.loop.console_lost_s)
    settings = changed_settings(planned.settings, {"loop": {"console_lost_s": lost_s}})
    return replace(planned, settings=settings)
