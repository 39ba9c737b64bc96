"""The page in a real browser, over the real loop on the virtual rig."""

from __future__ import annotations

import os
import pty
import shutil
import signal
import termios
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import numpy as np
import pytest
from tests.console.conftest import PROTOCOL
from tests.console.opened import Console, assert_reached_by_tab, fill, open_page, start, wait_for

from rigidimeter.core.session import SessionWriter, read_manifest, read_samples
from rigidimeter.core.settings import Settings
from rigidimeter.rig.console import BELL, KEYS_HERE
from rigidimeter.rig.guard import Cause

MARKUP = "<img src=x onerror=alert(1)>"
RUNS = "document.getElementById('state').textContent === 'epoch runs'"


def text(page, name):
    return page.locator(f"#{name}").text_content()


def monotonic_origin_s(console):
    """Return when the session began, on CLOCK_MONOTONIC."""
    return next(e["monotonic_s"] for e in console.events() if e["event"] == "clock_started")


@pytest.fixture
def stranger():
    """Serve a page of somebody else on this computer; return its address."""

    class Page(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("content-type", "text/html")
            self.end_headers()
            self.wfile.write(b"<body></body>")

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Page)
    Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://localhost:{server.server_port}/"
    server.shutdown()
    server.server_close()


ATTACK = """(address) => Promise.all([
  ...["iframe", "script", "img"].map((name) => new Promise((done) => {
    const one = document.createElement(name);
    one.onload = () => done("loaded");
    one.onerror = () => done("refused");
    one.src = name === "script" ? address + "/assets/page.js" : address;
    document.body.append(one);
  })),
  new Promise((done) => {
    const socket = new WebSocket(address.replace("http", "ws") + "/live");
    socket.onopen = () => done("open");
    socket.onerror = () => done("refused");
  }),
  fetch(address, { method: "POST", headers: { "x-own": "1" } }).then(() => "done", () => "refused"),
])"""


def test_a_page_of_somebody_else_gets_nothing_from_the_browser_of_the_operator(
    console, chromium, stranger
):
    desk = console()
    page = open_page(chromium, desk).context.new_page()  # the browser has the cookie
    page.goto(stranger)
    framed, *others = page.evaluate(ATTACK, desk.origin)
    assert others == ["refused"] * 4
    assert framed == "loaded"  # the browser's own page, which says why not
    assert page.frames[1].locator("#emergency").count() == 0


def test_names_in_the_files_of_others_are_text(console, chromium):
    """A folder and a manifest that somebody copied here, with markup in every name."""
    desk = console()
    settings = Settings()
    desk.sessions.mkdir(exist_ok=True)
    writer = SessionWriter(
        desk.sessions / MARKUP.replace("/", ""),
        settings,
        [],
        {},
        virtual=True,
        about={"subject": MARKUP},
    )
    begun = {"label": MARKUP, "task": MARKUP, "condition": f"</script>{MARKUP}", "time_s": 0.0}
    writer.event("epoch_started", epoch=1, **begun)
    writer.event("epoch_ended", epoch=1, label=MARKUP, outcome="fail", reason=MARKUP, time_s=1.0)
    writer.event("note", what="rating", epoch=1, score=1.5, by=MARKUP)
    writer.event("session_ended", outcome="fail", reason=MARKUP)
    writer.close_files()
    page = chromium.new_context().new_page()
    said = []
    page.on("dialog", lambda dialog: (said.append(dialog.message), dialog.dismiss()))
    page.goto(desk.address)
    page.get_by_role("button", name="After").click()
    page.get_by_text(f"{writer.folder.name}:").click()
    page.get_by_text(f"rated 1.5 ({MARKUP})").wait_for()
    page.get_by_role("button", name="Show").click()
    page.get_by_text("has no samples").wait_for()
    assert page.locator("img[src=x]").count() == 0
    assert said == []
    shutil.rmtree(writer.folder)


WATCH = """() => {
  window.replaced = window.written = 0;
  new MutationObserver((records) => records.forEach(({ type }) => {
    if (type === "childList") window.replaced += 1; else window.written += 1;
  })).observe(document.getElementById("view-during"),
    { childList: true, characterData: true, subtree: true });
}"""


