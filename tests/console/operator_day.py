"""What an operator does on the page in a day, click by click; not a test itself."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import Page, expect
from tests.console.opened import STARTS_S, Console, wait_for

LONG_MS = 1e3 * STARTS_S
RUNS = "document.getElementById('state').textContent === 'epoch runs'"
MEMORY = Path("/dev/shm")


def in_epoch(page: Page, place: str) -> None:
    """Wait until the epoch runs that is shown so, such as ``2 of 4``."""
    page.wait_for_function(
        f"{RUNS} && document.getElementById('epoch').textContent === '{place}'", timeout=LONG_MS
    )


def rate(page: Page, place: int, score: str) -> None:
    """Rate the epoch of this place after it has ended."""
    page.wait_for_function(
        f"document.getElementById('rated').textContent === 'epoch {place}'", timeout=LONG_MS
    )
    page.locator("#examiner").fill("E1")
    page.locator("#score").fill(score)
    page.locator("#score").press("Enter")
    expect(page.locator("#said")).to_contain_text(f"rating of epoch {place}: ")


def over(page: Page, outcome: str) -> str:
    """Wait until the page says that the session is over; return what it says."""
    page.wait_for_function("document.body.dataset.view === 'after'", timeout=LONG_MS)
    expect(page.locator("#state")).to_have_text(f"ended: {outcome}")
    return page.locator("#banner").text_content() or ""


def opened_session(page: Page, name: str):
    """Return a session under After, unfolded."""
    page.get_by_role("button", name="After", exact=True).click()
    session = page.locator(".session").filter(has_text=f"{name}:")
    header = session.get_by_text(f"{name}:")
    header.wait_for()
    if not session.get_by_role("button", name="Estimate").is_visible():
        header.click()
    expect(session.get_by_role("button", name="Estimate")).to_be_visible()
    return session


def click_and_run(console: Console, page: Page, session, button: str) -> Path:
    """Click a button that runs a session; return its folder once it records."""
    before = set(console.sessions.iterdir())
    session.get_by_role("button", name=button).first.click()
    return wait_for(
        lambda: next(
            (
                path
                for path in console.sessions.iterdir()
                if path not in before and (path / "manifest.json").exists()
            ),
            None,
        )
    )


def kill_all(console: Console) -> float:
    """Kill server, loop and recorder at once, and forget their memory, as a power cut does.

    Returns
    -------
    float
        When, on CLOCK_MONOTONIC.
    """
    mine = {
        int(path.name): path
        for path in Path("/proc").glob("[0-9]*")
        if _group(path) == console.process.pid
    }
    mapped = {
        Path(line.split()[-1])
        for process in mine.values()
        for line in (process / "maps").read_text().splitlines()
        if f" {MEMORY}/rigidimeter-" in line and not line.endswith("(deleted)")
    }
    assert len(mine) >= 3
    assert mapped
    os.killpg(console.process.pid, signal.SIGKILL)
    killed_s = time.monotonic()
    console.process.wait(30)
    wait_for(lambda: not any(_group(path) == console.process.pid for path in mine.values()))
    for path in mapped:
        path.unlink(missing_ok=True)
    return killed_s


def _group(process: Path) -> int:
    """Return the group of a process that lives; 0 for any other."""
    try:
        state = (process / "stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0
    return 0 if state[0] in "ZX" else int(state[2])


def leave_out(page: Page, session, epoch: str, reason: str, by: str) -> None:
    """Leave an epoch out with a reason and a name."""
    row = session.locator(".row").filter(has_text=f"epoch {epoch} ·").last
    row.get_by_role("button", name="Leave out").click()
    page.locator("input[data-field=reason]").fill(reason)
    page.locator("input[data-field=by]").fill(by)
    page.get_by_role("dialog").get_by_role("button", name="Leave out").click()
    expect(session.get_by_text(f"left out: {reason} ({by})")).to_be_visible()


def study_report(page: Page) -> Page:
    """Make the report of the study by its button, and open it by its link."""
    page.get_by_role("button", name="After", exact=True).click()
    page.get_by_role("button", name="Report of the study").click()
    link = page.get_by_role("link", name="Open the report of the study")
    link.wait_for(timeout=3 * LONG_MS)
    with page.context.expect_page() as opened:
        link.click()
    opened.value.wait_for_load_state()
    return opened.value


def command(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a command of rigidimeter."""
    words = [sys.executable, "-m", "rigidimeter", *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=300)
