"""What the page sends to its server, in a browser without one, on a clock of the test's own."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page
from tests.unit.rig.console.test_facts import shown
from tests.unit.rig.console.test_session_progress import started, told

import rigidimeter.rig.console.page as package
from rigidimeter.rig.console.page import ORDERS, parse_message, session_state

ASSETS = Path(package.__file__).parent / "assets"
ADDRESS = "http://127.0.0.1/"
FAKES = """
window.sent = [];
window.rigTraces = new Proxy({}, { get: () => () => {} });
window.sounds = [];
window.rigTones = {
  allowed: true,
  stop: () => window.sounds.push("stop"),
  caution: () => window.sounds.push("caution"),
};
window.WebSocket = class {
  constructor() { this.readyState = 1; window.socket = this; setTimeout(() => this.onopen(), 1); }
  send(text) { window.sent.push(text); }
};
"""
QUIET = {"stop": 0, "caution": 0}
CHECKING = {
    "starting": "",
    "checking": "daily check",
    "session": None,
    "finished": None,
    "alarms": QUIET,
}
NOTHING_RUNS = CHECKING | {"checking": ""}
STARTING = NOTHING_RUNS | {"starting": "S01-20260101"}


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

    def told(self, state: dict[str, Any] = CHECKING, *, control: bool = True, **more: Any) -> None:
        """Let the server tell what is going on."""
        message = json.dumps({"state": state | more, "control": control})
        self.page.evaluate("(data) => window.socket.onmessage({ data })", message)

    def sounds(self) -> list[str]:
        """Return what was heard since the last call."""
        found: list[str] = self.page.evaluate("window.sounds.splice(0)")
        return found

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
SESSION = session_state(shown(told(started(1, "1", 25.0))), told(started(1, "1", 25.0))) | {
    "number": 1,
    "save": False,
}


def in_a_note(page: Page) -> None:
    page.locator("#view-during").evaluate("(at) => { at.hidden = false; }")
    page.locator("#note").evaluate("(at) => { at.disabled = false; at.focus(); }")
    page.keyboard.press("Escape")


def by_the_keyboard(page: Page) -> None:
    page.locator("#emergency").focus()
    page.keyboard.press("Enter")


PRESSES = [
    lambda page: page.keyboard.press("Escape"),
    lambda page: page.locator("#emergency").click(),
    lambda page: page.locator("#emergency").dispatch_event("pointerdown"),
    by_the_keyboard,
    in_a_note,
]


@pytest.mark.parametrize("press", PRESSES)
def test_the_emergency_stop_is_sent_once_however_it_is_pressed(
    operator: Operator, press: Callable[[Page], object]
) -> None:
    press(operator.page)
    assert operator.sent() == EMERGENCY


@pytest.mark.parametrize("state", [CHECKING, STARTING, NOTHING_RUNS | {"session": SESSION}])
@pytest.mark.parametrize("press", [PRESSES[1], PRESSES[0]])
def test_a_page_that_watches_offers_the_stop_and_sends_it(
    operator: Operator, state: dict[str, Any], press: Callable[[Page], object]
) -> None:
    operator.told(state, control=False)
    assert "watching: it can only stop" in operator.page.locator("#role").inner_text()
    assert operator.page.locator("#emergency").is_enabled()
    press(operator.page)
    assert operator.sent() == EMERGENCY


@pytest.mark.parametrize("control", [True, False])
def test_the_stop_is_not_offered_where_nothing_runs_or_nobody_hears(
    operator: Operator, control: bool
) -> None:
    operator.told(NOTHING_RUNS, control=control)
    assert operator.page.locator("#emergency").is_disabled()
    operator.told(control=control)
    assert operator.page.locator("#emergency").is_enabled()
    operator.after(1600)  # and no word of the server
    assert operator.page.locator("#emergency").is_disabled()
    said = operator.page.locator("#banner").inner_text()
    assert "The connection to the program is lost" in said
    assert ("The arm is stopped" in said, "cannot stop the arm" in said) == (control, not control)
    operator.page.keyboard.press("Escape")  # the server may hear it all the same
    assert operator.sent() == EMERGENCY


def test_a_stop_and_a_caution_are_heard_once_and_not_what_was_before(operator: Operator) -> None:
    operator.told(alarms={"stop": 7, "caution": 9})  # as the page opened, it was told of none
    operator.sounds()
    operator.told(alarms={"stop": 7, "caution": 9})
    assert operator.sounds() == []
    operator.told(alarms={"stop": 7, "caution": 10})
    operator.told(alarms={"stop": 8, "caution": 11})
    assert operator.sounds() == ["caution", "stop"]
    operator.told(alarms={"stop": 8, "caution": 11})
    operator.page.evaluate("window.socket.onclose()")
    operator.told(alarms={"stop": 0, "caution": 0})  # the program was started anew
    operator.told(alarms={"stop": 1, "caution": 0})
    assert operator.sounds() == ["stop"]


def test_cautions_are_silenced_for_one_session_and_stops_never(operator: Operator) -> None:
    silence, heard = operator.page.locator("#silence"), operator.page.locator("#tones")
    operator.told(NOTHING_RUNS)
    assert silence.is_hidden()
    running = NOTHING_RUNS | {"session": SESSION}
    operator.told(running)
    silence.click()
    operator.told(running, alarms={"stop": 0, "caution": 1})
    assert operator.sounds() == []
    assert heard.inner_text() == "cautions are silent"
    assert silence.get_attribute("aria-pressed") == "true"
    operator.told(running, alarms={"stop": 1, "caution": 1})
    assert operator.sounds() == ["stop"]
    operator.told(running | {"session": SESSION | {"number": 2}}, alarms={"stop": 1, "caution": 2})
    operator.told(running | {"session": SESSION | {"number": 2}}, alarms={"stop": 1, "caution": 3})
    assert operator.sounds() == ["caution"]
    assert heard.inner_text() == ""
    silence.click()
    operator.told(NOTHING_RUNS, alarms={"stop": 1, "caution": 3})
    operator.told(running, alarms={"stop": 1, "caution": 4})
    assert operator.sounds() == ["caution"]


def test_a_page_without_tones_says_so(operator: Operator) -> None:
    operator.page.evaluate("window.rigTones.allowed = false")
    operator.told()
    assert operator.page.locator("#tones").inner_text().startswith("no tones yet: click")


def test_a_lost_connection_is_heard_once_while_something_runs(operator: Operator) -> None:
    operator.after(3000)
    assert operator.sounds() == ["stop"]
    operator.told(NOTHING_RUNS)
    operator.after(3000)
    assert operator.sounds() == []


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


def test_a_key_that_is_held_down_on_a_button_orders_once(operator: Operator) -> None:
    """Held on *Resume* it would end each hold at once."""
    operator.page.locator("#view-during").evaluate("(at) => { at.hidden = false; }")
    button = operator.page.locator("[data-order=resume]")
    button.evaluate("(at) => { at.disabled = false; at.focus(); }")
    for _ in range(5):
        operator.page.keyboard.down("Enter")
    operator.page.keyboard.up("Enter")
    assert operator.sent() == [{"kind": "order", "command": "resume"}]
