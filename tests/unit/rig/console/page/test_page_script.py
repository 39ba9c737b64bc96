"""What the page sends to its server, in a browser without one, on a clock of the test's own."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

import rigidimeter.rig.console.page as package
from rigidimeter.rig.console.page import ORDERS, parse_message

ASSETS = Path(package.__file__).parent / "assets"
ADDRESS = "http://127.0.0.1/"
FAKES = """
window.sent = [];
window.rigTraces = new Proxy({}, { get: () => () => {} });
window.WebSocket = class {
  constructor() { this.readyState = 1; window.socket = this; setTimeout(() => this.onopen(), 1); }
  send(text) { window.sent.push(text); }
};
"""
CHECKING = {"starting": "", "checking": "daily check", "session": None, "finished": None}


class Operator:
    """The page in control while the rig is checked, and what it has sent."""

    def __init__(self, page: Page) -> None:
        self.page = page
        page.set_default_timeout(90e3)
        page.clock.install(time=0)
        page.add_init_script(FAKES)
        html = (
            "<!doctype html><meta name=rig-page content=secret>"
            f"<body>{(ASSETS / 'page.html').read_text('utf-8')}"
            "<section id=view-before></section><section id=view-after></section>"
            f"<script>{(ASSETS / 'page.js').read_text('utf-8')}</script>"
        )
        page.route("**/*", lambda route: route.fulfill(body=html, content_type="text/html"))
        page.goto(ADDRESS)
        page.clock.pause_at(3600.0)
        self.after(100)
        (hello,) = self.sent()
        assert (hello["kind"], hello["page"]) == ("hello", "secret")
        self.told()

    def told(self, *, control: bool = True) -> None:
        """Let the server tell what is going on."""
        message = json.dumps({"state": CHECKING, "control": control})
        self.page.evaluate("(data) => window.socket.onmessage({ data })", message)

    def after(self, ms: int) -> None:
        self.page.clock.run_for(ms)

    def sent(self) -> list[dict[str, Any]]:
        """Return what was sent since the last call; beats of a page just opened are left out."""
        texts = self.page.evaluate("window.sent.splice(0)")
        for text in texts:
            parse_message(text)
        return [json.loads(text) for text in texts if "beat" not in text]

    def beats(self, ms: int) -> int:
        """Return how many beats the page sends in so many ms."""
        self.page.evaluate("window.sent.splice(0)")
        self.after(ms)
        texts = self.page.evaluate("window.sent.splice(0)")
        assert set(texts) <= {'{"kind":"beat"}'}
        return len(texts)


@pytest.fixture
def operator(browser: Browser) -> Iterator[Operator]:
    context = browser.new_context()
    yield Operator(context.new_page())
    context.close()


EMERGENCY = [{"kind": "emergency"}]


def in_a_note(page: Page) -> None:
    page.locator("#view-during").evaluate("(at) => { at.hidden = false; }")
    page.locator("#note").evaluate("(at) => { at.disabled = false; at.focus(); }")
    page.keyboard.press("Escape")


def by_the_keyboard(page: Page) -> None:
    page.locator("#emergency").focus()
    page.keyboard.press("Enter")


@pytest.mark.parametrize(
    "press",
    [
        lambda page: page.keyboard.press("Escape"),
        lambda page: page.locator("#emergency").click(),
        lambda page: page.locator("#emergency").dispatch_event("pointerdown"),
        by_the_keyboard,
        in_a_note,
    ],
)
def test_the_emergency_stop_is_sent_once_however_it_is_pressed(
    operator: Operator, press: Callable[[Page], object]
) -> None:
    press(operator.page)
    assert operator.sent() == EMERGENCY


def test_escape_is_sent_also_where_the_button_cannot_be_pressed(operator: Operator) -> None:
    """The server decides who may stop; a page that has just lost control does not know."""
    operator.told(control=False)
    assert operator.page.locator("#emergency").is_disabled()
    operator.page.keyboard.press("Escape")
    assert operator.sent() == EMERGENCY


@pytest.mark.parametrize("gone", ["pagehide", "hidden"])
def test_a_page_that_goes_says_so_and_beats_no_more(operator: Operator, gone: str) -> None:
    assert operator.beats(1000) == 20
    operator.told()
    if gone == "pagehide":
        operator.page.evaluate("dispatchEvent(new Event('pagehide'))")
    else:
        operator.page.evaluate(
            "Object.defineProperty(document, 'hidden', { value: true, configurable: true });"
            "document.dispatchEvent(new Event('visibilitychange'))"
        )
    assert operator.sent() == [{"kind": "leave"}]
    assert operator.beats(1000) == 0
    operator.told()
    operator.page.evaluate(
        "delete document.hidden; document.dispatchEvent(new Event('visibilitychange'))"
    )
    assert operator.beats(1000) == 20


def test_a_page_that_hears_nothing_beats_no_more(operator: Operator) -> None:
    """It shows an arm of long ago: nobody watches the one that moves."""
    assert operator.beats(1400) == 28
    assert operator.beats(1000) in (1, 2)  # until 1.5 s
    assert operator.beats(1000) == 0
    assert "The connection to the program is lost" in operator.page.locator("#banner").inner_text()


def test_each_button_orders_what_it_says(operator: Operator) -> None:
    for name in ORDERS:
        button = operator.page.locator(f"[data-order={name}]")
        button.evaluate("(at) => { at.disabled = false; at.click(); }")
        assert operator.sent() == [{"kind": "order", "command": name}]
