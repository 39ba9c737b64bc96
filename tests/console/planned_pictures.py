"""Pictures of the days of a plan: `python -m tests.console.planned_pictures FOLDER`.

Nine days, 13 sessions of one epoch, from the page on the virtual rig, on a fast clock of the waits:
about five minutes. One session is begun too early, two are swapped, one is cut short.
"""

from __future__ import annotations

import csv
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Page, expect
from tests.browser import open_browser
from tests.console.opened import Console, fill, open_page
from tests.console.operator_day import LONG_MS, RUNS, command, study_report
from tests.console.pictures import ATTEMPTS, take

SHARED = """
prbs.duration_s = 5.0
protocol.rests_s = [1.0]
protocol.return_s = 4.0
loop.stall_s = 0.2
rig = {tick_rate_hz = 250.0, torque = {rate_hz = 250.0}, motion = {rate_hz = 250.0}}
zeroing.duration_s = 0.5
"""
PLAN = (
    "--subjects", "S01", "--days", 9, "--days-of", "DBS=4", "--order", "OFF,DBS", "--seed", 7,
    "--prbs-epochs", 1, "--sinusoid-epochs", 0, "--raters", "A,B,C",
)  # fmt: skip
EARLY, CUT_SHORT = ("1", "1"), ("4", "1")
REASON = "the subject must leave"
SCORES = {"A": "2", "B": "1.5"}
ENDED = "document.getElementById('state').textContent.startsWith('ended')"
SUCCESS = "document.getElementById('state').textContent === 'ended: success'"


def before(page: Page) -> None:
    """Go to the part before a session."""
    page.wait_for_timeout(1000)  # the part after a session comes by itself
    page.get_by_role("button", name="Before", exact=True).click()
    page.wait_for_function("document.body.dataset.view === 'before'")


def chosen(page: Page, day: str, order: str) -> None:
    """Choose a session that is not the one that is due."""
    page.get_by_label("Session", exact=True).click()
    page.get_by_role("option", name=f"{day}/{order}", exact=True).click()


def switched(page: Page, state: str) -> None:
    """Enter that the stimulation was switched."""
    fill(page, "stimulation", state)
    page.get_by_role("button", name="Enter the change").click()


def begun(page: Page, *, anyway: bool = False) -> bool:
    """Start the session, or begin it anyway; return whether an epoch of it runs."""
    if anyway:
        page.get_by_role("button", name="Begin anyway").click()
    else:
        start = page.get_by_role("button", name="Start session")
        expect(start).to_be_enabled(timeout=LONG_MS)
        start.click()
    page.wait_for_function("document.body.dataset.view === 'during'", timeout=LONG_MS)
    page.wait_for_function(f"{RUNS} || {ENDED}", timeout=LONG_MS)
    return bool(page.evaluate(RUNS))


def ended(page: Page) -> bool:
    """Wait for the end of the session; return whether it went well."""
    page.wait_for_function(ENDED, timeout=LONG_MS)
    if not page.evaluate(SUCCESS):
        print(page.locator("#banner").text_content(), flush=True)
    return bool(page.evaluate(SUCCESS))


def rated(page: Page, rater: str, score: str) -> None:
    """Rate the newest session after it."""
    page.get_by_role("button", name="Rate", exact=True).first.click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("Examiner").click()
    page.get_by_role("option", name=rater, exact=True).click()
    fill(page, "rating", score)
    dialog.get_by_role("button", name="Save").click()
    page.get_by_text(f"{rater}: {score}").wait_for()


def session(page: Page, folder: Path, key: tuple[str, str], state: str) -> bool:
    """Carry out the session that is shown; return whether it went as it was meant to."""
    if key == EARLY:
        for one in ("on", "off"):
            switched(page, one)
            page.wait_for_timeout(1000)
        page.get_by_text("min more, of 60 min").wait_for()
        fill(page, "begin_anyway", REASON)
        take(page, folder, "due")
        begun(page, anyway=True)
        if not ended(page):
            return False
        for rater, score in SCORES.items():
            rated(page, rater, score)
        return True
    if page.get_by_text("has not begun").is_visible():
        switched(page, state)
    running = begun(page)
    if key == CUT_SHORT and running:
        page.get_by_role("button", name="Abort").click()
        ended(page)
        return True
    return ended(page)


def nine_days(page: Page, folder: Path, blocks: list[dict[str, str]]) -> None:
    """Carry out the plan."""
    state = {"OFF": "off", "DBS": "on"}
    swapped = next(k for k, one in enumerate(blocks) if one["order"] == "2" and one["day"] > "4")
    blocks[swapped - 1 : swapped + 1] = [blocks[swapped], blocks[swapped - 1]]
    for k, one in enumerate(blocks):
        key = one["day"], one["order"]
        for attempt in range(ATTEMPTS):  # a busy machine stops the arm
            before(page)
            if attempt or k == swapped - 1:
                chosen(page, *key)
            shown = page.locator("#view-before").get_by_text(f"day {key[0]}, number {key[1]},")
            shown.wait_for(timeout=LONG_MS)
            if session(page, folder, key, state[one["condition"]]):
                break
        print(f"day {key[0]}, number {key[1]}, {one['condition']}", flush=True)
        if key == EARLY:
            page.get_by_text("Ratings: ").wait_for()
            take(page, folder, "ended")


def pictures(folder: Path, place: Path) -> None:
    """Plan, carry out, compare, and take the pictures."""
    study = place / "sessions"
    (place / "shared.toml").write_text(SHARED)
    ran = command("study", "plan", study, *PLAN, "--settings", place / "shared.toml")
    assert ran.returncode == 0, ran.stderr
    with (study / "plan.csv").open() as table:
        blocks = list(csv.DictReader(table))
    desk = Console(place, "--clock-speed", "400")
    try:
        with open_browser() as opened:
            page = open_page(opened, desk)
            fill(page, "operator", "Kim")
            nine_days(page, folder, blocks)
            before(page)
            page.get_by_text("Plan", exact=True).last.click()
            take(page, folder, "done")
            print(command("compare", study).stdout)
            report = study_report(page)
            print(" ".join(report.locator("body").inner_text().split())[:3000])
            take(report, folder, "report")
    finally:
        desk.close()


if __name__ == "__main__":
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="planned-days-") as name:
        pictures(out, Path(name))
