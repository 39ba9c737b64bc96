"""The server of the operator's page, in a thread of the console's process.

Loop and recorder are processes of their own, which nothing here can hold up. Every file that a page
loads comes from this server.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
import secrets
import socket
import threading
from collections.abc import AsyncIterator
from pathlib import Path

import uvicorn
from fastapi import FastAPI, WebSocket
from nicegui import ui
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.staticfiles import StaticFiles

from rigidimeter.core.errors import UserError
from rigidimeter.rig.console.page.connections import bound_connections
from rigidimeter.rig.console.page.desk import Desk
from rigidimeter.rig.console.page.gate import Gate, is_loopback
from rigidimeter.rig.console.page.live_socket import LiveSockets
from rigidimeter.rig.console.page.page_view import show_page
from rigidimeter.rig.console.page.report_files import POLICY, report_file
from rigidimeter.rig.console.page.work import Work

ASSETS = Path(__file__).parent / "assets"
LARGEST_MESSAGE = 65_536
START_S = 30.0

_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,200}")


class PageServer:
    """Serves the page until the program ends.

    Parameters
    ----------
    desk : Desk
    work : Work
        What the page can have computed beside a session.
    host : str
    port : int
        0 for any that is free.
    token : str
        Of an address that is not the loopback; made if empty and needed.

    Raises
    ------
    UserError
        If the token is too short, or the address cannot be served.
    """

    def __init__(self, desk: Desk, work: Work, host: str, port: int, token: str = "") -> None:
        if token and _TOKEN.fullmatch(token) is None:
            raise UserError(
                f"--token: {len(token)} characters, which can be guessed or do not fit into an "
                "address; use 16 or more of A-Z, a-z, digits, - and _"
            )
        self._token = token or ("" if is_loopback(host) else secrets.token_urlsafe(24))
        self._desk, self._work = desk, work
        self._socket = _listening(host, port)
        self._host, self._port = host, self._socket.getsockname()[1]
        names = ("localhost", socket.gethostname(), host)
        config = uvicorn.Config(
            Gate(self._app(), self._token, names),
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
        return f"http://{f'[{host}]' if ':' in host else host}:{self._port}/{token}"

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
        sockets = LiveSockets(self._desk)

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
            found = report_file(self._desk.place.root, folder, path)
            if found is None:
                return PlainTextResponse("there is no such report", 404)
            return FileResponse(found, headers={"Content-Security-Policy": POLICY})

        @app.websocket("/live")
        async def live(one: WebSocket) -> None:
            await sockets.serve(one)

        def page() -> None:
            secret = secrets.token_urlsafe(24)
            sockets.admit(secret)
            show_page(self._desk, self._work, secret)

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