def test_a_session_from_the_form_to_its_end(console, chromium):
    """Bad fields are said and nothing starts; a second page only looks; a reload pauses."""
    desk = console()
    page, other = open_page(chromium, desk), open_page(chromium, desk)
    begin = page.get_by_role("button", name="Start session")
    fill(page, "subject", "../S01")
    page.get_by_text("use 1 to 40 letters").wait_for()
    assert begin.is_disabled()
    page.get_by_text("Perturbation, controller and limits").click()
    fill(page, "prbs_amplitude", "1,500")
    page.get_by_text("may be 1.500 or 1500").wait_for()
    fill(page, "prbs_amplitude", "1,1")
    start(page, operator=MARKUP)
    other.get_by_text("watching: it can only stop").wait_for()
    other.locator("#emergency:enabled").wait_for()
    assert other.locator("[data-order=abort]").is_disabled()
    other.close()
    page.wait_for_function(RUNS)
    page.evaluate(WATCH)
    page.wait_for_function("window.written + window.replaced > 20")
    assert page.evaluate("window.replaced") == 0  # or the memory of the browser rises
    assert_reached_by_tab(page, "Save")  # the last control of a session that runs
    page.locator("#note").fill("<b>coughs</b>")
    page.keyboard.press("Enter")
    page.reload()
    page.wait_for_function("document.getElementById('state').textContent.startsWith('paused')")
    page.locator("[data-order=resume]").click()
    page.wait_for_function("document.getElementById('rated').textContent === 'epoch 1'")
    page.locator("#examiner").fill("E1")
    page.locator("#score").fill("1,5")
    page.keyboard.press("Enter")
    assert desk.ended()["outcome"] == "success"
    page.wait_for_function("document.body.dataset.view === 'after'")
    page.get_by_role("button", name="During").click()
    page.set_viewport_size({"width": 390, "height": 844})  # a telephone's
    assert page.locator("#panes canvas").count() > 0
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    events, about = desk.events(), read_manifest(desk.folder())["about"]
    notes = {event["what"]: event for event in events if event["event"] == "note"}
    assert notes["note"]["text"] == "<b>coughs</b>"
    assert (notes["rating"]["score"], notes["rating"]["by"]) == (1.5, "E1")
    outcomes = [e["outcome"] for e in events if e["event"] == "epoch_ended"]
    assert outcomes[1:] == ["success"] * (len(outcomes) - 1)
    assert outcomes.count("success") == 2
    assert about["subject"] == "S01"
    assert about["operator"] == MARKUP
    assert read_manifest(desk.folder())["settings"]["prbs"]["amplitude_nm"] == 1.1
    ticks = read_samples(desk.folder() / "samples.arrows")["tick"]
    assert np.unique(ticks).size == ticks.size


PRESS_AT_ONCE = """() => {
  const button = document.getElementById("emergency");
  const waiting = setInterval(() => {
    if (button.disabled) return;
    clearInterval(waiting);
    window.pressed = document.getElementById("state").textContent;
    button.dispatchEvent(new PointerEvent("pointerdown"));
  }, 5);
}"""


def test_the_emergency_stop_works_before_the_first_tick(console, chromium):
    desk = console()
    page = open_page(chromium, desk)
    fill(page, "subject", "S01")
    fill(page, "operator", "Op")
    page.evaluate(PRESS_AT_ONCE)
    before = {*desk.sessions.glob("*/samples.arrows")}
    page.get_by_role("button", name="Start session").click()
    page.wait_for_function(
        "window.pressed && document.getElementById('state').textContent.startsWith('ended')"
    )
    assert page.evaluate("window.pressed").startswith("starting")
    assert "emergency stop was pressed" in text(page, "banner")
    for path in {*desk.sessions.glob("*/samples.arrows")} - before:
        assert not np.any(read_samples(path)["velocity_command_rad_s"])


