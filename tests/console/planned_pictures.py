"""Pictures of a plan of nine days, drawn on the page, made by `python -m tests.docs.pictures`.

The plan is drawn and written; its first session is begun too early, runs on the virtual rig in real
time, and is rated.
"""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Page
from tests.browser import open_browser
from tests.console.opened import Console, fill, open_page
from tests.console.operator_day import LONG_MS
from tests.console.pictures import ATTEMPTS, ENDED, STATE, take

PROTOCOL = """
prbs.duration_s = 5.0
protocol.rests_s = [1.0]
protocol.return_s = 4.0
loop.stall_s = 0.2
rig = {tick_rate_hz = 250.0, torque = {rate_hz = 250.0}, motion = {rate_hz = 250.0}}
zeroing.duration_s = 0.5
"""
PLAN = {
    "subjects": "S01",
    "days": "9",
    "days_of": "DBS=4",
    "seed": "7",
    "prbs_epochs": "1",
    "sinusoid_epochs": "0",
    "raters": "A,B,C",
}
SCORES = {"A": "2", "B": "1.5"}
DRAWN_HEIGHT = 1150


def drawn(page: Page, folder: Path) -> list[str]:
    """Draw the plan, take its picture and write it."""
    page.get_by_text("Plan the days").click()
    for key, value in PLAN.items():
        fill(page, f"plan_{key}", value)
    page.get_by_role("button", name="Draw the plan").click()
    page.get_by_text("13 sessions on 9 days").wait_for()
    page.evaluate("scrollTo(0, 0)")
    words = take(page, folder, "drawn", DRAWN_HEIGHT)
    page.get_by_role("button", name="Write this plan").click()
    page.get_by_text("Session 1 of 13 of S01").first.wait_for()
    page.wait_for_function("document.body.dataset.view === 'before'", timeout=LONG_MS)
    return words


def too_early(page: Page, folder: Path) -> list[str]:
    """Begin the first session too early, and take a picture before it."""
    fill(page, "operator", "Kim")
    for state in ("on", "off"):
        fill(page, "stimulation", state)
        page.get_by_role("button", name="Enter the change").click()
        page.wait_for_timeout(1000)
    page.get_by_text("min more, of 60 min").wait_for()
    fill(page, "begin_anyway", "the subject must leave")
    words = take(page, folder, "due")
    page.get_by_role("button", name="Begin anyway").click()
    return words


def well_ended(page: Page) -> bool:
    """Wait for the end of the session; return whether it went well."""
    page.wait_for_function("document.body.dataset.view === 'during'", timeout=LONG_MS)
    page.wait_for_function(ENDED, timeout=LONG_MS)
    return bool(page.evaluate(f"{STATE} === 'ended: success'"))


def rated(page: Page, rater: str, score: str) -> None:
    """Rate the session after it."""
    page.get_by_role("button", name="Rate", exact=True).first.click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Examiner").click()
    page.get_by_role("option", name=rater, exact=True).click()
    fill(page, "rating", score)
    dialog.get_by_role("button", name="Save").click()
    page.get_by_text(f"{rater}: {score}").wait_for()


def planned_pictures(folder: Path, place: Path) -> dict[str, list[str]]:
    """Take the pictures; return the words of each."""
    for attempt in range(ATTEMPTS):  # a busy machine stops the arm
        here = place / str(attempt)
        here.mkdir(parents=True)
        desk = Console(here, protocol=PROTOCOL)
        try:
            with open_browser() as opened:
                page = open_page(opened, desk)
                words = {"drawn": drawn(page, folder), "due": too_early(page, folder)}
                if not well_ended(page):
                    continue
                for rater, score in SCORES.items():
                    rated(page, rater, score)
                return words | {"ended": take(page, folder, "ended")}
        finally:
            desk.close()
    raise RuntimeError("the machine is too busy for these pictures")
