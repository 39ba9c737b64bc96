"""A console in a process of its own and a browser in front of it; not a test itself."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page

STARTS_S = 90.0
"""Processes that load take so long on a machine that does a dozen other things at once."""


class Console:
    """A running `rigidimeter console`; `words` in place of its other arguments, run in `folder`.

    Attributes
    ----------
    place : Path
        The folder of its protocol.
    sessions : Path
        The folder of its sessions.
    address : str
        The link to its page, with the token.
    origin : str
        Where it serves, such as ``http://127.0.0.1:8765``.
    """

    def __init__(
        self,
        folder: Path,
        *options: str,
        protocol: str = "",
        stdin: int = subprocess.DEVNULL,
        words: Sequence[str] = (),
    ) -> None:
        self.place, self.sessions = folder, folder / "sessions"
        arguments = [sys.executable, "-m", "rigidimeter", "console", "--port", "0"]
        if protocol:
            (folder / "protocol.toml").write_text(protocol)
            arguments.append(str(folder / "protocol.toml"))
        self.process = subprocess.Popen(
            [*arguments, *(words or ("--out", str(self.sessions), *options))],
            cwd=folder if words else None,
            stdin=stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self.said: list[str] = []
        assert self.process.stdout is not None
        lines = iter(self.process.stdout)
        self.address = ""
        for line in lines:
            self.said.append(line)
            found = re.search(r"Open (\S+) in", line)
            if found:
                self.address = found[1]
                break
        self._listener = threading.Thread(target=lambda: self.said.extend(lines), daemon=True)
        self._listener.start()
        assert self.address, "".join(self.said)
        self.origin = self.address.partition("/?")[0]

    def close(self) -> None:
        """End it in order."""
        if self.process.poll() is None:
            self.process.terminate()
            self.process.wait(60)
        self._listener.join(60)
        assert self.process.stdout is not None
        self.process.stdout.close()

    def folder(self) -> Path:
        """Return the newest session."""
        return max(self.sessions.glob("*/manifest.json"), key=lambda p: p.stat().st_mtime).parent

    def events(self) -> list[dict[str, Any]]:
        """Return what happened in the newest session so far."""
        path = self.folder() / "events.jsonl"
        lines = path.read_text().splitlines() if path.exists() else []
        return [json.loads(line) for line in lines]

    def _end(self) -> dict[str, Any] | None:
        events = self.events()
        return events[-1] if events and events[-1]["event"] == "session_ended" else None

    def ended(self) -> dict[str, Any]:
        """Wait until the newest session is closed; return how."""
        found: dict[str, Any] = wait_for(self._end)
        return found

    def leads_session(self) -> bool:
        """Whether a session of this program has not been closed."""
        if self.process.poll() is not None or not any(self.sessions.glob("*/manifest.json")):
            return False
        return self._end() is None


def wait_for(what: Callable[[], Any], timeout_s: float = STARTS_S) -> Any:
    """Return what the function returns, once that is true."""
    until_s = time.monotonic() + timeout_s
    while True:
        found = what()
        if found:
            return found
        assert time.monotonic() < until_s, f"{what} did not come true within {timeout_s} s"
        time.sleep(0.02)


def open_page(opened: Browser, console: Console, **options: Any) -> Page:
    """Open the page and wait until its script runs."""
    page = opened.new_context(viewport={"width": 1280, "height": 800}, **options).new_page()
    page.set_default_timeout(20e3)
    page.goto(console.address)
    page.wait_for_function("document.body.dataset.view !== undefined", timeout=1e3 * STARTS_S)
    page.wait_for_function("document.getElementById('state').textContent !== 'connecting …'")
    return page


def fill(page: Page, key: str, value: str) -> None:
    """Fill a field of the form."""
    page.locator(f"input[data-field={key}]").fill(value)


def start(page: Page, subject: str = "S01", operator: str = "Op") -> None:
    """Fill in what must be given, and start; return once samples are drawn."""
    fill(page, "subject", subject)
    fill(page, "operator", operator)
    page.evaluate("window.rigDrawnS = 0")
    page.get_by_role("button", name="Start session").click()
    page.wait_for_function("window.rigDrawnS > 0", timeout=1e3 * STARTS_S)


_OUTLINED = """() => {
  const at = document.activeElement, shown = at.closest(".q-field__control") || at;
  const bar = document.querySelector(".bar").getBoundingClientRect();
  const under = !at.closest(".bar") && shown.getBoundingClientRect().top < bar.bottom;
  const { outlineWidth, boxShadow } = getComputedStyle(shown);
  const outlined = outlineWidth === "4px" || boxShadow.endsWith("6px");
  return [at.ariaLabel || at.textContent, outlined, under || bar.top < 0];
}"""


def assert_reached_by_tab(page: Page, last: str) -> None:
    """Go by Tab to what is called `last`; each stop, and the emergency stop, must be seen."""
    page.set_viewport_size({"width": 820, "height": 420})
    page.locator(".tab").first.focus()
    for _ in range(40):
        page.keyboard.press("Tab")
        name, outlined, hidden = page.evaluate(_OUTLINED)
        assert outlined, name
        assert not hidden, name
        if name == last:
            return
    raise AssertionError(f"Tab does not lead to {last}")