def test_the_emergency_stop_stops(console, chromium, lateness):
    desk = console()
    page = open_page(chromium, desk)
    start(page)
    page.wait_for_function(RUNS)
    page.locator("#note").focus()
    page.keyboard.type("e stop, a n h ")  # the keys of a terminal are text here
    assert not text(page, "state").startswith("ended")
    clicked_s = time.monotonic()
    page.keyboard.press("Escape")
    assert "emergency stop" in desk.ended()["reason"]
    stopped_s = monotonic_origin_s(desk) + desk.ended()["time_s"]
    assert stopped_s - clicked_s < 0.3 + lateness.worst_s(clicked_s)
    assert read_samples(desk.folder() / "samples.arrows")["velocity_command_rad_s"][-1] == 0.0
    page.wait_for_function("document.getElementById('state').textContent === 'ended: fail'")
    page.wait_for_function("document.activeElement.matches('.tab')")  # for the next Tab


NOTE_CLICK = """addEventListener("pointerdown", (event) => {
  window.clickedS = (performance.timeOrigin + event.timeStamp) / 1000; }, true)"""


def zero_s(console):
    """Return when the command was zero after the stop, on CLOCK_MONOTONIC."""
    samples = read_samples(console.folder() / "samples.arrows")
    assert np.any(samples["velocity_command_rad_s"])
    stopped = samples["cause"] == int(Cause.EMERGENCY_STOP)
    assert not np.any(samples["velocity_command_rad_s"][stopped][1:])
    at_rest = stopped & (samples["velocity_command_rad_s"] == 0.0)
    return monotonic_origin_s(console) + samples["time_s"][at_rest][0]


@pytest.mark.parametrize("frozen", [False, True])
def test_a_page_that_watches_stops_the_arm_also_while_that_in_control_is_frozen(
    console, chromium, lateness, frozen
):
    desk = console()
    page, other = open_page(chromium, desk), open_page(chromium, desk)
    start(page)
    page.wait_for_function(RUNS)
    other.get_by_text("watching: it can only stop").wait_for()
    other.evaluate(NOTE_CLICK)
    if frozen:  # for a time in which its silence does not stop the arm yet
        page.evaluate("setTimeout(() => { for (const t = Date.now() + 300; Date.now() < t;); }, 0)")
    other.locator("#emergency").click()
    wall_s = time.monotonic() - time.time()
    assert "emergency stop" in desk.ended()["reason"]
    clicked_s = other.evaluate("window.clickedS") + wall_s
    took_s = zero_s(desk) - clicked_s
    print(f"zero velocity {took_s:.3f} s after the click of a page that watches")
    assert took_s < 0.1 + lateness.worst_s(clicked_s)
    for one in (page, other):
        one.wait_for_function("document.getElementById('state').textContent === 'ended: fail'")


def test_a_page_that_watches_stops_a_check_of_the_rig(console, chromium):
    desk = console()
    page, other = open_page(chromium, desk), open_page(chromium, desk)
    fill(page, "subject", "S01")
    fill(page, "operator", "Op")
    page.get_by_role("button", name="Check the rig").click()
    page.get_by_text("Nobody's arm may be in the rig").wait_for()
    other.locator("#emergency:enabled").click()
    page.get_by_text("✗ not good:").wait_for()
    other.wait_for_function("document.getElementById('emergency').disabled")


@pytest.mark.parametrize("key", [b" ", b"e"])
def test_the_terminal_that_serves_the_page_stops_the_arm(chromium, lateness, tmp_path, key):
    far, near = pty.openpty()
    before = termios.tcgetattr(near)
    desk = Console(tmp_path, protocol=PROTOCOL, stdin=near)
    try:
        wait_for(lambda: any(KEYS_HERE in line for line in desk.said))
        page = open_page(chromium, desk)
        start(page)
        page.wait_for_function(RUNS)
        os.write(far, b"p")  # no order here
        assert not text(page, "state").startswith("ended")
        pressed_s = time.monotonic()
        os.write(far, key)
        assert "emergency stop" in desk.ended()["reason"]
        took_s = zero_s(desk) - pressed_s
        print(f"zero velocity {took_s:.3f} s after the key at the terminal")
        assert took_s < 0.15 + lateness.worst_s(pressed_s)
        page.wait_for_function("document.body.dataset.view === 'after'")
        page.get_by_role("button", name="Before").click()
        page.get_by_role("button", name="Check the rig").click()
        page.get_by_text("Nobody's arm may be in the rig").wait_for()
        os.write(far, key)
        page.get_by_text("✗ not good:").wait_for()
    finally:
        desk.close()
    assert termios.tcgetattr(near) == before
    seen = os.read(far, 1 << 16)
    assert b"emergency stop" in seen
    assert BELL.encode() in seen
    os.close(far)
    os.close(near)


