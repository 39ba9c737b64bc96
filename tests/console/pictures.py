"""Pictures of an operator's day for its tutorial, made by `python -m tests.docs.pictures`.

Up to the computer's failure the day runs on the virtual rig in real time.
"""

from __future__ import annotations

from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page
from tests.browser import open_browser
from tests.console.opened import Console, fill, open_page, start
from tests.console.operator_day import (
    LONG_MS,
    RUNS,
    click_and_run,
    command,
    in_epoch,
    kill_all,
    opened_session,
    over,
    rate,
    study_report,
)
from tests.docs.pictures import ON_PAGE, seen

PROTOCOL = """
prbs.duration_s = 8.0
protocol.rests_s = [3.0]
protocol.return_s = 1.0
loop.stall_s = 0.2
rig = {tick_rate_hz = 250.0, torque = {rate_hz = 250.0}, motion = {rate_hz = 250.0}}
protocol.blocks = [
  {task = "prbs", condition = "OFF", epochs = 3},
  {task = "prbs", condition = "DBS", epochs = 3},
]
"""
WIDTH, HEIGHT, REPORT_HEIGHT, LIST_HEIGHT = 1100, 860, 1080, 1120
FORM_HEIGHT = 1000
COLOURS = 256
ATTEMPTS = 6
STATE = "document.getElementById('state').textContent"
ENDED = f"document.body.dataset.view === 'after' && {STATE}.startsWith('ended')"
SEEN_MS = 6000
"""After that time in an epoch J, B and K are shown."""


def take(page: Page, folder: Path, name: str, height: int = HEIGHT) -> list[str]:
    """Take a picture of what is seen without scrolling; return the words of buttons and labels."""
    page.set_viewport_size({"width": WIDTH, "height": height})
    page.wait_for_timeout(400)
    path = folder / f"{name}.png"
    page.screenshot(path=path)
    with Image.open(path) as taken:
        small = taken.convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE)
    small.save(path, optimize=True)
    return seen(page, ON_PAGE)


def run_rest(desk: Console, page: Page, name: str, button: str, until: str) -> None:
    """Run what is left of a session until the page shows so; again where a busy machine stopped it.

    `until` is an expression of the page, such as that an epoch runs.
    """
    for attempt in range(ATTEMPTS):
        session = opened_session(page, name if attempt == 0 else desk.folder().name)
        click_and_run(desk, page, session, button if attempt == 0 else "Run what is left")
        page.wait_for_function("document.body.dataset.view === 'during'", timeout=LONG_MS)
        while not page.evaluate(ENDED):
            if page.evaluate(until):
                return
            page.wait_for_timeout(200)
    raise RuntimeError("the machine is too busy for these pictures")


def pictures(folder: Path, sessions: Path) -> dict[str, list[str]]:
    """Run the day and take its pictures; return the words of each."""
    words: dict[str, list[str]] = {}
    desk = Console(sessions, protocol=PROTOCOL)
    with open_browser() as opened:
        page = open_page(opened, desk)
        page.get_by_text("Stimulation (leave empty").click()
        for key, value in {"subject": "S01", "operator": "Kim", "stim_frequency": "130",
                           "stim_ma": "2,5", "stim_width": "60"}.items():  # fmt: skip
            fill(page, key, value)
        page.wait_for_timeout(1000)
        words["form"] = take(page, folder, "form", FORM_HEIGHT)
        start(page, operator="Kim")
        in_epoch(page, "1 of 6")
        page.wait_for_timeout(SEEN_MS)
        words["epoch"] = take(page, folder, "epoch")
        rate(page, 1, "2")
        in_epoch(page, "2 of 6")
        page.keyboard.press("Escape")
        over(page, "fail")
        first = desk.folder()
        session = opened_session(page, first.name)
        session.get_by_role("button", name="Estimate").hover()
        words["stopped"] = take(page, folder, "stopped")
        third = "document.getElementById('epoch').textContent === '3 of 6'"
        run_rest(desk, page, first.name, "Run what is left: 5", f"{RUNS} && {third}")
        kill_all(desk)
        page.close()
        desk = Console(sessions, protocol=PROTOCOL)
        page = open_page(opened, desk)
        words["restarted"] = take(page, folder, "restarted")
        page.close()
        desk.close()
        words |= after_pictures(opened, folder, sessions / "after")
    return words


def after_pictures(opened: Browser, folder: Path, place: Path) -> dict[str, list[str]]:
    """Take those of an epoch left out and of the report, after a day that was not in real time."""
    words = {}
    protocol, name = place / "day.toml", "S01-1"
    (place / "sessions").mkdir(parents=True)
    protocol.write_text(PROTOCOL)
    again = ("--task", "prbs", "--condition", "OFF", "--epochs", 1)
    for made in (
        command("simulate", "--settings", protocol, "--out", place / "sessions" / name),
        command("simulate", "--settings", protocol, "--out", place / "sessions/S01-2", *again),
        command("study", "add", place / "sessions", "--subject", "S01"),
    ):
        assert made.returncode == 0, made.stderr
    desk = Console(place, protocol=PROTOCOL)
    page = open_page(opened, desk)
    page.set_viewport_size({"width": WIDTH, "height": LIST_HEIGHT})  # nothing is scrolled
    session = opened_session(page, name)
    session.get_by_role("button", name="Leave out").first.click()
    page.locator("input[data-field=reason]").fill("coughed")
    page.locator("input[data-field=by]").fill("Kim")
    words["leave-out"] = take(page, folder, "leave-out", LIST_HEIGHT)
    page.get_by_role("dialog").get_by_role("button", name="Leave out").click()
    words["report"] = take(study_report(page), folder, "report", REPORT_HEIGHT)
    page.close()
    desk.close()
    return words
