"""The server of the operator's page, in a thread of the console's process, and the page it sends.

Loop and recorder are processes of their own, which nothing here can hold up. Every file that a page
loads comes from this server.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import socket
import threading
from collections.abc import AsyncIterator
from functools import cache
from pathlib import Path

import uvicorn
from fastapi import FastAPI, WebSocket
from nicegui import ui
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.staticfiles import StaticFiles

from rigidimeter.core.errors import UserError
from rigidimeter.core.version import __version__
from rigidimeter.rig.console.page.access import AccessCheck, bound_connections, in_url
from rigidimeter.rig.console.page.after_view import AfterView
from rigidimeter.rig.console.page.before_view import BeforeView
from rigidimeter.rig.console.page.draw_view import DrawView
from rigidimeter.rig.console.page.jobs import Jobs
from rigidimeter.rig.console.page.live_socket import LiveSockets
from rigidimeter.rig.console.page.outside_plan import OutsideView
from rigidimeter.rig.console.page.page_token import require_token
from rigidimeter.rig.console.page.plan_view import PlanView
from rigidimeter.rig.console.page.server_state import ServerState
from rigidimeter.rig.console.page.sessions_found import POLICY, report_file

ASSETS = Path(__file__).parent / "assets"
LARGEST_MESSAGE = 65_536
START_S = 30.0


class PageServer:
    """Serves the page until the program ends.

    Parameters
    ----------
    state : ServerState
    jobs : Jobs
        What the page can have computed beside a session.
    host : str
    port : int
        0 for any that is free.
    token : str
        Empty for none: then every program and user of this computer can lead the rig.

    Raises
    ------
    UserError
        If the token is too short, is missing where a network reaches the page, or the address
        cannot be served.
    """

    def __init__(self, state: ServerState, jobs: Jobs, host: str, port: int, token: str) -> None:
        require_token(token, host)
        self._token = token
        self._state, self._jobs = state, jobs
        self._socket = _listening(host, port)
        self._host, self._port = host, self._socket.getsockname()[1]
        names = ("localhost", "127.0.0.1", "[::1]", socket.gethostname(), in_url(host))
        config = uvicorn.Config(
            AccessCheck(self._app(), self._token, names),
            http="h11",  # which keeps the address of a request as it came
            proxy_headers=False,
            ws_max_size=LARGEST_MESSAGE,
            log_level="warning",
            lifespan="on",
            timeout_graceful_shutdown=1,
            server_header=False,
        )
        bound_connections(config)
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._serve, name="page", daemon=True)

    @property
    def address(self) -> str:
        """What the operator opens in a browser."""
        host = socket.gethostname() if self._host in ("0.0.0.0", "::") else self._host
        token = f"?token={self._token}" if self._token else ""
        return f"http://{in_url(host)}:{self._port}/{token}"

    def start(self) -> None:
        """Start to serve; return once pages can be opened.

        Raises
        ------
        UserError
            If the server does not start.
        """
        self._thread.start()
        for _ in range(round(START_S / 0.05)):
            if self._server.started:
                return
            if not self._thread.is_alive():
                break
            self._thread.join(0.05)
        raise UserError("the server of the console's page did not start; see the message above")

    def stop(self) -> None:
        """End the server."""
        self._server.should_exit = True
        self._thread.join(3.0)

    def _serve(self) -> None:
        asyncio.run(self._server.serve(sockets=[self._socket]))

    def _app(self) -> FastAPI:
        sockets = LiveSockets(self._state)

        @contextlib.asynccontextmanager
        async def lifespan(_: FastAPI) -> AsyncIterator[None]:
            pump = asyncio.create_task(sockets.pump())
            yield
            pump.cancel()

        app = FastAPI(lifespan=lifespan, docs_url=None, redoc_url=None, openapi_url=None)
        app.mount("/assets", StaticFiles(directory=ASSETS), name="assets")
        app.mount("/vendored", StaticFiles(packages=[("rigidimeter", "vendored")]), name="vendored")

        @app.get("/report/{folder}/{path:path}")
        def report(folder: str, path: str) -> Response:
            found = report_file(self._state.place.root, folder, path)
            if found is None:
                return PlainTextResponse("there is no such report", 404)
            return FileResponse(found, headers={"Content-Security-Policy": POLICY})

        @app.websocket("/live")
        async def live(one: WebSocket) -> None:
            await sockets.serve(one)

        def page() -> None:
            secret = secrets.token_urlsafe(24)
            sockets.admit(secret)
            show_page(self._state, self._jobs, secret)

        ui.page("/", title="rigidimeter")(page)
        # To compress what a page loads would hold up the beats of the page in control.
        ui.run_with(
            app,
            title="rigidimeter",
            dark=None,
            gzip_middleware_factory=None,
            show_welcome_message=False,
        )
        return app


def _listening(host: str, port: int) -> socket.socket:
    """Return a listening socket.

    Raises
    ------
    UserError
        If the address is not this computer's, or the port is taken.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    made = socket.socket(family, socket.SOCK_STREAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        made.bind((host, port))
        made.listen(64)
    except OSError as error:
        made.close()
        raise UserError(
            f"{host}, port {port}: the page cannot be served there ({error.strerror or error}); "
            "name another with --host and --port"
        ) from None
    return made


def show_page(state: ServerState, jobs: Jobs, secret: str) -> None:
    """Build a page.

    Parameters
    ----------
    state : ServerState
    jobs : Jobs
    secret : str
        Of this page alone: the script says it to the socket, so the server knows both as one.
    """

    def in_control() -> bool:
        return state.presence.has_control(secret)

    ui.colors(primary="#0050a0")  # white on it has a contrast of 8 to 1
    ui.add_head_html(
        f'<meta name="rig-page" content="{secret}">'
        f'<link rel="stylesheet" href="/vendored/uPlot.min.css?{__version__}">'
        f'<link rel="stylesheet" href="/assets/page.css?{__version__}">'
        f'<script src="/vendored/uPlot.iife.min.js?{__version__}"></script>'
        f'<script src="/assets/traces.js?{__version__}" defer></script>'
        f'<script src="/assets/tones.js?{__version__}" defer></script>'
        f'<script src="/assets/page.js?{__version__}" defer></script>'
    )
    ui.html(_during(), sanitize=False).classes("rig")
    with ui.element("section").classes("view").props("id=view-before"):
        unfinished = ui.label("").classes("problem").props('role="status"')
        if state.place.planned:
            PlanView(state, jobs, in_control)
            OutsideView(state, jobs, in_control, BeforeView)
        else:
            if not state.place.one_session:
                with ui.expansion("Plan the days").classes("w-full").props("dense"):
                    DrawView(state, jobs, in_control)
            BeforeView(state, jobs, in_control)
    with ui.element("section").classes("view").props("id=view-after"):
        AfterView(state, jobs, in_control, unfinished)


@cache
def _during() -> str:
    return (ASSETS / "page.html").read_text(encoding="utf-8")