LOUDEST = """async () => {
  const { context, out } = window.rigTones, ear = context.createAnalyser();
  ear.fftSize = 8192;
  out.connect(ear);
  const found = new Set(), heights = new Float32Array(ear.frequencyBinCount);
  for (const end = performance.now() + 3000; performance.now() < end;) {
    await new Promise((done) => setTimeout(done, 20));
    ear.getFloatFrequencyData(heights);
    const most = heights.indexOf(Math.max(...heights));
    if (heights[most] > -30) found.add(Math.round(most * context.sampleRate / 8192 / 100) * 100);
  }
  return [context.state, [...found]];
}"""


def test_the_button_of_the_form_plays_both_tones_and_allows_them(console, chromium):
    page = open_page(chromium, console())
    page.get_by_text("no tones yet: click").wait_for()
    page.get_by_role("button", name="Test the tones").click()
    state, heard = page.evaluate(LOUDEST)
    assert state == "running"
    assert heard == [400, 1000]  # first the caution, then the stop
    page.wait_for_function("document.getElementById('tones').textContent === ''")


def test_a_frozen_page_stops_the_arm(console, chromium, lateness):
    desk = console()
    page = open_page(chromium, desk)
    start(page)
    page.wait_for_function(RUNS)
    found = chromium.new_browser_cdp_session().send("SystemInfo.getProcessInfo")
    pids = [one["id"] for one in found["processInfo"] if one["type"] == "renderer"]
    frozen_s = time.monotonic()
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        assert "console no longer answered" in desk.ended()["reason"]
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
    stopped_s = monotonic_origin_s(desk) + desk.ended()["time_s"]
    assert 0.2 < stopped_s - frozen_s < 0.5 + lateness.worst_s(frozen_s)


def test_a_killed_server_stops_the_arm_and_a_new_page_offers_the_rest(console, chromium, lateness):
    """The loop brings the arm to rest by itself, closes the record, and nothing of it is lost."""
    desk = console()
    page = open_page(chromium, desk)
    start(page)
    page.wait_for_function(RUNS)
    desk.process.kill()
    killed_s = time.monotonic()
    broken = desk.folder()
    assert "console no longer answered" in desk.ended()["reason"]
    samples = read_samples(broken / "samples.arrows")
    assert np.all(np.diff(samples["tick"]) >= 1)
    moving = np.flatnonzero(samples["velocity_command_rad_s"])[-1]
    rest_s = monotonic_origin_s(desk) + samples["time_s"][moving + 1] - killed_s
    print(f"at rest {rest_s:.3f} s after the server was killed")
    assert rest_s < 0.3 + lateness.worst_s(killed_s)
    assert samples["time_s"][-1] >= desk.ended()["time_s"] - 0.01
    page.get_by_text("The connection to the program is lost").wait_for()
    page.context.close()
    again = console()
    page = open_page(chromium, again)
    page.get_by_role("button", name="After", exact=True).click()
    page.locator(".session").get_by_text(f"{broken.name}:").click()
    # What comes of a click is seen in `test_operator_day`.
    page.get_by_role("button", name="Run what is left: 2").wait_for()
    assert page.get_by_role("button", name="Run what is left: 2").is_enabled()


def test_a_closed_tab_pauses_at_once(console, chromium, lateness):
    desk = console()
    page = open_page(chromium, desk)
    start(page)
    page.wait_for_function(RUNS)
    closed_s = time.monotonic()
    page.close(run_before_unload=True)
    wait_for(lambda: [e for e in desk.events() if e["event"] == "order"])
    order = next(e for e in desk.events() if e["event"] == "order")
    assert (order["command"], order["state"]) == ("pause_now", "paused")
    paused_s = monotonic_origin_s(desk) + order["time_s"]
    assert paused_s - closed_s < 0.5 + lateness.worst_s(closed_s)
