"""`rigidimeter console`: the operator's page in a browser."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from rigidimeter.cli.help_pages import OPTIONS, PAGE, argument
from rigidimeter.cli.options import CPU, PRIORITY, RIG
from rigidimeter.cli.output import echo
from rigidimeter.core.errors import UserError

HOST = PAGE.option(
    "--host ADDRESS",
    "Address of the page. By any but the loopback a network reaches it, unencrypted.",
    "127.0.0.1",
)
PORT = PAGE.option("--port N", "Port; 0 for a free one.", 8765, min=0, max=65535)
TOKEN_FILE = PAGE.option(
    "--token-file FILE",
    "File that keeps the token of the page. It is made with mode 0600; without it each start has a "
    "new token.",
)
NO_TOKEN = PAGE.flag(
    "--no-token",
    "No token, on a computer of one user. Every program and user of it can then lead the rig.",
)


def require_page() -> None:
    """Refuse to begin where packages of the page are missing.

    Raises
    ------
    UserError
        With the command that installs them.
    """
    missing = [n for n in ("fastapi", "nicegui", "starlette", "uvicorn") if find_spec(n) is None]
    if missing:
        raise UserError(
            f"the page needs more packages ({', '.join(missing)}): "
            "pip install 'rigidimeter[console]'; `rigidimeter run` shows a session in the terminal"
        )


def require_full_waits(clock_speed: float, *, virtual: bool) -> None:
    """Refuse a faster clock of the waits where a person is waiting.

    Raises
    ------
    UserError
    """
    if clock_speed != 1.0 and not virtual:
        raise UserError("--clock-speed: is for the virtual rig; a person has to wait the full time")


def console(
    protocol: Path | None = argument(
        "[PROTOCOL.toml]", "Settings that the form begins with.", None
    ),
    rig: Path | None = RIG,
    out: Path = OPTIONS.option("--out DIR", "Folder of the sessions.", Path("sessions")),
    host: str = HOST,
    port: int = PORT,
    token_file: Path | None = TOKEN_FILE,
    no_token: bool = NO_TOKEN,
    clock_speed: float = PAGE.option(
        "--clock-speed X",
        "With a plan on the virtual rig: waits pass so many times faster. Recorded.",
        1.0,
        min=1.0,
        max=100000.0,
    ),
    priority: int = PRIORITY,
    cpu: int | None = CPU,
) -> None:
    """Run sessions from a page in a browser: plan, run, look, repeat.

    Where --out is a study with a plan, the page offers the session that is due, after its wait. In
    any other folder a plan can be drawn on the page.

    The page's heartbeat is a dead-man's switch: a page that is closed, frozen or cut off stops the
    arm. The printed link holds a token, without which nobody looks or acts. SPACE and e in this
    terminal are the emergency stop. Needs the extra `console`. Ctrl-C ends the program.

    \b
    For example:
      rigidimeter console
      rigidimeter console examples/settings/human-elbow.toml --rig RIG.toml
    """
    require_page()
    from rigidimeter.cli.page_session import PageAddress, serve_page
    from rigidimeter.core.settings import load_settings
    from rigidimeter.rig.acquisition.processes import Realtime, complete_left
    from rigidimeter.rig.console.page import Place

    address = PageAddress(host, port, token_file, no_token)
    for line in complete_left():
        echo(line, err=True)
    settings = load_settings(protocol)
    name = protocol.name if protocol is not None else "the defaults"
    require_full_waits(clock_speed, virtual=rig is None)
    place = Place(
        out.absolute(), settings, name, rig, settings_path=protocol, clock_speed=clock_speed
    )
    serve_page(place, Realtime(priority=priority, cpu=cpu), address)
